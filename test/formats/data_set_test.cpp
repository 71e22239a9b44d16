// SPDX-License-Identifier: MIT
#include "formats/data_set.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <map>

#include "core/input_file.h"
#include "core/output_file.h"
#include "formats/cloud_file.h"
#include "formats/uos.h"
#include "test/formats/example_scan.h"

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
  const Scan scan = example_scan(true);
  EXPECT_EQ(parse_ply(print_scan(scan), "a"), scan.cloud.points);
}

// Each number is found at the byte where the header says that its column is.
TEST(PrintScan, HasEveryAttribute) {
  const Scan scan = example_scan(true);
  const std::string file = print_scan(scan);
  const std::size_t end = file.find("end_header\n");
  ASSERT_NE(end, std::string::npos);
  const std::string header = file.substr(0, end);
  EXPECT_NE(header.find("\nobj_info num_cols 5\nobj_info num_rows 4\n"), std::string::npos);
  EXPECT_NE(header.find("\ncomment scene box\ncomment scanner example\n"), std::string::npos);
  // Names and types as formats/data_set.h lists them.
  const std::vector<std::pair<std::string, std::string>> columns = {
      {"x", "float"},         {"y", "float"},        {"z", "float"},      {"intensity", "float"},
      {"time", "double"},     {"ring", "uint"},      {"column", "uint"},  {"true_range", "double"},
      {"range", "double"},    {"true_x", "float"},   {"true_y", "float"}, {"true_z", "float"},
      {"incidence", "float"}, {"nx", "float"},       {"ny", "float"},     {"nz", "float"},
      {"triangle", "uint"},   {"material", "uchar"}, {"flags", "uchar"},  {"echo", "uchar"}};
  const std::map<std::string, NumberType> types = {{"float", NumberType::float32},
                                                   {"double", NumberType::float64},
                                                   {"uint", NumberType::uint32},
                                                   {"uchar", NumberType::uint8}};
  std::string properties;
  std::size_t stride = 0;
  std::map<std::string, std::size_t> offset;
  for (const auto& [name, type] : columns) {
    properties += "property " + type + " " + name + "\n";
    offset[name] = stride;
    stride += size_of(types.at(type));
  }
  EXPECT_TRUE(header.ends_with("element vertex " + std::to_string(scan.cloud.points.size()) + "\n" +
                               properties));
  const std::size_t first = end + 11;
  ASSERT_EQ(file.size(), first + stride * scan.cloud.points.size());
  for (std::size_t i = 0; i < scan.cloud.points.size(); ++i) {
    const auto value = [&]<class T>(const char* name, T) {
      return load<T>(file.data() + first + i * stride + offset.at(name), false);
    };
    EXPECT_EQ(value("intensity", float{}), scan.intensity[i]);
    EXPECT_EQ(value("time", double{}), scan.time[i]);
    EXPECT_EQ(value("ring", std::uint32_t{}), scan.ring[i]);
    EXPECT_EQ(value("column", std::uint32_t{}), scan.column[i]);
    EXPECT_EQ(value("range", double{}), scan.range[i]);
    EXPECT_EQ(value("true_range", double{}), scan.true_range[i]);
    EXPECT_EQ(value("true_x", float{}), scan.true_point[i].x());
    EXPECT_EQ(value("true_y", float{}), scan.true_point[i].y());
    EXPECT_EQ(value("true_z", float{}), scan.true_point[i].z());
    EXPECT_EQ(value("incidence", float{}), scan.incidence[i]);
    EXPECT_EQ(value("nx", float{}), scan.true_normal[i].x());
    EXPECT_EQ(value("ny", float{}), scan.true_normal[i].y());
    EXPECT_EQ(value("nz", float{}), scan.true_normal[i].z());
    EXPECT_EQ(value("triangle", std::uint32_t{}), scan.triangle[i]);
    EXPECT_EQ(value("material", std::uint8_t{}), scan.material[i]);
    EXPECT_EQ(value("flags", std::uint8_t{}), scan.flags[i]);
    EXPECT_EQ(value("echo", std::uint8_t{}), scan.echo[i]);
  }
}

TEST(PrintScan, LeavesOutWhatIsNotThere) {
  Scan scan = example_scan(false);
  scan.true_point.clear();
  scan.rings = scan.columns = 0;
  const std::string file = print_scan(scan);
  EXPECT_EQ(file.find("true_x"), std::string::npos);
  EXPECT_EQ(file.find("obj_info"), std::string::npos);
  EXPECT_EQ(parse_ply(file, "a"), scan.cloud.points);
  scan.range.pop_back();
  EXPECT_THROW(print_scan(scan), std::invalid_argument);
}

TEST(PrintTum, HasOneLinePerPoseWithAllDigits) {
  EXPECT_EQ(print_tum({0.1}, {Pose::Identity()}),
            "# time tx ty tz qx qy qz qw\n0.10000000000000001 0 0 0 0 0 0 1\n");
}

// A turn of 90 degrees about each of 3DTK's axes, looked up in EulerToMatrix4 of its globals.icc:
// the columns of the matrix are where its axes x (right), y (up) and z (forward) go.
TEST(UosPose, FollowsEulerToMatrix4) {
  const auto turned = [](const std::string& angles,
                         const Eigen::Vector3d& ours) -> Eigen::Vector3d {
    return parse_uos_pose("0 0 0\n" + angles, "a").linear() * ours;
  };
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitX(), left = Eigen::Vector3d::UnitY(),
                        up = Eigen::Vector3d::UnitZ();
  // theta_x: (0, cx, sx) is the column of y: up goes forward, forward goes down.
  EXPECT_LT((turned("90 0 0", up) - forward).norm(), 1e-15);
  EXPECT_LT((turned("90 0 0", forward) + up).norm(), 1e-15);
  // theta_y: (sy, 0, cy) is the column of z: forward goes right.
  EXPECT_LT((turned("0 90 0", forward) + left).norm(), 1e-15);
  // theta_z: (cz, sz, 0) is the column of x: right goes up.
  EXPECT_LT((turned("0 0 90", left) + up).norm(), 1e-15);
  // All three: the matrix by the formulas of EulerToMatrix4 for 30, 40 and 50 degrees
  // (Python 3.11), then its rows and columns in our order and signs.
  Eigen::Matrix3d expected;
  expected << 0.663413948168938, -0.025201386257487, 0.747828070819491,  //
      -0.642787609686539, 0.492403876506104, 0.586824088833465,          //
      -0.383022221559489, -0.870001903752206, 0.310468460973368;
  const Pose pose = parse_uos_pose("100 200 300 30 40 50", "a");
  EXPECT_LT((pose.linear() - expected).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((pose.translation() - Eigen::Vector3d(3, -1, 2)).norm(), 1e-15);
}

TEST(UosPose, ReadsBack) {
  Random random(3, 0);
  for (int k = 0; k < 1000; ++k) {
    const auto normal = [&] { return random.normal(); };
    Pose pose = Eigen::Translation3d(100 * normal(), 100 * normal(), normal()) *
                Eigen::Quaterniond(normal(), normal(), normal(), normal()).normalized();
    // Also theirs at theta_y = 90 degrees, where theta_x and theta_z turn about the same axis.
    if (k % 10 == 0)
      pose.linear() = parse_uos_pose("0 0 0 " + std::to_string(k % 360) + " 90 20", "a").linear();
    const Pose back = parse_uos_pose(print_uos_pose(pose), "a");
    // A few roundings of numbers below 1000 and of entries of size 1.
    EXPECT_LT((back.translation() - pose.translation()).norm(), 1e-12);
    EXPECT_LT((back.linear() - pose.linear()).norm(), 1e-14);
  }
}

TEST(ReadPose, Reads3dtkPosesByTheirExtension) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("minescan-" + std::to_string(getpid()) + ".pose");
  write_file(path, print_uos_pose(some_pose(1)));
  EXPECT_LT((read_pose(path).matrix() - some_pose(1).matrix()).norm(), 1e-14);
  write_file(path, "1 2 3\n4 5\n");
  EXPECT_THROW(read_pose(path), std::runtime_error);
  write_file(path, "1 2 3\n4 5 x\n");
  EXPECT_THROW(read_pose(path), std::runtime_error);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace minescan
