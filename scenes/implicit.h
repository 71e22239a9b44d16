// SPDX-License-Identifier: MIT
// Surfaces given by a function of space: what mines are described by and what `contour` makes
// triangles of.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/cloud.h"
#include "core/interval.h"

namespace minescan {

/// The zero set of a function that is negative in the open space and positive in the rock. Both
/// functions are pure: any thread may call them, and the same argument gives the same bits.
struct ImplicitSurface {
  struct Sample {
    double value = 0;           // metres; near the surface about the distance to it
    std::uint8_t material = 0;  // of the nearest surface, index into `materials`
    // Which face of the surface is nearest. Where a face other than 0 meets another one, the edge
    // is sharp and a mesh keeps it; 0 are all faces that meet in rounded edges.
    std::uint8_t face = 0;
  };
  std::function<Sample(const Eigen::Vector3d& point)> at = {};
  /// Encloses the values in a ball. It may be wider than them, but a narrow one saves time.
  std::function<Interval(const Eigen::Vector3d& centre, double radius)> range = {};

  Eigen::AlignedBox3d bounds = {};  // contains the open space
  double area = 0;                  // m^2, roughly: tells the size of the mesh beforehand
  std::vector<Material> materials = {};
};

}  // namespace minescan
