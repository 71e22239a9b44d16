// SPDX-License-Identifier: MIT
#include "core/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"

namespace minescan {
namespace {

Eigen::Vector3d random_vector(Random& random) {
  return {random.normal(), random.normal(), random.normal()};
}

Pose random_pose(Random& random) {
  return Eigen::Translation3d(10 * random_vector(random)) *
         Eigen::AngleAxisd(3 * random.uniform(), random_vector(random).normalized());
}

TEST(PoseError, IsWhatDisplacedPutsIn) {
  for (std::uint64_t stream = 0; stream < 100; ++stream) {
    Random random(1, stream);
    const Pose truth = random_pose(random);
    const Eigen::Vector3d offset = random_vector(random);
    const double angle = std::numbers::pi * random.uniform();
    const PoseError error =
        pose_error(truth, displaced(truth, offset, random_vector(random), angle));
    // A few roundings of numbers of size 30.
    EXPECT_NEAR(error.translation, offset.norm(), 1e-13 * 30);
    EXPECT_NEAR(error.rotation, angle, 1e-12);
  }
}

// acos of the trace would give 0 or errors of 1e-8 for the first, and lose digits near pi.
TEST(PoseError, RotationKeepsItsDigitsAtBothEnds) {
  for (const double angle : {1e-8, 1e-3, std::numbers::pi - 1e-6}) {
    const Pose turned = displaced(Pose::Identity(), {0, 0, 0}, {1, 2, 3}, angle);
    // The entries of a rotation matrix are good to 1e-16, and so is the angle read from their
    // antisymmetric part (or near pi from the symmetric part, of slope 1/2).
    EXPECT_NEAR(pose_error(Pose::Identity(), turned).rotation, angle, 1e-15 + 1e-15 * angle);
  }
}

TEST(RotationExp, AgreesWithItsSeries) {
  Random random(2, 0);
  const Eigen::Vector3d omega = 1e-3 * random_vector(random);
  const Eigen::Matrix3d k = skew(omega);
  const Eigen::Matrix3d series = Eigen::Matrix3d::Identity() + k + k * k / 2 + k * k * k / 6;
  // The next term is |omega|^4 / 24, below 1e-11 for |omega| < 5e-3.
  EXPECT_LT((rotation_exp(omega) - series).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_EQ(rotation_exp(Eigen::Vector3d::Zero()), Eigen::Matrix3d::Identity());
}

TEST(PoseText, ReadsBack) {
  for (std::uint64_t stream = 0; stream < 100; ++stream) {
    Random random(3, stream);
    const Pose pose = random_pose(random);
    const Pose back = parse_pose(pose_text(pose));
    EXPECT_EQ(back.translation(), pose.translation());
    // Matrix to quaternion and back: a few roundings of entries of size 1.
    EXPECT_LT((back.linear() - pose.linear()).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(ParsePose, RefusesWhatIsNoPose) {
  EXPECT_THROW(parse_pose(""), std::invalid_argument);
  EXPECT_THROW(parse_pose("1,2,3"), std::invalid_argument);
  EXPECT_THROW(parse_pose("1,2,3,0,0,0,2"), std::invalid_argument);
  EXPECT_THROW(parse_pose("1,2,3,0,0,0,nan"), std::invalid_argument);
  EXPECT_THROW(pose_from_matrix({1, 0, 0}), std::invalid_argument);
  // A mirror image is no rotation.
  EXPECT_THROW(pose_from_matrix({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
