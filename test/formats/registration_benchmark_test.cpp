// SPDX-License-Identifier: MIT
#include "formats/registration_benchmark.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/text.h"

namespace minescan {
namespace {

Pose some_pose(double s) {
  return Eigen::Translation3d(10 * s, -20 * s, 0.1) *
         Eigen::AngleAxisd(0.3 * s, Eigen::Vector3d(1, 2, 3).normalized());
}

// The benchmark moves the source, given in the world frame, by t1 ... t12. That must put it where
// the guess does.
TEST(BenchmarkProblems, MoveTheSourceToTheGuess) {
  const std::vector<Pose> T_world_scanner = {some_pose(1), some_pose(1.3), some_pose(-0.4)};
  const DataSetPair pair = {.target = 2,
                            .source = 1,
                            .overlap = 0.756,
                            .truth = T_world_scanner[2].inverse() * T_world_scanner[1],
                            .guess = some_pose(0.9)};
  DataSetPair perfect = pair;
  perfect.guess = pair.truth;
  const std::string text = print_benchmark_problems({pair, perfect}, T_world_scanner);
  const std::vector<std::string> lines = split(text, '\n');
  ASSERT_EQ(lines.size(), 4u);  // and the rest after the last line
  EXPECT_EQ(lines[0], "id source target overlap t1 t2 t3 t4 t5 t6 t7 t8 t9 t10 t11 t12");
  EXPECT_EQ(lines[1].rfind("0000 0001.pcd 0002.pcd 0.76 ", 0), 0u);
  EXPECT_EQ(lines[2].rfind("0001 0001.pcd 0002.pcd 0.76 ", 0), 0u);
  constexpr std::size_t head = 28;
  const Pose moved = pose_from_matrix(parse_numbers(lines[1].substr(head)));
  const Eigen::Vector3d p(3, -7, 1);  // seen by the source
  const Eigen::Vector3d in_world = T_world_scanner[1] * p;
  EXPECT_LT((moved * in_world - T_world_scanner[2] * pair.guess * p).norm(), 1e-12);
  const Pose none = pose_from_matrix(parse_numbers(lines[2].substr(head)));
  EXPECT_LT((none.matrix() - Pose::Identity().matrix()).norm(), 1e-12);
}

TEST(BenchmarkError, IsTheMeanOfScaledDistances) {
  // Centroid (1, 0, 0); distances from it 1, 1, 3 and 3.
  const std::vector<Eigen::Vector3d> source = {{0, 0, 0}, {2, 0, 0}, {1, 3, 0}, {1, -3, 0}};
  const Pose truth = some_pose(0.7);
  EXPECT_EQ(benchmark_error(source, truth, truth), 0);
  // A shift by 0.6 m: (0.6 / 1 + 0.6 / 1 + 0.6 / 3 + 0.6 / 3) / 4, in whatever frame.
  const Pose shifted = Eigen::Translation3d(0.36, 0, -0.48) * truth;
  EXPECT_NEAR(benchmark_error(source, truth, shifted), 0.4, 1e-14);
  EXPECT_NEAR(benchmark_error(source, Pose::Identity(), shifted * truth.inverse()), 0.4, 1e-14);
  // Half a turn about the z axis through the centroid: each point is moved by twice its distance.
  Pose turned = Eigen::Translation3d(1, 0, 0) *
                Eigen::AngleAxisd(std::acos(-1.0), Eigen::Vector3d::UnitZ()) *
                Eigen::Translation3d(-1, 0, 0);
  EXPECT_NEAR(benchmark_error(source, truth, truth * turned), 2, 1e-14);
  EXPECT_THROW(benchmark_error({}, truth, truth), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
