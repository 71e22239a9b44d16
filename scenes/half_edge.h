// SPDX-License-Identifier: MIT
// Meshes as a half-edge structure sees them: whether they are closed 2-manifolds, and their files.
#pragma once

#include <cstddef>
#include <filesystem>

#include "core/cloud.h"

namespace minescan {

/// What a mesh consists of and what is wrong with it.
struct MeshCheck {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t components = 0;               // pieces that share no vertex
  std::ptrdiff_t euler_characteristic = 0;  // vertices - edges + triangles; 2 for a sphere

  std::size_t boundary_edges = 0;  // with a triangle on one side only
  /// Triangles that would give an edge a third side, face against their neighbour or name a corner
  /// twice. They are left out of the counts above and may so leave boundary edges.
  std::size_t refused_triangles = 0;
  std::size_t non_manifold_vertices = 0;  // where surfaces touch in a point
  std::size_t unused_vertices = 0;
  std::size_t degenerate_triangles = 0;  // without area
  /// Pairs of triangles that cross or touch each other without sharing a vertex, and pairs that
  /// share one or two and have more in common than these and the edge between them. Decided as
  /// exact arithmetic would; see count_self_intersections.
  std::size_t self_intersections = 0;

  /// A 2-manifold without holes: no ray leaves it.
  bool closed() const {
    return triangles > 0 && boundary_edges == 0 && refused_triangles == 0 &&
           non_manifold_vertices == 0;
  }
  /// Closed, and its triangles have an area and do not cross each other.
  bool valid() const {
    return closed() && unused_vertices == 0 && degenerate_triangles == 0 && self_intersections == 0;
  }
};

/// What is wrong with `mesh`. Throws std::invalid_argument if a triangle names a vertex that is not
/// there.
///
/// cost  O(triangles) time (n log n for self-intersections) and about 80 bytes per triangle
MeshCheck check_mesh(const TriangleMesh& mesh);

/// `mesh` with about `ratio` (in (0, 1]) of its triangles: edges are collapsed where the shape
/// changes least (quadric error metrics, Garland and Heckbert 1997), onto one of their ends and so
/// that no triangle turns by more than 60 degrees. Vertices between triangles of several materials
/// stay, so each material keeps its outline; there may be more triangles left than asked for.
///
/// returns  a 2-manifold of the same pieces and holes, whose vertices and triangles are in the
/// order
///          of `mesh`; unused vertices are dropped. With ratio 1, `mesh`. That triangles do not
///          cross each other is likely but not certain; check_mesh tells.
/// throws   std::invalid_argument for a ratio out of range, another number of materials than of
///          triangles (or 0), or triangles or vertices that check_mesh would find not manifold
/// cost     about 40 microseconds per collapse, and 150 bytes per triangle
/// source   OpenMesh's decimater
TriangleMesh decimated(const TriangleMesh& mesh, double ratio);

/// Throws std::invalid_argument unless write_mesh knows what the name ends in: for those who want
/// to know before a long computation.
void check_mesh_name(const std::filesystem::path& path);

/// Writes vertices and triangles; the end of the name says how: .ply (binary), .stl (binary) or
/// .obj (text, all digits). Throws as check_mesh_name does, before anything else;
/// std::invalid_argument too for triangles that check_mesh would refuse, std::runtime_error if the
/// file cannot be written.
void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path);

}  // namespace minescan
