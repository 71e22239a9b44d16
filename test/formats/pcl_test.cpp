// SPDX-License-Identifier: MIT
// PCL's reader of our PCD files, and its writer's files read by us.
#include <gtest/gtest.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/io/pcd_io.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "core/input_file.h"
#include "core/output_file.h"
#include "formats/cloud_file.h"
#include "formats/data_set_formats.h"
#include "test/formats/example_scan.h"

namespace minescan {
namespace {

std::string temporary_file() {
  return (std::filesystem::temp_directory_path() /
          ("minescan-" + std::to_string(getpid()) + ".pcd"))
      .string();
}

pcl::PCLPointCloud2 read_by_pcl(const std::string& bytes) {
  const std::string path = temporary_file();
  write_file(path, bytes);
  pcl::PCLPointCloud2 cloud;
  EXPECT_EQ(pcl::PCDReader().read(path, cloud), 0);
  std::filesystem::remove(path);
  return cloud;
}

// The value of a field of PCL's cloud.
template <class T>
T value(const pcl::PCLPointCloud2& cloud, std::size_t point, const std::string& name) {
  for (const pcl::PCLPointField& field : cloud.fields)
    if (field.name == name)
      return load<T>(reinterpret_cast<const char*>(cloud.data.data()) + point * cloud.point_step +
                         field.offset,
                     false);
  ADD_FAILURE() << "no field " << name;
  return T{};
}

TEST(Pcl, ReadsOrganisedScans) {
  const Scan scan = example_scan(false);
  for (const DataSetFormat& format : find_data_set_formats("pcd")) {
    const pcl::PCLPointCloud2 cloud = read_by_pcl(format.scan_files(0, scan)[0].bytes);
    ASSERT_EQ(cloud.width, scan.columns);
    ASSERT_EQ(cloud.height, scan.rings);
    EXPECT_FALSE(cloud.is_dense);
    std::size_t returned = 0;
    for (std::size_t i = 0; i < scan.cloud.points.size(); ++i) {
      const std::size_t at = std::size_t{scan.ring[i]} * scan.columns + scan.column[i];
      EXPECT_EQ(value<float>(cloud, at, "x"), scan.cloud.points[i].x());
      EXPECT_EQ(value<float>(cloud, at, "intensity"), scan.intensity[i]);
      EXPECT_EQ(value<double>(cloud, at, "time"), scan.time[i]);
      EXPECT_EQ(value<double>(cloud, at, "true_range"), scan.true_range[i]);
      EXPECT_EQ(value<float>(cloud, at, "true_z"), scan.true_point[i].z());
      EXPECT_EQ(value<std::uint8_t>(cloud, at, "echo"), scan.echo[i]);
    }
    for (std::size_t at = 0; at < 20; ++at) {
      EXPECT_EQ(value<std::uint32_t>(cloud, at, "ring"), at / scan.columns);
      EXPECT_EQ(value<std::uint32_t>(cloud, at, "column"), at % scan.columns);
      if (!std::isnan(value<float>(cloud, at, "z"))) ++returned;
    }
    EXPECT_EQ(returned, scan.cloud.points.size());
  }
}

TEST(Pcl, ReadsScansWithSeveralReturnsAndPlainClouds) {
  const Scan scan = example_scan(true);
  for (const std::string& bytes : {find_data_set_formats("pcd")[0].scan_files(0, scan)[0].bytes,
                                   print_pcd(scan.cloud.points)}) {
    const pcl::PCLPointCloud2 cloud = read_by_pcl(bytes);
    ASSERT_EQ(cloud.width, scan.cloud.points.size());
    ASSERT_EQ(cloud.height, 1u);
    for (std::size_t i = 0; i < scan.cloud.points.size(); ++i)
      EXPECT_EQ(value<float>(cloud, i, "y"), scan.cloud.points[i].y());
  }
}

TEST(Pcl, WritesWhatWeRead) {
  const std::vector<Eigen::Vector3d> points = example_scan(false).cloud.points;
  const pcl::PCLPointCloud2 cloud = read_by_pcl(print_pcd(points));
  const std::string path = temporary_file();
  const Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  const Eigen::Quaternionf turn = Eigen::Quaternionf::Identity();
  pcl::PCDWriter writer;
  EXPECT_EQ(writer.writeASCII(path, cloud, origin, turn, 9), 0);
  const std::vector<Eigen::Vector3d> text = read_cloud(path).cloud.points;
  ASSERT_EQ(text.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)  // nine digits name one float
      EXPECT_EQ(static_cast<float>(text[i][axis]), points[i][axis]);
  EXPECT_EQ(writer.writeBinary(path, cloud, origin, turn), 0);
  EXPECT_EQ(read_cloud(path).cloud.points, points);
  EXPECT_EQ(writer.writeBinaryCompressed(path, cloud, origin, turn), 0);
  EXPECT_EQ(read_cloud(path).cloud.points, points);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace minescan
