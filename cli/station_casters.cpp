// SPDX-License-Identifier: MIT
#include "cli/station_casters.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "cli/progress.h"
#include "scenes/half_edge.h"
#include "sim/scanner.h"

namespace minescan {
namespace {

std::vector<Eigen::Vector3d> places_of(const Survey& survey) {
  std::vector<Eigen::Vector3d> places;
  for (const Station& station : survey.stations)
    places.push_back(station.T_world_scanner.translation());
  return places;
}

}  // namespace

StationCasters::StationCasters(const SurveyConfig& config, bool quiet) : survey_(config.survey) {
  Progress progress(fmt::format("building {}", survey_.scene), 1, quiet);
  scene_ = find_scene(survey_.scene).make(survey_.scene_settings, config.seed);
  for (const Station& station : survey_.stations)
    ranges_.push_back(station_scanner(station).max_range);
  if (mesh_bytes(scene_) <= whole_mine_bytes) {
    TriangleMesh mesh = mesh_of(scene_, places_of(survey_));
    scene_json_ = mesh_json(scene_, mesh, false);
    caster_.emplace(std::move(mesh));
  } else {
    tiles_.emplace(scene_, tile_cache_bytes);
    for (std::size_t k = 0; k < ranges_.size(); ++k)
      tiles_->check_memory(tiles_->tile_of(survey_.stations[k].T_world_scanner.translation()),
                           ranges_[k], whole_mine_bytes);
    nlohmann::ordered_json json = {{"scene", scene_.name}, {"tiles", true}, {"closed", false}};
    json["warnings"] = {
        "too large for memory as a whole: each station's mesh ends beyond its scanner's max-range, "
        "and the triangle numbers of a scan are those of its own mesh"};
    scene_json_ = json.dump(2) + "\n";
  }
  progress.update(1);
}

RayCaster StationCasters::at(std::size_t k) {
  if (!tiles_) return *caster_;
  const Eigen::Vector3d place = survey_.stations.at(k).T_world_scanner.translation();
  const Tile tile = tiles_->tile_of(place);
  // What is refined around a station is its own.
  const bool own = scene_.mesh.near_levels > 0;
  if (!caster_ || own || tile != tile_ || ranges_[k] != range_) {
    caster_.reset();  // before the next is built: two would take too much memory
    caster_.emplace(tiles_->around(tile, ranges_[k], {&place, own ? 1U : 0U}), Tree::soon);
    tile_ = tile;
    range_ = ranges_[k];
  }
  return *caster_;
}

std::string mesh_json(const Scene& scene, const TriangleMesh& mesh, bool checked) {
  nlohmann::ordered_json json = {{"scene", scene.name},
                                 {"tiles", false},
                                 {"triangles", mesh.triangles.size()},
                                 {"vertices", mesh.vertices.size()}};
  std::vector<std::string> warnings;
  if (scene.surface && !checked) {
    json["closed"] = true;
  } else {
    const MeshCheck check = check_mesh(mesh);
    json["closed"] = check.closed();
    json["components"] = check.components;
    json["euler_characteristic"] = check.euler_characteristic;
    const auto count = [&](const char* key, std::size_t n, const char* text) {
      json[key] = n;
      if (n > 0) warnings.push_back(fmt::format("{} {}", n, text));
    };
    count("boundary_edges", check.boundary_edges,
          "edges with a triangle on one side only: rays may leave");
    count("refused_triangles", check.refused_triangles,
          "triangles do not fit their neighbours: more than two at an edge, or turned over");
    count("non_manifold_vertices", check.non_manifold_vertices, "vertices where surfaces touch");
    count("unused_vertices", check.unused_vertices, "vertices without triangles");
    count("degenerate_triangles", check.degenerate_triangles, "triangles without area");
    count("self_intersections", check.self_intersections, "pairs of triangles cross each other");
  }
  json["warnings"] = warnings;
  return json.dump(2) + "\n";
}

}  // namespace minescan
