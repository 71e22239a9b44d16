// SPDX-License-Identifier: MIT
// The box around a cloud.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace minescan {

struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  bool finite = true;  // whether all coordinates are; else the box means nothing
};

/// Of at least one point. One pass, as fast as memory is read.
Bounds bounds_of(const std::vector<Eigen::Vector3d>& points);

}  // namespace minescan
