// SPDX-License-Identifier: MIT
#include "registration/search.h"

#include <gtest/gtest.h>

#include "clouds.h"
#include "registration/newton.h"

namespace minescan {
namespace {

/// Points and their partners under `truth`: a least squares problem with one minimum, of value 0.
struct Pairs {
  std::vector<Eigen::Vector3d> source = {}, target = {};

  explicit Pairs(const Pose& truth) {
    source = bumpy_tunnel(500, 1).points;
    for (const Eigen::Vector3d& p : source) target.push_back(truth * p);
  }
  double value(const Pose& T) const {
    double sum = 0;
    for (std::size_t i = 0; i < source.size(); ++i)
      sum += (T * source[i] - target[i]).squaredNorm() / 2;
    return sum;
  }
  Score score(const Pose& T, Curvature curvature) const {
    Score sum{.value = value(T), .met = source.size()};
    for (std::size_t i = 0; i < source.size(); ++i) {
      const Eigen::Vector3d y = T.linear() * source[i];
      const Eigen::Vector3d v = y + T.translation() - target[i];
      Eigen::Matrix<double, 3, 6> J;
      J << Eigen::Matrix3d::Identity(), -skew(y);
      sum.gradient += J.transpose() * v;
      sum.hessian += J.transpose() * J;
      if (curvature == Curvature::gauss_newton) continue;
      sum.hessian.bottomRightCorner<3, 3>() += (v * y.transpose() + y * v.transpose()) / 2;
      sum.hessian.bottomRightCorner<3, 3>().diagonal().array() -= v.dot(y);
    }
    return sum;
  }
  Objective objective() const {
    return {.score = [this](const Pose& T, Curvature c) { return score(T, c); },
            .value = [this](const Pose& T) { return value(T); },
            .length = rms_distance(source)};
  }
};

TEST(Minimise, EveryOptimiserFindsTheOneMinimum) {
  const Pose truth = displaced(Pose::Identity(), {0.4, -0.3, 0.2}, {0.5, -0.3, 0.8}, 0.3);
  const Pairs pairs(truth);
  for (const Optimiser optimiser :
       {Optimiser::newton, Optimiser::gauss_newton, Optimiser::levenberg_marquardt}) {
    for (const Repair repair : {Repair::shift, Repair::absolute}) {
      const Found found = minimise(pairs.objective(), Pose::Identity(),
                                   {.optimiser = optimiser, .repair = repair, .stop_step = 1e-9});
      EXPECT_TRUE(found.converged);
      EXPECT_LT(pose_error(truth, found.pose).translation, 1e-9);
      EXPECT_LT(pose_error(truth, found.pose).rotation, 1e-9);
      EXPECT_LT(found.score.value, 1e-12);
      EXPECT_GE(found.evaluations, found.iterations);
      EXPECT_LT(found.iterations, 60);  // 0.05 per step: at least 12
    }
  }
}

TEST(Minimise, StopsWhereItIsTold) {
  const Pairs pairs(displaced(Pose::Identity(), {0.4, -0.3, 0.2}, {0.5, -0.3, 0.8}, 0.3));
  for (const Optimiser optimiser : {Optimiser::newton, Optimiser::levenberg_marquardt}) {
    const Found found = minimise(pairs.objective(), Pose::Identity(),
                                 {.optimiser = optimiser, .max_iterations = 3});
    EXPECT_FALSE(found.converged);
    EXPECT_EQ(found.iterations, 3);
    EXPECT_LT(found.score.value, pairs.value(Pose::Identity()));
  }
}

TEST(Minimise, ASurfaceThatHoldsNothingIsNoPlaceToGo) {
  const Objective nothing{.score = [](const Pose&, Curvature) { return Score{}; },
                          .value = [](const Pose&) { return 0.0; }};
  for (const Optimiser optimiser : {Optimiser::newton, Optimiser::levenberg_marquardt}) {
    const Found found = minimise(nothing, Pose::Identity(), {.optimiser = optimiser});
    EXPECT_TRUE(found.pose.isApprox(Pose::Identity(), 0));
  }
}

}  // namespace
}  // namespace minescan
