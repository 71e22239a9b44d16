// SPDX-License-Identifier: MIT
// Closed meshes of plain shapes, that things are put together from. Each is a 2-manifold whose
// normals point outwards, into the open space. All throw std::invalid_argument for numbers that
// make no such shape and then leave the mesh as it was.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>

#include "core/cloud.h"

namespace minescan {

/// A shape's place in the world: its axes and its origin.
using Frame = Eigen::Isometry3d;

/// A box of `size` (metres, each > 0) about the frame's origin, added to `mesh`.
void add_box(TriangleMesh& mesh, const Frame& frame, const Eigen::Vector3d& size,
             std::uint8_t material);

/// A solid of revolution about the frame's x axis: `profile` lists (x, radius > 0) with x not
/// falling; both ends are closed by flat discs. `sides` >= 3. Steps of the radius at one x must not
/// turn back, nor overhang the discs. The corners lie on the circles, so that the section is a
/// regular polygon within them.
void add_revolved(TriangleMesh& mesh, const Frame& frame, std::span<const Eigen::Vector2d> profile,
                  int sides, std::uint8_t material);

/// A tube of circular section along `line` (2 points or more, no two equal neighbours), closed at
/// both ends, mitred at the bends. Its volume is that of its section times the length of the line.
/// The section does not turn about the line (rotation-minimising frames). Throws for a line that
/// the tube does not fit, see tube_fits.
void add_tube(TriangleMesh& mesh, std::span<const Eigen::Vector3d> line, double radius, int sides,
              std::uint8_t material);

/// Whether every leg of `line` is longer than what the mitres at its ends take of it; otherwise the
/// tube would fold into itself. Legs that meet again elsewhere are not looked for.
bool tube_fits(std::span<const Eigen::Vector3d> line, double radius);

/// `more`'s triangles behind those of `mesh`; both have the same materials. Throws
/// std::invalid_argument if the vertices become too many for their indices.
void append(TriangleMesh& mesh, const TriangleMesh& more);

}  // namespace minescan
