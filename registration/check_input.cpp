// SPDX-License-Identifier: MIT
#include "registration/check_input.h"

#include <fmt/format.h>

#include <cstdint>
#include <limits>

namespace minescan {
namespace {

void check_cloud(const PointCloud& cloud, const char* name) {
  const std::size_t count = cloud.points.size();
  if (count == 0) throw std::invalid_argument(fmt::format("the {} cloud is empty", name));
  if (count > std::numeric_limits<std::uint32_t>::max()) {
    throw std::invalid_argument(
        fmt::format("the {} cloud has {} points, expected fewer than 2^32", name, count));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d& p = cloud.points[i];
    if (p.allFinite()) continue;
    throw std::invalid_argument(
        fmt::format("point {} of the {} cloud is ({}, {}, {}), expected finite coordinates", i,
                    name, p.x(), p.y(), p.z()));
  }
}

}  // namespace

void check_clouds(const PointCloud& target, const PointCloud& source, const Pose& T_guess) {
  check_cloud(target, "target");
  check_cloud(source, "source");
  if (!T_guess.matrix().allFinite())
    throw std::invalid_argument("the start pose has a number that is not finite");
}

}  // namespace minescan
