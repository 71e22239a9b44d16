// SPDX-License-Identifier: MIT
#include "formats/data_set.h"

#include <gtest/gtest.h>

#include "formats/cloud_file.h"

namespace minescan {
namespace {

Pose some_pose(double s) {
  return Eigen::Translation3d(s, -2 * s, 0.1) *
         Eigen::AngleAxisd(0.3 * s, Eigen::Vector3d(1, 2, 3).normalized());
}

TEST(Pairs, ReadBack) {
  const std::vector<DataSetPair> pairs = {
      {.target = 0, .source = 1, .overlap = 0.75, .truth = some_pose(1), .guess = some_pose(1.1)},
      {.target = 1, .source = 2, .overlap = 1, .truth = some_pose(-2), .guess = some_pose(0)}};
  const std::vector<DataSetPair> back = parse_pairs(print_pairs(pairs), "pairs.csv");
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[1].target, 1u);
  EXPECT_EQ(back[1].source, 2u);
  EXPECT_EQ(back[0].overlap, 0.75);
  EXPECT_EQ(back[0].truth.translation(), pairs[0].truth.translation());
  // Quaternion to matrix and back: a few roundings of entries of size 1.
  EXPECT_LT((back[0].guess.matrix() - pairs[0].guess.matrix()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Pairs, RefuseOtherTables) {
  EXPECT_THROW(parse_pairs("", "pairs.csv"), std::runtime_error);
  EXPECT_THROW(parse_pairs("a,b\n1,2\n", "pairs.csv"), std::runtime_error);
  const std::string good = print_pairs({{}});
  EXPECT_NO_THROW(parse_pairs(good, "pairs.csv"));
  EXPECT_THROW(parse_pairs(good.substr(0, good.size() - 4), "pairs.csv"), std::runtime_error);
}

TEST(PrintScan, IsAPlyThatHoldsThePoints) {
  Scan scan;
  scan.scene = "box";
  scan.scanner = "ideal";
  for (int i = 0; i < 3; ++i) {
    scan.cloud.points.emplace_back(i, 0.5, -i);
    scan.intensity.push_back(0.5F);
    scan.time.push_back(i * 1e-5);
    scan.ring.push_back(1);
    scan.column.push_back(2);
    scan.range.push_back(3);
    scan.true_range.push_back(3.001);
    scan.incidence.push_back(0.1F);
    scan.true_normal.emplace_back(0, 0, 1);
    scan.triangle.push_back(7);
    scan.material.push_back(1);
    scan.flags.push_back(flag_none);
  }
  EXPECT_EQ(parse_ply(print_scan(scan), "a"), scan.cloud.points);
}

TEST(PrintTum, HasOneLinePerPoseWithAllDigits) {
  EXPECT_EQ(print_tum({0.1}, {Pose::Identity()}),
            "# time tx ty tz qx qy qz qw\n0.10000000000000001 0 0 0 0 0 0 1\n");
}

}  // namespace
}  // namespace minescan
