// SPDX-License-Identifier: MIT
#include "formats/cloud_file.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "core/input_file.h"
#include "core/output_file.h"
#include "core/text.h"

namespace minescan {

const std::vector<CloudFormat>& cloud_formats() {
  static const std::vector<CloudFormat> table = {
      {".ply", "Stanford polygon file; text and binary, x y z of element vertex", parse_ply,
       print_ply},
      {".pcd", "Point Cloud Library; ascii, binary and binary_compressed, fields x y z", parse_pcd,
       print_pcd},
      {".xyz", "text, one point per line: x y z, further columns ignored, # begins a comment",
       parse_xyz, print_xyz},
      {".csv", "text with columns x, y, z; comma, semicolon, tab or blanks between them", parse_csv,
       print_csv},
      {".npy", "NumPy array, N x 3 or wider, float32 or float64", parse_npy, print_npy},
      {".las", "ASPRS LAS 1.0 to 1.4, not compressed; written as 1.2 in steps of 0.01 mm",
       parse_las, [](const auto& points) { return print_las(points); }},
      {".bin", "KITTI scan: x y z reflectance, float32", parse_kitti,
       [](const auto& points) { return print_kitti(points); }},
      {".3d", "3DTK scan (uos): text, left-handed, centimetres; turned into our axes", parse_uos,
       [](const auto& points) { return print_uos(points); }},
  };
  return table;
}

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

const CloudFormat& find_cloud_format(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  std::vector<std::string> known;
  for (const CloudFormat& format : cloud_formats()) {
    if (format.extension == extension) return format;
    known.push_back(format.extension);
  }
  throw std::invalid_argument(path.string() + ": " + unknown_name("format", extension, known));
}

CloudFile read_cloud(const std::filesystem::path& path) {
  const CloudFormat& format = find_cloud_format(path);
  std::vector<Eigen::Vector3d> points = format.parse(read_file(path), path.string());
  const std::size_t all = points.size();
  if (all == 0) throw std::runtime_error(path.string() + ": expected points, found none");
  std::erase_if(points, [](const Eigen::Vector3d& p) { return !p.allFinite(); });
  if (points.empty())
    throw std::runtime_error(path.string() + ": none of its " + std::to_string(all) +
                             " points has three finite coordinates");
  CloudFile file{.cloud = {.points = std::move(points)}};
  file.dropped = all - file.cloud.points.size();
  return file;
}

void write_cloud(const std::filesystem::path& path, const PointCloud& cloud) {
  write_file(path, find_cloud_format(path).print(cloud.points));
}

}  // namespace minescan
