// SPDX-License-Identifier: MIT
#include "registration/d2d.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "clouds.h"
#include "registration/newton.h"

namespace minescan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

Distribution random_distribution(Random& random) {
  Matrix3d A;
  for (int i = 0; i < 3; ++i) A.col(i) = 0.4 * random_vector(random);
  return {.mean = random_vector(random),
          .covariance = A * A.transpose() + 0.05 * Matrix3d::Identity()};
}

TEST(D2dScore, DerivativesMatchCentralDifferences) {
  for (std::uint64_t stream = 0; stream < 50; ++stream) {
    Random random(1, stream);
    const Distribution target = random_distribution(random), source = random_distribution(random);
    Pose T = random_pose(random, 1, 1);
    // Near enough for a term that is not 0.
    T.translation() = target.mean - T.linear() * source.mean + 0.5 * random_vector(random);
    const double d2 = 0.5;
    const auto value = [&](const Vector6d& step) {
      return d2d_score(target, source, stepped(T, step), d2).value;
    };
    const Score score = d2d_score(target, source, T, d2);
    // Third and fourth derivatives are of order 10^3 (variances of 0.05 m^2 and more): truncation
    // h^2 10^3 and k^2 10^3; rounding 1e-16 / h and 1e-16 / k^2.
    const double h = 1e-5, k = 1e-4;
    for (int i = 0; i < 6; ++i) {
      const Vector6d a = Vector6d::Unit(i);
      EXPECT_NEAR(score.gradient[i], (value(h * a) - value(-h * a)) / (2 * h), 1e-6)
          << i << " stream " << stream;
      for (int j = 0; j < 6; ++j) {
        const Vector6d b = Vector6d::Unit(j);
        const double difference =
            (value(k * (a + b)) - value(k * (a - b)) - value(k * (b - a)) + value(-k * (a + b))) /
            (4 * k * k);
        EXPECT_NEAR(score.hessian(i, j), difference, 3e-5) << i << " " << j << " stream " << stream;
      }
    }
  }
}

TEST(D2dScore, IsMinusOneAndFlatWhereTheMeansMeet) {
  Random random(2, 0);
  const Distribution target = random_distribution(random), source = random_distribution(random);
  Pose T = random_pose(random, 1, 1);
  T.translation() = target.mean - T.linear() * source.mean;
  const Score score = d2d_score(target, source, T, 0.5);
  EXPECT_NEAR(score.value, -1, 1e-14);
  EXPECT_LT(score.gradient.norm(), 1e-14);
}

TEST(D2dScore, GaussNewtonIsNeverIndefinite) {
  for (std::uint64_t stream = 0; stream < 50; ++stream) {
    Random random(3, stream);
    const Distribution target = random_distribution(random), source = random_distribution(random);
    const Pose T = random_pose(random, 1, 1);
    const Score score = d2d_score(target, source, T, 0.5, Curvature::gauss_newton);
    const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(score.hessian);
    EXPECT_GE(solver.eigenvalues()[0], -1e-12 * solver.eigenvalues()[5]);
    EXPECT_EQ(score.gradient, d2d_score(target, source, T, 0.5).gradient);
  }
}

// Cells on both sides of a cell pull at it with the same force: P2D-NDT has no such luck.
TEST(RegisterD2d, LeavesACloudOnItself) {
  const PointCloud cloud = bumpy_tunnel(20000, 1);
  const RegistrationResult result = register_d2d(cloud, cloud, Pose::Identity());
  EXPECT_EQ(result.status, Status::converged);
  EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).translation, 1e-9);
}

TEST(RegisterD2d, FindsTheTrueMotion) {
  const PointCloud target = bumpy_tunnel(40000, 1);
  for (std::uint64_t stream = 0; stream < 3; ++stream) {
    Random random(4, stream);
    const Pose truth = random_pose(random, 2, 3);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(40000, 2 + stream));
    const RegistrationResult result = register_d2d(target, source, near_identity * truth);
    EXPECT_EQ(result.status, Status::converged);
    // 3 mm were measured: the cells of the two clouds hold other points. 15 times below the start.
    EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.02);
    EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 0.002);
    EXPECT_EQ(result.used_points, 40000u);
    EXPECT_LT(result.empty_points, 40000u / 10);
    EXPECT_GT(result.covariance(0, 0), 0);
    EXPECT_EQ(result.directions.size(), 6u);
  }
}

// Lattices swap, and with them the cells.
TEST(RegisterD2d, SwappedCloudsGiveTheInverse) {
  const PointCloud a = bumpy_tunnel(40000, 1), b = bumpy_tunnel(40000, 2);
  const RegistrationResult there = register_d2d(a, b, near_identity),
                           back = register_d2d(b, a, near_identity.inverse());
  const PoseError error = pose_error(there.T_target_source, back.T_target_source.inverse());
  EXPECT_LT(error.translation, 0.01);
  EXPECT_LT(error.rotation, 0.001);
}

TEST(RegisterD2d, TellsWhatCannotBeRegistered) {
  const PointCloud ground = plane(20000, 20, 0.01, 1);
  EXPECT_EQ(register_d2d(ground, ground, Pose::Identity()).status, Status::degenerate);
  const PointCloud cloud = bumpy_tunnel(5000, 1);
  Pose away = Pose::Identity();
  away.translation().x() = 200;
  EXPECT_EQ(register_d2d(cloud, cloud, away).status, Status::no_overlap);
  const PointCloud few{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  EXPECT_EQ(register_d2d(cloud, few, Pose::Identity()).status, Status::no_overlap);
  EXPECT_EQ(register_d2d(few, cloud, Pose::Identity()).status, Status::no_overlap);
  EXPECT_THROW(register_d2d(cloud, cloud, Pose::Identity(), {.levels = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
