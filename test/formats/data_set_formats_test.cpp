// SPDX-License-Identifier: MIT
#include "formats/data_set_formats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"
#include "formats/uos.h"
#include "test/formats/example_scan.h"

namespace minescan {
namespace {

const DataSetFormat& row(const std::string& name) {
  static const std::vector<DataSetFormat> rows = data_set_formats();
  for (const DataSetFormat& format : rows)
    if (format.name == name) return format;
  throw std::invalid_argument(name);
}

std::string bytes_of(const std::vector<DataSetFile>& files, const std::string& path) {
  for (const DataSetFile& file : files)
    if (file.path == path) return file.bytes;
  ADD_FAILURE() << "no file " << path;
  return "";
}

// Two scans and one pair.
DataSetSummary example_summary() {
  const Pose first = example_scan(false).T_world_scanner;
  const Pose step = Eigen::Translation3d(2, 0.5, 0) *
                    Eigen::AngleAxisd(0.2, Eigen::Vector3d(0, 0.1, 1).normalized());
  const Pose guess = Eigen::Translation3d(2.3, 0.4, 0.1) *
                     Eigen::AngleAxisd(0.25, Eigen::Vector3d(0.1, 0.1, 1).normalized());
  return {.name = "box",
          .times = {0, 60},
          .truth = {first, first * step},
          .odometry = {first, first * guess},
          .pairs = {{.target = 0, .source = 1, .overlap = 0.756, .truth = step, .guess = guess}}};
}

// Every file of every row that is a cloud reads back as the points of the scan.
TEST(DataSetFormats, HoldThePointsOfTheScan) {
  std::set<std::string> paths;
  for (const DataSetFormat& format : data_set_formats())
    for (const bool two_returns : {false, true}) {
      const Scan scan = example_scan(two_returns);
      // The largest coordinate is below 256 m: half a unit in the last place of a float for the
      // world frame of `benchmark`, half a step of 1e-5 m for LAS and of 1e-6 m for 3DTK; the
      // others hold the floats that the points are.
      const std::map<std::string, double> tolerances = {{"benchmark", 256 * 0x1p-24},
                                                        {"las", 0.5e-5 + 1e-13},
                                                        {"uos", 0.5e-6 + 1e-13},
                                                        {"uosr", 0.5e-6 + 1e-13}};
      const auto found = tolerances.find(format.name);
      const double tolerance = found == tolerances.end() ? 0 : found->second;
      int clouds = 0;
      for (const DataSetFile& file : format.scan_files(12, scan)) {
        EXPECT_EQ(file.path.begin()->string(), format.name);
        EXPECT_EQ(paths.insert(file.path.string()).second, !two_returns) << file.path;
        if (file.path.extension() == ".pose") continue;
        std::vector<Eigen::Vector3d> points =
            find_cloud_format(file.path).parse(file.bytes, file.path.string());
        std::erase_if(points, [](const Eigen::Vector3d& p) { return !p.allFinite(); });
        ASSERT_EQ(points.size(), scan.cloud.points.size()) << file.path;
        // An organised cloud has another order.
        std::vector<Eigen::Vector3d> expected = scan.cloud.points;
        if (format.name == "benchmark")
          for (Eigen::Vector3d& p : expected) p = scan.T_world_scanner * p;
        for (const Eigen::Vector3d& p : points) {
          double nearest = 1e9;
          for (const Eigen::Vector3d& q : expected)
            nearest = std::min(nearest, (p - q).cwiseAbs().maxCoeff());
          EXPECT_LE(nearest, tolerance) << file.path;
        }
        ++clouds;
      }
      EXPECT_EQ(clouds, 1) << format.name;
    }
}

TEST(DataSetFormats, AreFoundByName) {
  EXPECT_TRUE(find_data_set_formats("").empty());
  const std::vector<DataSetFormat> two = find_data_set_formats("kitti, las");
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].name, "kitti");
  try {
    find_data_set_formats("pcd,pdc");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(
        error.what(),
        "unknown data-set format 'pdc'; known: pcd, las, npy, uos, uosr, kitti, benchmark");
  }
}

// Scans that lack everything but points, and scans without points.
TEST(DataSetFormats, TakeScansWithLittleInThem) {
  Scan bare;
  bare.cloud.points = {{1, 2, 3}, {4, 5, 6}};
  Scan empty = example_scan(false);
  empty = Scan{.rings = empty.rings, .columns = empty.columns};
  Scan uneven = example_scan(true);
  uneven.echo.pop_back();
  for (const DataSetFormat& format : data_set_formats()) {
    EXPECT_NO_THROW(format.scan_files(0, bare)) << format.name;
    EXPECT_NO_THROW(format.scan_files(0, empty)) << format.name;
    EXPECT_NO_THROW(format.summary_files({})) << format.name;
  }
  for (const char* name : {"pcd", "las", "npy"})
    EXPECT_THROW(row(name).scan_files(0, uneven), std::invalid_argument) << name;
}

TEST(Pcd, IsOrganisedWhereBeamsLieOnAGrid) {
  const Scan scan = example_scan(false);
  const std::string file = bytes_of(row("pcd").scan_files(3, scan), "pcd/0003.pcd");
  EXPECT_NE(file.find("\nWIDTH 5\nHEIGHT 4\n"), std::string::npos);
  EXPECT_NE(file.find("\nPOINTS 20\nDATA binary\n"), std::string::npos);
  const std::vector<Eigen::Vector3d> beams = parse_pcd(file, "a");
  ASSERT_EQ(beams.size(), 20u);
  std::size_t returned = 0;
  for (std::size_t i = 0; i < scan.cloud.points.size(); ++i)
    EXPECT_EQ(beams[scan.ring[i] * 5 + scan.column[i]], scan.cloud.points[i]);
  for (const Eigen::Vector3d& beam : beams) {
    if (beam.allFinite()) ++returned;
    EXPECT_EQ(beam.array().isNaN().any(), beam.array().isNaN().all());
  }
  EXPECT_EQ(returned, scan.cloud.points.size());
}

TEST(Pcd, IsAListWhereBeamsHaveSeveralReturnsOrNoGrid) {
  const Scan two = example_scan(true);
  Scan gridless = example_scan(false), outside = gridless;
  gridless.rings = gridless.columns = 0;
  outside.columns = 3;
  for (const Scan& scan : {two, gridless, outside}) {
    const std::string file = bytes_of(row("pcd").scan_files(0, scan), "pcd/0000.pcd");
    EXPECT_NE(file.find("\nHEIGHT 1\n"), std::string::npos);
    EXPECT_EQ(parse_pcd(file, "a"), scan.cloud.points);
  }
}

// Bytes of point format 1 in "LAS Specification 1.2", table "Point data record format 1".
TEST(Las, HasIntensityTimeReturnsAndFlags) {
  const Scan scan = example_scan(true);
  const std::string file = bytes_of(row("las").scan_files(0, scan), "las/0000.las");
  const std::size_t points = scan.cloud.points.size();
  ASSERT_EQ(file.size(), 227 + 28 * points);
  EXPECT_EQ(file.substr(26, 8), std::string("example\0", 8));
  std::uint32_t first_returns = 0;
  Eigen::Vector3d low(1e9, 1e9, 1e9), high = -low;
  for (std::size_t i = 0; i < points; ++i) {
    const char* point = file.data() + 227 + 28 * i;
    EXPECT_EQ(load<std::uint16_t>(point + 12, false),
              std::lround(65535 * std::sqrt(scan.intensity[i])));
    const int returns = static_cast<unsigned char>(point[14]);
    EXPECT_EQ(returns & 7, scan.echo[i]);
    EXPECT_EQ(returns >> 3 & 7, scan.ring[i] % 2 == 1 ? 2 : 1);
    EXPECT_EQ(returns >> 6, 0);
    EXPECT_EQ(static_cast<std::uint8_t>(point[17]), scan.flags[i]);
    EXPECT_EQ(load<double>(point + 20, false), scan.time[i]);
    if (scan.echo[i] == 1) ++first_returns;
    low = low.cwiseMin(scan.cloud.points[i]);
    high = high.cwiseMax(scan.cloud.points[i]);
  }
  EXPECT_EQ(load<std::uint32_t>(file.data() + 111, false), first_returns);
  EXPECT_EQ(load<std::uint32_t>(file.data() + 115, false), points - first_returns);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(load<double>(file.data() + 179 + 16 * axis, false), high[axis], 0.5e-5 + 1e-13);
    EXPECT_NEAR(load<double>(file.data() + 187 + 16 * axis, false), low[axis], 0.5e-5 + 1e-13);
  }
}

TEST(Npy, HasTheColumnsThatItNames) {
  const Scan scan = example_scan(true);
  const std::vector<DataSetFile> files = row("npy").scan_files(0, scan);
  std::vector<std::string> names = split(bytes_of(files, "npy/columns.txt"), '\n');
  names.pop_back();  // the rest after the last line
  ASSERT_EQ(names.size(), 20u);
  const std::string file = bytes_of(files, "npy/0000.npy");
  const std::size_t points = scan.cloud.points.size();
  const char* first = file.data() + file.size() - 8 * names.size() * points;
  EXPECT_EQ((first - file.data()) % 64, 0);
  for (std::size_t i = 0; i < points; ++i) {
    std::map<std::string, double> value;
    for (std::size_t k = 0; k < names.size(); ++k)
      value[names[k]] = load<double>(first + 8 * (i * names.size() + k), false);
    EXPECT_EQ(value.at("x"), scan.cloud.points[i].x());
    EXPECT_EQ(value.at("time"), scan.time[i]);
    EXPECT_EQ(value.at("ring"), scan.ring[i]);
    EXPECT_EQ(value.at("true_z"), scan.true_point[i].z());
    EXPECT_EQ(value.at("echo"), scan.echo[i]);
  }
  EXPECT_EQ(row("npy").scan_files(1, scan).size(), 1u);
}

TEST(Uos, HasTheExactPoseAndTheAmplitude) {
  const Scan scan = example_scan(false);
  const Pose pose =
      parse_uos_pose(bytes_of(row("uos").scan_files(7, scan), "uos/scan007.pose"), "a");
  EXPECT_LT((pose.matrix() - scan.T_world_scanner.matrix()).norm(), 1e-13);
  const std::string text = bytes_of(row("uosr").scan_files(1234, scan), "uosr/scan1234.3d");
  LineReader lines(text, "a");
  std::string_view line;
  std::vector<double> values;
  for (const float intensity : scan.intensity) {
    ASSERT_TRUE(lines.next(line));
    read_columns(line, 4, values, lines);
    EXPECT_EQ(static_cast<float>(values[3]), intensity);
  }
}

TEST(Kitti, HasIntensitiesTimesAndPosesInTheFirstFrame) {
  const Scan scan = example_scan(false);
  const std::string cloud =
      bytes_of(row("kitti").scan_files(12, scan), "kitti/velodyne/000012.bin");
  EXPECT_EQ(load<float>(cloud.data() + 16 * 3 + 12, false), scan.intensity[3]);

  const DataSetSummary summary = example_summary();
  const std::vector<DataSetFile> files = row("kitti").summary_files(summary);
  EXPECT_EQ(bytes_of(files, "kitti/times.txt"), "0.000000e+00\n6.000000e+01\n");
  EXPECT_EQ(bytes_of(files, "kitti/calib.txt"), "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  const std::vector<std::string> poses = split(bytes_of(files, "kitti/poses.txt"), '\n');
  ASSERT_EQ(poses.size(), 3u);  // and the rest after the last line
  const Pose first = pose_from_matrix(parse_numbers(poses[0]));
  const Pose second = pose_from_matrix(parse_numbers(poses[1]));
  EXPECT_LT((first.matrix() - Pose::Identity().matrix()).norm(), 1e-13);
  EXPECT_LT((second.matrix() - summary.pairs[0].truth.matrix()).norm(), 1e-13);
}

}  // namespace
}  // namespace minescan
