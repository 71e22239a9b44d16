// SPDX-License-Identifier: MIT
#include "cli/station_casters.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "cli/progress.h"
#include "scenes/half_edge.h"
#include "sim/scanner.h"

namespace minescan {
namespace {

// Of the scanner at station k, or of the drive.
double range_of(const Survey& survey, std::size_t k) {
  if (survey.drive)
    return with_settings(find_scanner(survey.drive->scanner), survey.drive->settings).max_range;
  return station_scanner(survey.stations.at(k)).max_range;
}

// Where a scanner cannot be: in the rock, or outside of the mine, which is the same.
void check_places(const Scene& scene, const Survey& survey) {
  if (!scene.surface) return;  // what is inside of the triangles of a file is not known
  const ImplicitSurface surface = scene.surface(scene.mesh.edge_length);
  for (std::size_t k = 0; k < survey.stations.size(); ++k) {
    const Eigen::Vector3d place = survey.stations[k].T_world_scanner.translation();
    if (!(surface.bounds.contains(place) && surface.at(place).value < 0))
      throw std::invalid_argument(fmt::format(
          "station {}: ({:.3f}, {:.3f}, {:.3f}) is in the rock or outside of the mine; expected a "
          "place in the open",
          k, place.x(), place.y(), place.z()));
  }
}

}  // namespace

StationCasters::StationCasters(const SurveyConfig& config, bool quiet)
    : survey_(config.survey), seed_(config.seed) {
  Progress progress(fmt::format("building {}", survey_.scene), 1, quiet);
  scene_ = find_scene(survey_.scene).make(survey_.scene_settings, config.seed);
  for (const CentreLine& line : scene_.centre_lines) lines_[line.drift] = line.points;
  const std::vector<Eigen::Vector3d> places = planned_places(survey_, lines_, seed_);
  check_places(scene_, survey_);
  if (mesh_bytes(scene_) <= whole_mine_bytes) {
    TriangleMesh mesh = mesh_of(scene_, places);
    scene_json_ = mesh_json(scene_, mesh, false);
    caster_.emplace(std::move(mesh));
  } else {
    tiles_.emplace(scene_, tile_cache_bytes);
    for (std::size_t k = 0; k < places.size(); ++k)
      tiles_->check_memory(tiles_->tile_of(places[k]), range_of(survey_, k), whole_mine_bytes);
    nlohmann::ordered_json json = {{"scene", scene_.name}, {"tiles", true}, {"closed", false}};
    json["warnings"] = {
        "too large for memory as a whole: each station's mesh ends beyond its scanner's max-range, "
        "and the triangle numbers of a scan are those of its own mesh"};
    scene_json_ = json.dump(2) + "\n";
  }
  progress.update(1);
}

Survey StationCasters::stations() {
  const Ground ground = [&](const Eigen::Vector3d& from) {
    return height_below(around(from, range_of(survey_, 0), false), from);
  };
  survey_ = driven(survey_, lines_, ground, seed_);
  check_places(scene_, survey_);
  return survey_;
}

RayCaster StationCasters::at(std::size_t k) {
  return around(survey_.stations.at(k).T_world_scanner.translation(), range_of(survey_, k), true);
}

RayCaster StationCasters::around(const Eigen::Vector3d& place, double range, bool refined) {
  if (!tiles_) return *caster_;
  const Tile tile = tiles_->tile_of(place);
  // What is refined around a station is its own.
  const bool own = refined && scene_.mesh.near_levels > 0;
  if (!caster_ || own || refined_ || tile != tile_ || range != range_) {
    caster_.reset();  // before the next is built: two would take too much memory
    caster_.emplace(tiles_->around(tile, range, {&place, own ? 1U : 0U}), Tree::soon);
    tile_ = tile;
    range_ = range;
    refined_ = own;
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
