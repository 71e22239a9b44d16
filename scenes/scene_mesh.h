// SPDX-License-Identifier: MIT
// The triangles of a scene: all at once, or those around a place where the whole is too large.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "core/cloud.h"
#include "scenes/contour.h"
#include "scenes/scene.h"

namespace minescan {

/// All triangles: a closed 2-manifold in the world frame (z up, metres) whose normals point into
/// the open space; of several pieces where things hang or stand in it. The triangles of a file are
/// as they are. The same bytes for any number of threads.
///
/// near    places of scanners, around which edges are halved `near-levels` times
/// throws  std::invalid_argument if that needs more memory than contour_bytes_limit
TriangleMesh mesh_of(const Scene& scene, std::span<const Eigen::Vector3d> near = {});

/// About how much memory mesh_of needs, bytes, without what is near scanners.
double mesh_bytes(const Scene& scene);

/// A scene piece by piece. As SurfaceTiles, with the things of each tile.
class SceneTiles {
 public:
  /// Throws std::invalid_argument for the triangles of a file.
  SceneTiles(Scene scene, double cache_bytes);

  Tile tile_of(const Eigen::Vector3d& place) const { return tiles_.tile_of(place); }
  /// All within `range` metres of any place of `tile`, and more. Every triangle of the rock is one
  /// of mesh_of(scene), but for those around `near`.
  TriangleMesh around(const Tile& tile, double range, std::span<const Eigen::Vector3d> near = {});
  /// Throws std::invalid_argument if `around` would need more than `limit` bytes, about.
  void check_memory(const Tile& tile, double range, double limit) const;

 private:
  Scene scene_;
  double bytes_per_area_ = 0;  // of the plan's box, on average
  SurfaceTiles tiles_;
  std::map<Tile, TriangleMesh> things_;  // of the tiles asked for last
};

}  // namespace minescan
