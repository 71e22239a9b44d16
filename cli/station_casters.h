// SPDX-License-Identifier: MIT
// The mine around each station of a survey, ready for rays: whole where it fits into memory, else
// the tiles that a station's scanner reaches.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/scene_config.h"
#include "scenes/scene_mesh.h"
#include "sim/raycaster.h"

namespace minescan {

/// Mines whose contouring needs more than this are built in tiles: with the ray caster's tree the
/// whole takes about three times as much.
inline constexpr double whole_mine_bytes = 1.0 * (1ULL << 30);
/// What may be kept of tiles that are not in use.
inline constexpr double tile_cache_bytes = 0.75 * (1ULL << 30);

class StationCasters {
 public:
  /// Prepares the scene; builds the whole mesh if it is small enough. Throws std::invalid_argument
  /// if the tiles around a station would need too much memory, or for a drive that cannot be.
  StationCasters(const SurveyConfig& config, bool quiet);

  /// The survey with all its stations: those of a drive stand on the ground of the mine. Throws
  /// std::invalid_argument for a station inside the rock or outside of the mine.
  Survey stations();

  /// What the rays of station k of `stations()` meet. Depends on k alone; fastest for neighbours
  /// one after the other.
  RayCaster at(std::size_t k);

  /// What is known of the mesh, as JSON: counts of triangles and vertices, whether it is one mesh
  /// or tiles, and for triangles of a file what a check found, with a list of warnings.
  std::string scene_json() const { return scene_json_; }

 private:
  // The mine within `range` of `place`; `refined`: with the short edges of a scanner there.
  RayCaster around(const Eigen::Vector3d& place, double range, bool refined);

  Survey survey_;
  std::uint64_t seed_;
  Scene scene_;
  DriftLines lines_;
  std::optional<SceneTiles> tiles_;
  std::optional<RayCaster> caster_;
  // What caster_ was built for, where there are tiles.
  Tile tile_ = {};
  double range_ = -1;
  bool refined_ = false;
  std::string scene_json_;
};

/// The same text of any scene's mesh. `checked`: check it whatever it is; else only triangles of a
/// file are checked, for the other scenes are closed by construction.
std::string mesh_json(const Scene& scene, const TriangleMesh& mesh, bool checked);

}  // namespace minescan
