// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <stdexcept>

#include "core/input_file.h"
#include "formats/binary.h"
#include "formats/cloud_file.h"

namespace minescan {

std::vector<Eigen::Vector3d> parse_kitti(std::string_view bytes, const std::string& name) {
  constexpr std::size_t stride = 4 * sizeof(float);
  if (bytes.size() % stride != 0)
    throw std::runtime_error(
        fmt::format("{}: expected points of {} bytes, found {} and {} bytes more", name, stride,
                    bytes.size() / stride, bytes.size() % stride));
  std::vector<Eigen::Vector3d> points(bytes.size() / stride);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[i][static_cast<int>(axis)] =
          load<float>(bytes.data() + i * stride + axis * sizeof(float), false);
  return points;
}

std::string print_kitti(const std::vector<Eigen::Vector3d>& points,
                        const std::vector<float>& intensity) {
  std::string bytes;
  bytes.reserve(points.size() * 4 * sizeof(float));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(points[i][axis]));
    append(bytes, intensity.empty() ? 0.0F : intensity.at(i));
  }
  return bytes;
}

}  // namespace minescan
