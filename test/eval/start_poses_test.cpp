// SPDX-License-Identifier: MIT
#include "eval/start_poses.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/random.h"

namespace minescan {
namespace {

constexpr double degree = std::numbers::pi / 180;

std::vector<Eigen::Vector3d> lattice(int count) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) directions.push_back(lattice_direction(i, count));
  return directions;
}

TEST(LatticeDirections, KeepApartAndCoverTheSphere) {
  const std::vector<Eigen::Vector3d> directions = lattice(100);
  double closest = 4, farthest = 0;
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      closest = std::min(closest, std::acos(directions[i].dot(directions[j])));
  for (std::uint64_t i = 0; i < 20'000; ++i) {
    Random random(31, i);
    const Eigen::Vector3d p =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    double nearest = 4;
    for (const Eigen::Vector3d& d : directions) nearest = std::min(nearest, std::acos(p.dot(d)));
    farthest = std::max(farthest, nearest);
  }
  // Known to 0.1 degree; the covering radius from 20 000 random points can be short by as much as
  // their spacing, about 1 degree.
  EXPECT_NEAR(closest / degree, 17.8, 0.06);
  EXPECT_LE(farthest / degree, 15.6);
  EXPECT_GE(farthest / degree, 14.5);
}

TEST(LatticeDirections, HaveTheMomentsOfTheSphere) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& d : lattice(100)) {
    EXPECT_NEAR(d.norm(), 1, 1e-15);  // rounding
    mean += d / 100;
    second += d * d.transpose() / 100;
  }
  const Eigen::Vector3d eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(second).eigenvalues();
  // For uniform directions 0 and 1/3; a hundred random ones have a mean of 0.1. Known values for
  // this lattice, to their last digit.
  EXPECT_LE(mean.norm(), 2.5e-4);
  EXPECT_GE(eigenvalues.minCoeff(), 0.3315);
  EXPECT_LE(eigenvalues.maxCoeff(), 0.3345);
}

TEST(LatticeDirections, RefuseAnIndexOutOfRange) {
  EXPECT_THROW(lattice_direction(-1, 10), std::invalid_argument);
  EXPECT_THROW(lattice_direction(10, 10), std::invalid_argument);
  EXPECT_THROW(start_directions(0, 0, 1), std::invalid_argument);
}

TEST(StartDirections, AreTheLatticeTurnedAsAWhole) {
  for (const std::uint64_t seed : {1, 2}) {
    for (int i = 1; i < 50; ++i)
      EXPECT_NEAR(
          start_directions(i, 50, seed).offset.dot(start_directions(i - 1, 50, seed).offset),
          lattice_direction(i, 50).dot(lattice_direction(i - 1, 50)), 1e-14);  // rounding
    EXPECT_GT((start_directions(0, 50, seed).offset - lattice_direction(0, 50)).norm(), 0.01);
  }
  EXPECT_GT((start_directions(0, 50, 1).offset - start_directions(0, 50, 2).offset).norm(), 0.01);
}

TEST(StartDirections, AxesAreUniformAndUnrelatedToOffsets) {
  const int count = 3000;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero(), cross = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    const StartDirections d = start_directions(i, count, 5);
    EXPECT_NEAR(d.axis.norm(), 1, 1e-15);
    mean += d.axis / count;
    second += d.axis * d.axis.transpose() / count;
    cross += d.axis * d.offset.transpose() / count;
  }
  // Sigmas of the means of 3000 draws: of an axis 0.577 / 55 = 0.011, of its squares 0.298 / 55 =
  // 0.005, of products of two 0.333 / 55 = 0.006; four of each.
  EXPECT_LE(mean.cwiseAbs().maxCoeff(), 0.042);
  EXPECT_LE((second - Eigen::Matrix3d::Identity() / 3).cwiseAbs().maxCoeff(), 0.022);
  EXPECT_LE(cross.cwiseAbs().maxCoeff(), 0.024);
}

TEST(StartPose, HasExactlyTheStatedErrors) {
  const Pose truth = displaced(Pose::Identity(), {4, -2, 1}, {1, -2, 3}, 1.2);
  for (const double translation : {0.0, 0.5, 4.0})
    for (const double rotation : {0.0, 1e-3, 0.6, 3.0})
      for (int i = 0; i < 20; ++i) {
        const PoseError error =
            pose_error(truth, start_pose(truth, i, 20, 3, translation, rotation));
        EXPECT_NEAR(error.translation, translation, 1e-14);  // rounding of numbers up to 5
        EXPECT_NEAR(error.rotation, rotation, 1e-14);
      }
}

TEST(StartPose, KeepsItsDirectionsForAllSizesOfError) {
  const Pose truth = Pose::Identity();
  const Eigen::Vector3d near = start_pose(truth, 3, 10, 7, 0.5, 0).translation();
  const Eigen::Vector3d far = start_pose(truth, 3, 10, 7, 4, 0.3).translation();
  EXPECT_NEAR((8 * near - far).norm(), 0, 1e-14);  // rounding
}

// The formula behind every rotation error; acos of the trace would lose half the digits at both
// ends.
TEST(RotationError, IsExactNearZeroAndNearAHalfTurn) {
  for (const double angle : {1e-8, 1e-3, std::numbers::pi - 1e-6})
    for (std::uint64_t i = 0; i < 20; ++i) {
      Random random(32, i);
      const Eigen::Vector3d axis(random.normal(), random.normal(), random.normal());
      const Pose truth = displaced(Pose::Identity(), {0, 0, 0}, {1, 1, 0}, 0.7);
      const Pose turned = displaced(truth, {0, 0, 0}, axis, angle);
      // A product of two rotations has errors of a few 2.2e-16 per element.
      EXPECT_NEAR(pose_error(truth, turned).rotation, angle, 2e-15) << angle;
    }
}

}  // namespace
}  // namespace minescan
