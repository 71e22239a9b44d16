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

// The first steps lead from (1, 0, 0) to nearly (0, 1, 0), where the norm of the parameters is the
// same; they are refused, since it is not lower there, and say nothing of an end.
TEST(Minimise, RefusedStepsDoNotEndASearchByTheNorm) {
  const Eigen::Vector3d start = Eigen::Vector3d::UnitX(), lowest = Eigen::Vector3d::UnitY();
  const auto value = [&](const Pose& T) {
    const Eigen::Vector3d t = T.translation();
    return (t - start).norm() > 0.5 ? 1 : (t - lowest).squaredNorm() / 2;
  };
  const auto score = [&](const Pose& T, Curvature) {
    Score at{.value = value(T), .met = 1};
    at.gradient.head<3>() = T.translation() - lowest;
    at.hessian.setIdentity();
    return at;
  };
  const Pose from(Eigen::Translation3d{start});
  EXPECT_EQ(value(from), 1);
  const Found found =
      minimise({.score = score, .value = value}, from,
               {.optimiser = Optimiser::levenberg_marquardt, .max_step = 10, .stop_step = 0.01},
               {.form = PoseForm::rotation_vector, .stop_rule = StopRule::norm_change});
  EXPECT_LT(found.score.value, 0.99);
  EXPECT_GT(found.iterations, 2);
}

}  // namespace
}  // namespace minescan
