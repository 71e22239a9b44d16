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
std::vector<Eigen::Vector3d> parse_pcd(std::string_view bytes, const std::string& name);
std::string print_pcd(const std::vector<Eigen::Vector3d>& points);
std::vector<Eigen::Vector3d> parse_xyz(std::string_view bytes, const std::string& name);
std::string print_xyz(const std::vector<Eigen::Vector3d>& points);

}  // namespace minescan
