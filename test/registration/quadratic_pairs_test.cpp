// SPDX-License-Identifier: MIT
#include "registration/quadratic_pairs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "clouds.h"
#include "registration/newton.h"

namespace minescan {
namespace {

/// Random functions, some of which are saddles.
std::vector<QuadraticPair> random_pairs(std::size_t count) {
  Random random(1, 0);
  std::vector<QuadraticPair> pairs(count);
  for (QuadraticPair& pair : pairs) {
    Eigen::Matrix3d A;
    for (int i = 0; i < 3; ++i) A.col(i) = random_vector(random);
    pair = {.point = 3 * random_vector(random),
            .quadric = {.centre = 3 * random_vector(random),
                        .A = A + A.transpose(),
                        .b = random_vector(random),
                        .c = random.normal()},
            .normal = random_vector(random).normalized(),
            .weight = 1 + random.uniform()};
  }
  return pairs;
}

/// Half the weighted sum, from its definition.
double value(const std::vector<QuadraticPair>& pairs, const Pose& T) {
  double sum = 0;
  for (const QuadraticPair& pair : pairs) sum += pair.weight * pair.quadric(T * pair.point) / 2;
  return sum;
}

Vector6d unit(int i) { return Vector6d::Unit(i); }

TEST(QuadraticScore, DerivativesMatchCentralDifferences) {
  const std::vector<QuadraticPair> pairs = random_pairs(20);
  Random random(2, 0);
  for (int trial = 0; trial < 10; ++trial) {
    const Pose T = random_pose(random, 1, 1);
    const Score score = quadratic_score(pairs, T, Curvature::full);
    const double size = score.hessian.cwiseAbs().maxCoeff();
    EXPECT_NEAR(score.value, value(pairs, T), 1e-12 * size);  // rounding
    const double h = 1e-4;
    // h^2 times higher derivatives, as large as the second ones; rounding is 1e-16 / h^2.
    for (int i = 0; i < 6; ++i) {
      const double up = value(pairs, stepped(T, h * unit(i))),
                   down = value(pairs, stepped(T, -h * unit(i)));
      EXPECT_NEAR(score.gradient[i], (up - down) / (2 * h), 1e-7 * size) << i;
      // Along a screw the slope is the same: that is where both motions begin.
      const double screw_up = value(pairs, screwed(T, h * unit(i))),
                   screw_down = value(pairs, screwed(T, -h * unit(i)));
      EXPECT_NEAR(score.gradient[i], (screw_up - screw_down) / (2 * h), 1e-7 * size) << i;
      for (int j = 0; j <= i; ++j) {
        const auto at = [&](double a, double b) {
          return value(pairs, stepped(T, h * (a * unit(i) + b * unit(j))));
        };
        const double mixed = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * h * h);
        EXPECT_NEAR(score.hessian(i, j), mixed, 1e-6 * size) << i << " " << j;
      }
    }
  }
}

// The exponential of the twist as a 4 x 4 matrix, by its series.
TEST(Screwed, IsTheExponentialOfTheTwist) {
  Random random(3, 0);
  for (const double scale : {0.0, 1e-9, 1e-5, 1.1e-4, 0.009, 0.011, 0.3, 2.0}) {
    const Pose T = random_pose(random, 3, 2);
    Vector6d step;
    step << random_vector(random), scale * random_vector(random);
    // The velocity of a point x is tau + omega x (x - t).
    Eigen::Matrix4d twist = Eigen::Matrix4d::Zero();
    twist.topLeftCorner<3, 3>() = skew(step.tail<3>());
    twist.topRightCorner<3, 1>() = step.head<3>() - step.tail<3>().cross(T.translation());
    Eigen::Matrix4d exponential = Eigen::Matrix4d::Identity(), term = exponential;
    for (int n = 1; n < 60; ++n) {
      term = term * twist / n;
      exponential += term;
    }
    // Rounding; the series of the coefficients leaves out a^4 / 5040 of 0.01^4 = 2e-12.
    EXPECT_TRUE(screwed(T, step).matrix().isApprox(exponential * T.matrix(), 1e-11)) << scale;
  }
}

TEST(Screwed, TurnsAboutItsAxisAndSlidesAlongIt) {
  const Eigen::Vector3d omega(0.2, -0.3, 0.4), tau(0.5, 0.1, -0.7);
  Vector6d step;
  step << tau, omega;
  const Pose moved = screwed(Pose::Identity(), step);
  const Eigen::Vector3d on_axis = omega.cross(tau) / omega.squaredNorm();
  const double along = omega.dot(tau) / omega.norm();
  EXPECT_TRUE((moved * on_axis).isApprox(on_axis + along * omega.normalized(), 1e-12));
}

TEST(StepAndPair, EndsWhereAllFunctionsAreLowest) {
  const PointCloud target = bumpy_tunnel(200, 1);
  Random random(4, 0);
  for (const Motion motion : {Motion::separate, Motion::screw}) {
    const Pose truth = random_pose(random, 3, 2);
    const PointCloud source = transformed(truth.inverse(), target);
    const FindPairs find = [&](const Pose&, std::vector<QuadraticPair>& pairs) {
      pairs.clear();
      for (std::size_t i = 0; i < 200; ++i)
        pairs.push_back(
            {.point = source.points[i],
             .quadric = {.centre = target.points[i], .A = Eigen::Matrix3d::Identity()}});
      return pairs.size();
    };
    RegistrationResult result{
        .T_target_source = displaced(truth, {0.5, -0.4, 0.3}, {0.1, 0.7, 0.2}, 0.4),
        .status = Status::max_iterations};
    const SearchOptions search{
        .optimiser = Optimiser::gauss_newton, .max_step = 1, .stop_step = 1e-9};
    const PairsAtEnd end = step_and_pair(find, 6, 5, motion, search, result);
    EXPECT_EQ(result.status, Status::converged);
    EXPECT_EQ(end.met, 200u);
    EXPECT_LT(result.iterations, 12);  // Newton's steps, quadratic at the end
    EXPECT_LT(pose_error(truth, result.T_target_source).translation, 1e-9);  // rounding
    EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 1e-9);

    RegistrationResult lost{.T_target_source = truth, .status = Status::max_iterations};
    step_and_pair(find, 201, 5, motion, search, lost);
    EXPECT_EQ(lost.status, Status::no_overlap);
  }
}

}  // namespace
}  // namespace minescan
