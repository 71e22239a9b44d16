// SPDX-License-Identifier: MIT
// Triangles from implicit surfaces: marching cubes with shared vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/cloud.h"
#include "scenes/implicit.h"

namespace minescan {

/// Memory that contouring may take, as estimated by contour_bytes.
inline constexpr double contour_bytes_limit = 8.0 * (1ULL << 30);

/// About how much memory contouring needs at its peak: the mesh and, for a moment, its pieces.
double contour_bytes(const ImplicitSurface& surface, double edge_length);

/// The triangles of the surface on a lattice of cubes of side `edge_length`.
///
/// returns  a closed 2-manifold without degenerate triangles whose normals point to negative values
/// throws   std::invalid_argument if edge_length is not a positive number or the estimated memory
/// is
///          above contour_bytes_limit
/// cost     O(area / edge_length^2) calls of `at` if `range` is narrow; the same bytes for any
///          number of threads
/// source   Lorensen and Cline 1987; the cases are derived, see marching_cases
TriangleMesh contour(const ImplicitSurface& surface, double edge_length);

/// Corner i of a cube lies at (i & 1, i >> 1 & 1, i >> 2 & 1). Edge 4 a + k runs along axis a.
inline constexpr int cube_corners = 8;
inline constexpr int cube_edges = 12;
struct CubeEdge {
  std::uint8_t from = 0;  // corner at the lower end
  std::uint8_t to = 0;
};
const std::array<CubeEdge, cube_edges>& cube_edge_ends();

/// For each of the 256 sets of corners in the open space (bit i: corner i) the triangles between
/// the crossed edges.
using MarchingCase = std::vector<std::array<std::uint8_t, 3>>;
const std::array<MarchingCase, 256>& marching_cases();

}  // namespace minescan
