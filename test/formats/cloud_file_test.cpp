// SPDX-License-Identifier: MIT
#include "formats/cloud_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "core/input_file.h"
#include "core/random.h"

namespace minescan {
namespace {

std::vector<Eigen::Vector3d> random_points(std::size_t count) {
  Random random(1, 0);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(30 * random.normal(), 30 * random.normal(), 3 * random.normal());
  return points;
}

// What `parse` says when it refuses; empty if it does not.
std::string refusal(const CloudFormat& format, const std::string& bytes) {
  try {
    format.parse(bytes, "a");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

std::string little_endian(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

TEST(CloudFormats, ReadWhatTheyWrite) {
  const std::vector<Eigen::Vector3d> points = random_points(1000);
  for (const CloudFormat& format : cloud_formats()) {
    const std::vector<Eigen::Vector3d> back = format.parse(format.print(points), "a");
    ASSERT_EQ(back.size(), points.size()) << format.extension;
    // PCD is written in single precision: half a unit in the last place of numbers below 128.
    const double tolerance = format.extension == ".pcd" ? 128 * 0x1p-24 : 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_LE((back[i] - points[i]).cwiseAbs().maxCoeff(), tolerance) << format.extension;
  }
}

// A file cut anywhere is refused with a message that names it, and never read beyond its end.
TEST(CloudFormats, RefuseTruncatedFiles) {
  for (const CloudFormat& format : cloud_formats()) {
    if (format.extension == ".xyz") continue;  // says nowhere how many points it has
    const std::string whole = format.print(random_points(20));
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_EQ(refusal(format, whole.substr(0, size)).rfind("a:", 0), 0u)
          << format.extension << " of " << size << " bytes";
  }
}

// Any byte may be wrong: the parser answers with points or a message, never with a crash or an
// allocation that the file cannot justify.
TEST(CloudFormats, SurviveRubbish) {
  for (const CloudFormat& format : cloud_formats()) {
    const std::string whole = format.print(random_points(20));
    for (std::uint64_t stream = 0; stream < 3000; ++stream) {
      Random random(5, stream);
      std::string bytes = whole;
      for (std::uint64_t k = random.below(8); k-- > 0;)
        bytes[random.below(bytes.size())] = static_cast<char>(random.below(256));
      refusal(format, bytes);
    }
    std::string noise(5000, '\0');
    Random random(6, 0);
    for (char& c : noise) c = static_cast<char>(random.below(256));
    EXPECT_NE(refusal(format, noise), "") << format.extension;
  }
}

TEST(Ply, ReadsTextBothByteOrdersAndOtherProperties) {
  const CloudFormat& ply = find_cloud_format("a.PLY");
  const std::string header =
      "element vertex 2\nproperty uchar red\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::vector<Eigen::Vector3d> expected = {{1, 2, 3}, {-4, 0.5, 6}};
  EXPECT_EQ(ply.parse("ply\nformat ascii 1.0\n" + header + "9 1 2 3\n9 -4 .5 6\n3 0 1 0\n", "a"),
            expected);
  std::string little, big;
  for (const Eigen::Vector3d& p : expected) {
    const std::string xyz = little_endian({float(p.x()), float(p.y()), float(p.z())});
    little += "\t" + xyz;
    big += "\t";
    for (std::size_t value = 0; value < 3; ++value)
      big.append(xyz.rbegin() + 8 - 4 * std::ptrdiff_t(value),
                 xyz.rbegin() + 12 - 4 * std::ptrdiff_t(value));
  }
  EXPECT_EQ(ply.parse("ply\nformat binary_little_endian 1.0\n" + header + little, "a"), expected);
  EXPECT_EQ(ply.parse("ply\nformat binary_big_endian 1.0\n" + header + big, "a"), expected);
}

TEST(Ply, SaysWhatIsWrong) {
  const CloudFormat& ply = find_cloud_format("a.ply");
  const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex ";
  const std::string xyz = "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  EXPECT_EQ(refusal(ply, "solid"), "a:1: expected 'ply'");
  EXPECT_EQ(refusal(ply, head + "1000000000000000000" + xyz),
            "a:3: expected a number of elements, found '1000000000000000000'");
  EXPECT_EQ(refusal(ply, head + "1000000000000" + xyz),
            "a: expected 1000000000000 elements vertex of 12 bytes, the file ends after 0");
  EXPECT_EQ(refusal(ply, head + "-1" + xyz), "a:3: expected a number of elements, found '-1'");
  EXPECT_EQ(refusal(ply, head + "1\nproperty float x\nend_header\n0000"),
            "a: element vertex has no properties x, y and z");
}

TEST(Pcd, ReadsTextAndSkipsOtherFields) {
  const CloudFormat& pcd = find_cloud_format("a.pcd");
  const std::string header =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE U F F F\nCOUNT 2 1 1 1\n"
      "WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";
  const auto points = pcd.parse(header + "ascii\n1 2 3 4 5\n6 7 nan 8 9\n", "a");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0], Eigen::Vector3d(3, 4, 5));
  EXPECT_TRUE(std::isnan(points[1].x()));
  EXPECT_EQ(pcd.parse(header + "binary\n" + little_endian({0, 0, 3, 4, 5, 0, 0, 7, 8, 9}), "a")[1],
            Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(refusal(pcd, header + "binary\n" + little_endian({0, 0, 3, 4, 5})),
            "a: expected 2 points, the file ends after 1");
  EXPECT_EQ(refusal(pcd, header + "zip\n"),
            "a: unknown DATA 'zip'; known: ascii, binary, binary_compressed");
  // A packed block that claims to unpack to 4 GiB.
  EXPECT_EQ(refusal(pcd, header + "binary_compressed\n" +
                             std::string("\x04\x00\x00\x00\xff\xff\xff\xff", 8) + "abcd"),
            "a: 4 bytes cannot unpack to 4294967295");
}

TEST(Xyz, NamesTheLine) {
  const CloudFormat& xyz = find_cloud_format("a.xyz");
  EXPECT_EQ(xyz.parse("# head\n1 2 3 99\n\n4,5,6\n", "a"),
            (std::vector<Eigen::Vector3d>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(refusal(xyz, "1 2 3\n1 2\n"), "a:2: expected 3 numbers, found 2");
  EXPECT_EQ(refusal(xyz, "1 2 x\n"), "a:1: expected a number, found 'x'");
}

TEST(ReadCloud, DropsWhatIsNotFiniteAndRefusesNothingness) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("minescan-" + std::to_string(getpid()) + ".xyz");
  const auto write = [&](const std::string& text) { std::ofstream(path) << text; };
  write("1 2 3\nnan 0 0\n4 5 inf\n");
  const CloudFile file = read_cloud(path);
  EXPECT_EQ(file.cloud.points.size(), 1u);
  EXPECT_EQ(file.dropped, 2u);
  write("nan nan nan\n");
  EXPECT_THROW(read_cloud(path), std::runtime_error);
  write("");
  EXPECT_THROW(read_cloud(path), std::runtime_error);
  std::filesystem::remove(path);
  EXPECT_THROW(read_cloud(path), std::runtime_error);
  EXPECT_THROW(read_cloud("/tmp"), std::invalid_argument);
  EXPECT_THROW(read_cloud("a.doc"), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
