// SPDX-License-Identifier: MIT
#include "scenes/scene_mesh.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/text.h"
#include "scenes/refine.h"
#include "scenes/shapes.h"

namespace minescan {
namespace {

Eigen::AlignedBox2d everywhere() {
  const double far = std::numeric_limits<double>::infinity();
  return {Eigen::Vector2d(-far, -far), Eigen::Vector2d(far, far)};
}

ImplicitSurface surface_at(const Scene& scene, double edge_length) {
  if (!scene.surface)
    throw std::invalid_argument("scene '" + scene.name +
                                "': the triangles of a file are there all at once");
  return scene.surface(edge_length);
}

}  // namespace

TriangleMesh mesh_of(const Scene& scene, std::span<const Eigen::Vector3d> near) {
  if (!scene.surface) return scene.triangles;
  const double edge = scene.mesh.edge_length;
  TriangleMesh mesh = contour(scene.surface(edge), edge);
  mesh = refined(std::move(mesh), scene.surface, edge, near,
                 {.range = scene.mesh.near_range, .levels = scene.mesh.near_levels});
  if (scene.things) append(mesh, scene.things(everywhere()));
  return mesh;
}

double mesh_bytes(const Scene& scene) {
  if (!scene.surface) return 0;
  return contour_bytes(scene.surface(scene.mesh.edge_length), scene.mesh.edge_length);
}

SceneTiles::SceneTiles(Scene scene, double cache_bytes)
    : scene_(std::move(scene)),
      tiles_(surface_at(scene_, scene_.mesh.edge_length), scene_.mesh.edge_length, cache_bytes) {
  const Eigen::Vector3d size = scene_.surface(scene_.mesh.edge_length).bounds.sizes();
  bytes_per_area_ = mesh_bytes(scene_) / (size.x() * size.y());
}

TriangleMesh SceneTiles::around(const Tile& tile, double range,
                                std::span<const Eigen::Vector3d> near) {
  const std::vector<Tile> parts = tiles_.within(tile, range);
  TriangleMesh mesh = tiles_.mesh(parts);
  mesh = refined(std::move(mesh), scene_.surface, scene_.mesh.edge_length, near,
                 {.range = scene_.mesh.near_range, .levels = scene_.mesh.near_levels});
  if (!scene_.things) return mesh;
  std::map<Tile, TriangleMesh> things;
  for (const Tile& part : parts) {
    const Eigen::AlignedBox3d box = tiles_.box_of(part);
    const auto known = things_.find(part);
    const TriangleMesh& here =
        (things[part] = known != things_.end() ? std::move(known->second)
                                               : scene_.things({box.min().head<2>().eval(),
                                                                box.max().head<2>().eval()}));
    append(mesh, here);
  }
  things_ = std::move(things);
  return mesh;
}

void SceneTiles::check_memory(const Tile& tile, double range, double limit) const {
  const double side = tiles_.tile_size();
  const double bytes =
      bytes_per_area_ * side * side * static_cast<double>(tiles_.within(tile, range).size());
  if (!(bytes <= limit))
    throw std::invalid_argument(
        "scene '" + scene_.name + "': the mine within " + number_text(range) +
        " m of a scanner needs about " + number_text(std::ceil(bytes / (1 << 20))) +
        " MiB; expected at most " + number_text(limit / (1 << 20)) +
        " MiB: use longer edges (edge-length) or a scanner that reaches less far (max-range)");
}

}  // namespace minescan
