// SPDX-License-Identifier: MIT
// Triangles from implicit surfaces: marching cubes with shared vertices, and sharp edges where the
// surface has them.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
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
/// returns  a closed 2-manifold whose triangles have an area, do not cross each other, and have
///          normals that point to negative values
/// throws   std::invalid_argument if edge_length is not a positive number or the estimated memory
///          is above contour_bytes_limit
/// cost     O(area / edge_length^2) time and memory if `range` is narrow, whatever the size of the
///          bounds; the same bytes for any number of threads
/// source   Lorensen and Cline 1987; the cases are derived, see marching_cases. Where faces (see
///          ImplicitSurface) meet, the edge between them is kept sharp by vertices on it: after
///          Kobbelt, Botsch, Schwanecke and Seidel, Feature sensitive surface extraction from
///          volume data, 2001, but with vertices in the faces of cubes in place of turned edges,
///          which may fold; see block_marcher.h. Edges that pass between the lattice's points
///          without a trace, and tips next to these, may be blunt by a part of a cube.
TriangleMesh contour(const ImplicitSurface& surface, double edge_length);

/// A square of the plan: a whole number of blocks of the lattice, fixed in the world.
struct Tile {
  std::int64_t x = 0;
  std::int64_t y = 0;
  auto operator<=>(const Tile&) const = default;
};

/// A surface too large for memory, piece by piece. Not for several threads at once; each call uses
/// all of them.
class SurfaceTiles {
 public:
  /// Keeps what was made last, up to `cache_bytes`.
  SurfaceTiles(ImplicitSurface surface, double edge_length, double cache_bytes);

  /// Side of a tile, metres: about 26 m.
  double tile_size() const;
  Tile tile_of(const Eigen::Vector3d& place) const;
  /// The part of the world within a tile; as high as the surface's bounds.
  Eigen::AlignedBox3d box_of(const Tile& tile) const;
  /// All tiles that come within `range` metres of `tile` and hold some of the bounds, sorted.
  std::vector<Tile> within(const Tile& tile, double range) const;

  /// The triangles of the given tiles: those that `contour` makes there, vertex for vertex. The
  /// mesh is open where it ends. It depends on the arguments alone, not on what was asked before.
  TriangleMesh mesh(std::span<const Tile> tiles);

  /// Tiles contoured so far, and bytes that the kept ones take.
  std::size_t tiles_made() const;
  double bytes_kept() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Corner i of a cube lies at (i & 1, i >> 1 & 1, i >> 2 & 1). Edge 4 a + k runs along axis a.
inline constexpr int cube_corners = 8;
inline constexpr int cube_edges = 12;
struct CubeEdge {
  std::uint8_t from = 0;  // corner at the lower end
  std::uint8_t to = 0;
};
const std::array<CubeEdge, cube_edges>& cube_edge_ends();

/// For each of the 256 sets of corners in the open space (bit i: corner i) the closed lines in
/// which the surface leaves the cube, each as the crossed edges that it runs through,
/// counter-clockwise seen from the open. Two neighbours of a line share a face of the cube.
using MarchingLoops = std::vector<std::vector<std::uint8_t>>;
const std::array<MarchingLoops, 256>& marching_loops();

/// The same cut into triangles between the crossed edges.
using MarchingCase = std::vector<std::array<std::uint8_t, 3>>;
const std::array<MarchingCase, 256>& marching_cases();

}  // namespace minescan
