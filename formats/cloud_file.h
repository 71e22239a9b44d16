// SPDX-License-Identifier: MIT
// Point clouds in files, by extension: one row per format.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud.h"

namespace minescan {

/// The points of a file that have three finite coordinates, and how many had not.
struct CloudFile {
  PointCloud cloud = {};  // metres, in the frame of the file
  std::size_t dropped = 0;
};

/// One row of the table of formats.
struct CloudFormat {
  std::string extension = {};  // ".ply"
  std::string description = {};
  /// Coordinates of all points of a file's bytes, finite or not. Throws std::runtime_error
  /// "name:line: what" or "name: what" for anything but a whole file of this format.
  std::function<std::vector<Eigen::Vector3d>(std::string_view bytes, const std::string& name)>
      parse = {};
  /// The bytes of a file that holds these points.
  std::function<std::string(const std::vector<Eigen::Vector3d>& points)> print = {};
};

const std::vector<CloudFormat>& cloud_formats();

/// The extension of `path` in lower case: ".ply".
std::string lower_extension(const std::filesystem::path& path);

/// The row for the extension of `path` (upper or lower case). Throws std::invalid_argument with the
/// known ones.
const CloudFormat& find_cloud_format(const std::filesystem::path& path);

/// Reads a cloud. Throws std::runtime_error naming the file if it cannot be read, is damaged, or
/// has no finite point.
CloudFile read_cloud(const std::filesystem::path& path);

/// Writes a cloud, whole or not at all.
void write_cloud(const std::filesystem::path& path, const PointCloud& cloud);

// The formats, one .cpp each.

std::vector<Eigen::Vector3d> parse_ply(std::string_view bytes, const std::string& name);
std::string print_ply(const std::vector<Eigen::Vector3d>& points);

/// PCD is written in single precision: PCL's point types hold no other.
std::vector<Eigen::Vector3d> parse_pcd(std::string_view bytes, const std::string& name);
std::string print_pcd(const std::vector<Eigen::Vector3d>& points);

std::vector<Eigen::Vector3d> parse_xyz(std::string_view bytes, const std::string& name);
std::string print_xyz(const std::vector<Eigen::Vector3d>& points);

/// Fields separated by comma, semicolon, tab or blanks, whichever the first line has. A first line
/// that is not all numbers names the columns; among them must be x, y and z (in any case). Without
/// such a line they are the first three.
std::vector<Eigen::Vector3d> parse_csv(std::string_view bytes, const std::string& name);
std::string print_csv(const std::vector<Eigen::Vector3d>& points);

/// NumPy's array files, versions 1 to 3: N x k, k >= 3, of float32 or float64 in either byte order,
/// by rows or by columns (Fortran order). x, y, z are the first three columns. Source:
/// numpy.lib.format.
std::vector<Eigen::Vector3d> parse_npy(std::string_view bytes, const std::string& name);
std::string print_npy(const std::vector<Eigen::Vector3d>& points);

/// ASPRS LAS 1.0 to 1.4, not compressed; any point format, of which the coordinates are read.
/// Written as print_las of formats/las.h says, rounded to 0.01 mm.
std::vector<Eigen::Vector3d> parse_las(std::string_view bytes, const std::string& name);
std::string print_las(const std::vector<Eigen::Vector3d>& points);

/// The scans of the KITTI benchmarks: x, y, z and reflectance of each point as little-endian
/// floats, without a header. Written in single precision; the reflectance is `intensity`, 0 if that
/// is empty.
std::vector<Eigen::Vector3d> parse_kitti(std::string_view bytes, const std::string& name);
std::string print_kitti(const std::vector<Eigen::Vector3d>& points,
                        const std::vector<float>& intensity = {});

/// 3DTK's uos scans, turned into our axes (formats/uos.h). Written in steps of 1e-4 cm (1 um), with
/// `intensity`, if there is any, as fourth column (which 3DTK calls uosr).
std::vector<Eigen::Vector3d> parse_uos(std::string_view bytes, const std::string& name);
std::string print_uos(const std::vector<Eigen::Vector3d>& points,
                      const std::vector<float>& intensity = {});

}  // namespace minescan
