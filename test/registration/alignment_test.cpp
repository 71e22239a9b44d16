// SPDX-License-Identifier: MIT
#include "registration/alignment.h"

#include <gtest/gtest.h>

#include "clouds.h"

namespace minescan {
namespace {

double cost(const Pose& T, const std::vector<Eigen::Vector3d>& target,
            const std::vector<Eigen::Vector3d>& source) {
  double sum = 0;
  for (std::size_t i = 0; i < target.size(); ++i) sum += (T * source[i] - target[i]).squaredNorm();
  return sum;
}

TEST(Alignment, RecoversAnExactMotion) {
  for (std::uint64_t stream = 0; stream < 100; ++stream) {
    Random random(1, stream);
    const Pose truth = random_pose(random, 10, 3.1);
    const std::vector<Eigen::Vector3d> source = bumpy_tunnel(20, stream).points;
    const std::vector<Eigen::Vector3d> target = transformed(truth, {.points = source}).points;
    // Coordinates of 10 m are rounded to 1e-15, and again in each step.
    EXPECT_TRUE(align_svd(target, source)->isApprox(truth, 1e-12));
    EXPECT_TRUE(align_quaternion(target, source)->isApprox(truth, 1e-12));
  }
}

TEST(Alignment, BothWaysAgreeOnNoisyPairsAndNoOtherPoseIsBetter) {
  for (std::uint64_t stream = 0; stream < 100; ++stream) {
    Random random(2, stream);
    const std::vector<Eigen::Vector3d> source = bumpy_tunnel(30, stream).points;
    std::vector<Eigen::Vector3d> target =
        transformed(random_pose(random, 2, 3.1), {.points = source}).points;
    for (Eigen::Vector3d& p : target) p += 0.5 * random_vector(random);
    const Pose svd = *align_svd(target, source), quaternion = *align_quaternion(target, source);
    EXPECT_TRUE(svd.isApprox(quaternion, 1e-12));
    EXPECT_NEAR(svd.linear().determinant(), 1, 1e-12);
    for (int trial = 0; trial < 10; ++trial) {
      const Pose other = svd * random_pose(random, 1e-3, 1e-3);
      EXPECT_LE(cost(svd, target, source), cost(other, target, source));
    }
  }
}

TEST(Alignment, NeverReflects) {
  Random random(3, 0);
  std::vector<Eigen::Vector3d> source, target;
  for (int i = 0; i < 20; ++i) {
    source.push_back(random_vector(random));
    target.push_back(Eigen::Vector3d(1, 1, -1).cwiseProduct(source.back()));
  }
  EXPECT_NEAR(align_svd(target, source)->linear().determinant(), 1, 1e-12);
  // A plane is enough.
  for (Eigen::Vector3d& p : source) p.z() = 0;
  const Pose truth = random_pose(random, 1, 3);
  target = transformed(truth, {.points = source}).points;
  EXPECT_TRUE(align_svd(target, source)->isApprox(truth, 1e-12));
  EXPECT_TRUE(align_quaternion(target, source)->isApprox(truth, 1e-12));
}

TEST(Alignment, SaysWhenALineLeavesARotationFree) {
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 20; ++i) line.push_back({1.0 * i, 2.0 * i, 3.0 - i});
  EXPECT_FALSE(align_svd(line, line));
  EXPECT_FALSE(align_quaternion(line, line));
  const std::vector<Eigen::Vector3d> same(20, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(align_svd(same, same));
  EXPECT_FALSE(align_svd({{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {1, 0, 0}}));
}

}  // namespace
}  // namespace minescan
