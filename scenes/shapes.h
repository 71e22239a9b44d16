// SPDX-License-Identifier: MIT
// Closed meshes of plain shapes, that things are put together from. Each is a 2-manifold whose
// normals point outwards, into the open space.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "core/cloud.h"

namespace minescan {

/// A shape's place in the world: its axes and its origin.
using Frame = Eigen::Isometry3d;

/// A box of `size` about the frame's origin, added to `mesh`.
void add_box(TriangleMesh& mesh, const Frame& frame, const Eigen::Vector3d& size,
             std::uint8_t material);

/// A solid of revolution about the frame's x axis: `profile` lists (x, radius > 0) with x not
/// falling; both ends are closed by flat discs. `sides` >= 3.
void add_revolved(TriangleMesh& mesh, const Frame& frame, std::span<const Eigen::Vector2d> profile,
                  int sides, std::uint8_t material);

/// A tube of circular section along `line` (2 points or more, no two equal neighbours), closed at
/// both ends, mitred at the bends.
void add_tube(TriangleMesh& mesh, std::span<const Eigen::Vector3d> line, double radius, int sides,
              std::uint8_t material);

/// `more`'s triangles behind those of `mesh`; both have the same materials.
void append(TriangleMesh& mesh, const TriangleMesh& more);

}  // namespace minescan
