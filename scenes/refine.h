// SPDX-License-Identifier: MIT
// Shorter edges where a scanner stands: triangles near given places are split and their new
// vertices put on the surface with the finer relief that they can show.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>

#include "core/cloud.h"
#include "scenes/implicit.h"

namespace minescan {

/// Where to refine. Level k (1, 2, ... levels) has edges of edge_length / 2^k within
/// range * 2^(levels - k) of a place, so that edges seen from it grow with their distance.
struct Refinement {
  double range = 8;  // metres, of the finest level
  int levels = 0;    // 0: nothing is refined
};

/// `mesh`, contoured with edges of `edge_length`, with its triangles near `places` split.
///
/// surface  the surface with the relief that edges of a given length can show
/// returns  a 2-manifold where `mesh` is one, of the same pieces and holes; vertices of `mesh` keep
///          their indices. The materials are those of every level one after the other, since the
///          relief that is left out differs: material m of level k has index
///          k * mesh.materials.size() + m. A triangle is of the highest level within whose range
///          all its corners are. Edges where faces of the surface meet (see ImplicitSurface) stay
///          straight between the vertices of `mesh`; elsewhere a vertex stays where no surface is
///          within half an edge of its level or a triangle would turn by more than 60 degrees.
/// cost     about 3 evaluations of the surface per new vertex; the same bytes for any number of
///          threads
/// throws   std::invalid_argument for numbers that are no lengths, more than 256 materials in all,
///          or more memory than contour_bytes_limit
TriangleMesh refined(TriangleMesh mesh,
                     const std::function<ImplicitSurface(double edge_length)>& surface,
                     double edge_length, std::span<const Eigen::Vector3d> places,
                     const Refinement& refinement);

}  // namespace minescan
