// SPDX-License-Identifier: MIT
#include "formats/cloud_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

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

template <class T>
std::string little_endian(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}
std::string little_endian(const std::vector<float>& values) { return little_endian<float>(values); }

// The same bytes, each `size` of them turned round.
std::string turned(std::string bytes, std::ptrdiff_t size) {
  for (auto at = bytes.begin(); at != bytes.end(); at += size) std::reverse(at, at + size);
  return bytes;
}

TEST(CloudFormats, ReadWhatTheyWrite) {
  const std::vector<Eigen::Vector3d> points = random_points(1000);
  for (const CloudFormat& format : cloud_formats()) {
    const std::vector<Eigen::Vector3d> back = format.parse(format.print(points), "a");
    ASSERT_EQ(back.size(), points.size()) << format.extension;
    // PCD and KITTI are in single precision: half a unit in the last place of numbers below 128.
    // LAS is in steps of 1e-5 m, 3DTK in steps of 1e-6 m, half of which is lost, and a few
    // roundings.
    const std::map<std::string, double> tolerances = {{".pcd", 128 * 0x1p-24},
                                                      {".bin", 128 * 0x1p-24},
                                                      {".las", 0.5e-5 + 1e-13},
                                                      {".3d", 0.5e-6 + 1e-13}};
    const auto found = tolerances.find(format.extension);
    const double tolerance = found == tolerances.end() ? 0 : found->second;
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_LE((back[i] - points[i]).cwiseAbs().maxCoeff(), tolerance) << format.extension;
  }
}

// A file cut anywhere is refused with a message that names it, and never read beyond its end.
TEST(CloudFormats, RefuseTruncatedFiles) {
  for (const CloudFormat& format : cloud_formats()) {
    const std::string whole = format.print(random_points(20));
    // These say nowhere how many points they have; a cut is seen where it goes through a point, and
    // in text not even through its last number.
    const std::string& name = format.extension;
    const bool counted = name != ".xyz" && name != ".csv" && name != ".3d" && name != ".bin";
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::string told = refusal(format, whole.substr(0, size));
      if (counted || (name == ".bin" && size % 16 != 0))
        EXPECT_EQ(told.rfind("a:", 0), 0u) << name << " of " << size << " bytes";
      else
        EXPECT_TRUE(told.empty() || told.rfind("a:", 0) == 0) << name << " of " << size << " bytes";
    }
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
    noise.pop_back();  // 4999 bytes are no whole number of points of any format
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

TEST(Csv, FindsItsColumnsByName) {
  const CloudFormat& csv = find_cloud_format("a.csv");
  const std::vector<Eigen::Vector3d> expected = {{1, 2, 3}, {-4, 0.5, 6e-3}};
  // As of the ETH registration data sets.
  EXPECT_EQ(csv.parse("timestamp, x, y, z, intensities\n0,1,2,3,9\n0,-4,.5,6e-3,8\n", "a"),
            expected);
  // As CloudCompare writes it, with a byte order mark and the line ends of DOS.
  EXPECT_EQ(csv.parse("\xef\xbb\xbf//X;Y;Z\r\n1;2;3\r\n-4;+0.5;0.006\r\n", "a"), expected);
  // Without names: the first three; text in other columns and empty ones do not matter.
  EXPECT_EQ(csv.parse("1,2,3\n\n-4,0.5,6e-3,rock,,\n", "a"), expected);
  EXPECT_EQ(csv.parse("\"z\" \"x\"  \"y\"\n3 1   2\n6e-3 -4 0.5", "a"), expected);
  EXPECT_EQ(csv.parse("label\tx\ty\tz\nwall\t1\t2\t3\n\t-4\t.5\t.006\n", "a"), expected);
}

TEST(Csv, SaysWhatIsWrong) {
  const CloudFormat& csv = find_cloud_format("a.csv");
  EXPECT_EQ(refusal(csv, "x,y,w\n1,2,3\n"),
            "a:1: expected numbers or columns x, y and z, found 'x,y,w'");
  EXPECT_EQ(refusal(csv, "t,x,y,z\n0,1,2,3\n0,1,2\n"), "a:3: expected at least 4 fields, found 3");
  EXPECT_EQ(refusal(csv, "1,2,3\n1,,3\n"), "a:2: expected a number, found ''");
  EXPECT_EQ(refusal(csv, "1;2;3\n1,5;2;3\n"), "a:2: expected a number, found '1,5'");
}

// The bytes of a .npy file as numpy.lib.format describes them, not padded.
std::string npy(int version, const std::string& header, const std::string& data) {
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(version);
  bytes += '\0';
  const auto size = static_cast<std::uint32_t>(header.size());
  bytes += little_endian<std::uint32_t>({size}).substr(0, version == 1 ? 2 : 4);
  return bytes + header + data;
}

TEST(Npy, ReadsVersionsTypesAndOrders) {
  const CloudFormat& format = find_cloud_format("a.npy");
  const std::vector<Eigen::Vector3d> expected = {{1, 2, 3}, {-4, 0.5, 6}};
  const std::string rows = little_endian<double>({1, 2, 3, 9, -4, 0.5, 6, 9});
  EXPECT_EQ(format.parse(
                npy(1, "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 4), }\n", rows), "a"),
            expected);
  EXPECT_EQ(
      format.parse(npy(2, "{'shape':(2,4),'fortran_order':False,'descr':'>f8'}", turned(rows, 8)),
                   "a"),
      expected);
  const std::string columns = little_endian<float>({1, -4, 2, 0.5, 3, 6});
  EXPECT_EQ(
      format.parse(
          npy(3, "{\"descr\": \"<f4\", \"fortran_order\": True, \"shape\": (2, 3)}", columns), "a"),
      expected);
}

TEST(Npy, SaysWhatIsWrong) {
  const CloudFormat& format = find_cloud_format("a.npy");
  const auto told = [&](const std::string& descr, const std::string& order,
                        const std::string& shape) {
    return refusal(format, npy(1,
                               "{'descr': " + descr + ", 'fortran_order': " + order +
                                   ", 'shape': " + shape + ", }\n",
                               "12345678"));
  };
  EXPECT_EQ(refusal(format, "PK\3\4"), "a: expected '\\x93NUMPY' at the start");
  EXPECT_EQ(refusal(format, npy(9, "", "")), "a: expected version 1 to 3, found 9");
  EXPECT_EQ(refusal(format, npy(2, "", "").substr(0, 8) + "\xff\xff\xff\xff"),
            "a: expected a header of 4294967295 bytes, the file has 12");
  EXPECT_EQ(refusal(format, npy(1, "{}", "")), "a: the header has no 'descr'");
  EXPECT_EQ(told("'<i8'", "False", "(1, 3)"),
            "a: expected numbers of type '<f4', '<f8', '>f4' or '>f8', found '<i8'");
  EXPECT_EQ(told("[('x', '<f4')]", "False", "(1, 3)").substr(0, 27), "a: expected numbers of type");
  EXPECT_EQ(told("'<f4'", "Maybe", "(1, 3)").substr(0, 44),
            "a: expected fortran_order True or False, fou");
  EXPECT_EQ(told("'<f4'", "False", "(6,)"),
            "a: expected the shape (N, 3) or (N, more), found (6,)");
  EXPECT_EQ(told("'<f4'", "False", "(6, 2)"),
            "a: expected the shape (N, 3) or (N, more), found (6, 2)");
  // Neither is allocated.
  EXPECT_EQ(told("'<f4'", "False", "(1000000000000, 3)"),
            "a: expected 1000000000000 x 3 numbers of 4 bytes, found 2");
  EXPECT_EQ(told("'<f8'", "False", "(9007199254740992, 9007199254740992)"),
            "a: expected 9007199254740992 x 9007199254740992 numbers of 8 bytes, found 1");
}

// A LAS file made by hand from the tables of "LAS Specification 1.4 - R13": every number at its
// byte. Two points at 10 + 0.01 * (100, -200, 300) and 10 + 0.01 * (-1, 2, 0).
std::string las(char minor, unsigned char format, std::uint16_t record_size, std::uint32_t count) {
  const std::uint16_t header_size = minor == 4 ? 375 : 227;
  std::string bytes(header_size, '\0');
  const auto put = [&](std::size_t at, const std::string& part) {
    bytes.replace(at, part.size(), part);
  };
  put(0, "LASF");
  bytes[24] = 1;
  bytes[25] = minor;
  put(94, little_endian<std::uint16_t>({header_size}));
  put(96, little_endian<std::uint32_t>({header_size + 2u}));  // two bytes between header and points
  bytes[104] = static_cast<char>(format);
  put(105, little_endian<std::uint16_t>({record_size}));
  put(131, little_endian<double>({0.01, 0.01, 0.01, 10, 10, 10}));
  if (minor == 4)
    put(247, little_endian<std::uint64_t>({count}));  // and 0 in the old place
  else
    put(107, little_endian<std::uint32_t>({count}));
  bytes += "\xdd\xcc";
  for (const std::vector<std::int32_t>& point :
       {std::vector<std::int32_t>{100, -200, 300}, std::vector<std::int32_t>{-1, 2, 0}}) {
    bytes += little_endian<std::int32_t>(point);
    bytes.append(record_size - 12u, '\x55');
  }
  return bytes;
}

TEST(Las, ReadsAllPointFormats) {
  const CloudFormat& format = find_cloud_format("a.las");
  // Sizes of the records of formats 0 to 10; 5 bytes more are allowed ("user-specific extra
  // bytes").
  const std::vector<std::uint16_t> sizes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  for (unsigned char kind = 0; kind < sizes.size(); ++kind)
    for (const char minor : {'\0', '\1', '\2', '\3', '\4'})
      for (const int extra : {0, 5}) {
        const auto points =
            format.parse(las(minor, kind, static_cast<std::uint16_t>(sizes[kind] + extra), 2), "a");
        ASSERT_EQ(points.size(), 2u);
        EXPECT_TRUE(points[0].isApprox(Eigen::Vector3d(11, 8, 13), 1e-15));
        EXPECT_TRUE(points[1].isApprox(Eigen::Vector3d(9.99, 10.02, 10), 1e-15));
      }
}

TEST(Las, SaysWhatIsWrong) {
  const CloudFormat& format = find_cloud_format("a.las");
  const std::string good = las(2, 1, 28, 2);
  EXPECT_EQ(refusal(format, good), "");
  EXPECT_EQ(refusal(format, "LAZF"), "a: expected 'LASF' at the start");
  EXPECT_EQ(refusal(format, good.substr(0, 100)),
            "a: expected a header of at least 227 bytes, the file has 100");
  EXPECT_EQ(refusal(format, las(5, 1, 28, 2)), "a: expected version 1.0 to 1.4, found 1.5");
  EXPECT_EQ(refusal(format, las(2, 128 + 1, 28, 2)),
            "a: its points are compressed (LAZ); expected LAS");
  EXPECT_EQ(refusal(format, las(2, 11, 99, 2)), "a: expected point format 0 to 10, found 11");
  EXPECT_EQ(refusal(format, las(2, 1, 20, 2)),
            "a: expected at least 28 bytes per point of format 1, found 20");
  EXPECT_EQ(refusal(format, las(4, 1, 28, 4000000000)),
            "a: expected 4000000000 points of 28 bytes, the file ends after 2");
  std::string bad = good;
  bad.replace(96, 4, little_endian<std::uint32_t>({4000000000}));
  EXPECT_EQ(refusal(format, bad),
            "a: expected points after a header of 227 bytes, at byte 4000000000 of 285");
  bad = good;
  bad.replace(131, 8, little_endian<double>({0}));
  EXPECT_EQ(refusal(format, bad),
            "a: expected scales other than 0 and offsets, found 0 0.01 0.01 and 10 10 10");
}

TEST(Las, WritesCoordinatesOfSurveyors) {
  // UTM: half a step of 1e-5 m and one of the product with the scale.
  const std::vector<Eigen::Vector3d> points = {{512345.67891, 6543210.98765, 412.3},
                                               {512300, 6543211, 400}};
  const CloudFormat& las = find_cloud_format("a.las");
  const std::vector<Eigen::Vector3d> back = las.parse(las.print(points), "a");
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_LT((back[i] - points[i]).cwiseAbs().maxCoeff(), 0.5e-5 + 1e-9);
  EXPECT_NO_THROW(las.print({{0, 0, 0}, {42e3, 0, 0}}));
  EXPECT_EQ(las.parse(las.print({}), "a").size(), 0u);
  EXPECT_THROW(las.print({{0, 0, 0}, {43e3, 0, 0}}), std::invalid_argument);
  EXPECT_THROW(las.print({{0, 0, std::nan("")}}), std::invalid_argument);
  EXPECT_THROW(las.print({{1e308, 0, 0}, {1e308, 0, 0}}), std::invalid_argument);
}

TEST(Kitti, IsFourFloatsPerPoint) {
  const CloudFormat& kitti = find_cloud_format("000000.bin");
  EXPECT_EQ(kitti.parse(little_endian({1, 2, 3, 0.5, -4, 0.5, 6, 0}), "a"),
            (std::vector<Eigen::Vector3d>{{1, 2, 3}, {-4, 0.5, 6}}));
  EXPECT_EQ(refusal(kitti, little_endian({1, 2, 3, 0, 4})),
            "a: expected points of 16 bytes, found 1 and 4 bytes more");
}

// The axes of formats/uos.h: theirs are x right, y up, z forward, in centimetres.
TEST(Uos, TurnsIntoOurAxes) {
  const CloudFormat& uos = find_cloud_format("scan000.3d");
  EXPECT_EQ(uos.parse("361 x 300\n100 200 400\n-100 0 0 0.25 # a comment\n", "a"),
            (std::vector<Eigen::Vector3d>{{4, -1, 2}, {0, 1, 0}}));
  EXPECT_EQ(uos.print({{4, -1, 2}}), "100.0000 200.0000 400.0000\n");
  EXPECT_EQ(refusal(uos, "1 2 3\n1 2\n"), "a:2: expected 3 numbers, found 2");
  std::string garbage;
  for (int line = 0; line < 11; ++line) garbage += "rubbish\n";
  EXPECT_EQ(refusal(uos, garbage), "a:11: expected a number, found 'rubbish'");
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
