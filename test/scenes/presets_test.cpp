// SPDX-License-Identifier: MIT
// The scenes that can be made by name.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "scenes/half_edge.h"
#include "scenes/materials.h"
#include "scenes/scene.h"
#include "scenes/scene_mesh.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

Scene made(const std::string& name, const Settings& settings, std::uint64_t seed = 1) {
  return find_scene(name).make(settings, seed);
}

Settings with(Settings settings, const std::string& name, const std::string& value) {
  settings[name] = value;
  return settings;
}

/// Area of the triangles of each material.
std::vector<double> areas(const TriangleMesh& mesh) {
  std::vector<double> list(mesh.materials.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = corners(mesh, mesh.triangles[t]);
    list.at(mesh.material[t]) += (b - a).cross(c - a).norm() / 2;
  }
  return list;
}

const Settings flat = {{"wall-rms", "0"},          {"ceiling-rms", "0"},  {"floor-class", "none"},
                       {"bedding-step", "0"},      {"overbreak", "0"},    {"look-out", "0"},
                       {"rock-density", "0"},      {"rut-depth", "0"},    {"corner-radius", "0"},
                       {"half-cast-spacing", "0"}, {"furnished", "false"}};

/// Smallest settings with which each row of the table makes a scene; none for a file's.
std::vector<std::pair<const SceneKind*, Settings>> all_scenes(const std::string& edge_length) {
  std::vector<std::pair<const SceneKind*, Settings>> list;
  for (const SceneKind& kind : scenes()) {
    Settings settings = {{"edge-length", edge_length}};
    if (kind.name == "mesh") continue;
    if (kind.name == "mine") {
      settings["drifts.a.line"] = "0 0, 20 0, 30 8 -0.5";
      settings["drifts.a.course"] = "spline";
      settings["drifts.a.arch"] = "1.5";
      settings["drifts.b.off"] = "a";
      settings["drifts.b.at"] = "8";
      settings["drifts.b.end"] = "concrete";
      settings["pillars.p.at"] = "14 1";
      settings["pillars.p.width"] = "2";
    }
    if (kind.name == "room-and-pillar") settings["columns"] = "4";
    list.emplace_back(&kind, settings);
  }
  return list;
}

TEST(Scenes, AreClosedManifoldsWithoutCrossings) {
  for (const auto& [kind, settings] : all_scenes("0.2")) {
    for (const std::uint64_t seed : {1, 2}) {
      const Scene scene = kind->make(settings, seed);
      const TriangleMesh mesh = mesh_of(scene);
      SCOPED_TRACE(kind->name + " seed " + std::to_string(seed));
      EXPECT_EQ(scene.name, kind->name);
      EXPECT_EQ(mesh.material.size(), mesh.triangles.size());
      const MeshCheck check = check_mesh(mesh);
      EXPECT_TRUE(check.closed());
      EXPECT_EQ(check.degenerate_triangles, 0U);
      EXPECT_EQ(check.self_intersections, 0U);
      EXPECT_TRUE(check.valid());
      EXPECT_GT(measures(mesh).volume, 0);  // normals point into the open space
    }
  }
}

TEST(Scenes, AreClosedManifoldsAtTheirDefaults) {
  const MeshCheck check = check_mesh(mesh_of(made("junction", {{"furnished", "false"}})));
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 1U);
  EXPECT_EQ(check.euler_characteristic, 2);
  EXPECT_GT(check.triangles, 1000000U);
}

TEST(Scenes, AreClosedAndLieInsideWhereTheyAreViewedFrom) {
  for (const auto& [kind, settings] : all_scenes("0.2")) {
    const Scene scene = kind->make(settings, 1);
    const ImplicitSurface surface = scene.surface(0.2);
    EXPECT_LT(surface.at(scene.T_world_view.translation()).value, -0.3) << kind->name;
    for (const CentreLine& line : scene.centre_lines)
      for (const Eigen::Vector3d& p : line.points)
        EXPECT_TRUE(surface.bounds.contains(Eigen::Vector3d(p + Eigen::Vector3d(0, 0, 1))))
            << kind->name;
  }
}

TEST(Scenes, DependOnSeedAndSettingsOnly) {
  for (const auto& [kind, settings] : all_scenes("0.4")) {
    SCOPED_TRACE(kind->name);
    TriangleMesh one;
    {
      const ThreadLimit limit(1);
      one = mesh_of(kind->make(settings, 7));
    }
    const ThreadLimit limit(4);
    EXPECT_TRUE(same_bytes(one, mesh_of(kind->make(settings, 7))));
    const bool exact = find_field(kind->fields(settings), "wall-rms") == nullptr;
    EXPECT_EQ(same_bytes(one, mesh_of(kind->make(settings, 8))), exact);
  }
}

TEST(Scenes, RefuseWrongSettings) {
  for (const auto& [kind, settings] : all_scenes("0.2")) {
    for (const std::string value : {"0", "-1", "1e9", "1e-9", "nan", "", "five"})
      EXPECT_THROW(kind->make(with(settings, "edge-length", value), 1), std::invalid_argument)
          << value;
    EXPECT_THROW(kind->make(with(settings, "edge-lenght", "0.1"), 1), std::invalid_argument);
  }
  EXPECT_THROW(mesh_of(made("junction", {{"wall-inner", "20"}})), std::invalid_argument);
  EXPECT_THROW(find_scene("tunel"), std::invalid_argument);
}

TEST(Scenes, SayHowMuchMemoryTheyWouldNeedBeforeTheyStart) {
  const Scene scene = made("room-and-pillar", {{"edge-length", "0.01"}, {"columns", "40"}});
  EXPECT_GT(mesh_bytes(scene), contour_bytes_limit);
  try {
    mesh_of(scene);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("GiB"), std::string::npos) << error.what();
  }
}

TEST(Scenes, AreTheSameInTiles) {
  const Scene scene =
      made("room-and-pillar", {{"edge-length", "0.4"}, {"columns", "4"}, {"rows", "3"}});
  const auto triangles_of = [](const TriangleMesh& mesh) {
    std::vector<std::array<float, 9>> list;
    for (const auto& t : mesh.triangles) {
      std::array<float, 9> triangle = {};
      for (std::size_t c = 0; c < 3; ++c)
        for (int axis = 0; axis < 3; ++axis)
          triangle[3 * c + static_cast<std::size_t>(axis)] = mesh.vertices[t[c]][axis];
      list.push_back(triangle);
    }
    std::sort(list.begin(), list.end());
    return list;
  };
  const auto whole = triangles_of(mesh_of(scene));
  SceneTiles tiles(scene, 1e8);
  const Tile here = tiles.tile_of({0, 0, 2});
  // All of it lies within 150 m, and little within 15 m.
  EXPECT_EQ(triangles_of(tiles.around(here, 150)), whole);
  const auto part = triangles_of(tiles.around(here, 15));
  EXPECT_LT(part.size(), whole.size());
  EXPECT_GT(part.size(), whole.size() / 10);
  EXPECT_TRUE(std::includes(whole.begin(), whole.end(), part.begin(), part.end()));
  EXPECT_NO_THROW(tiles.check_memory(here, 15, 1e9));
  EXPECT_THROW(tiles.check_memory(here, 15, 1e4), std::invalid_argument);
}

TEST(Scenes, HaveShorterEdgesNearAScanner) {
  const Scene scene = made(
      "junction",
      {{"edge-length", "0.2"}, {"near-levels", "2"}, {"near-range", "4"}, {"furnished", "false"}});
  const Eigen::Vector3d scanner(0, 0, 2);
  const TriangleMesh mesh = mesh_of(scene, {&scanner, 1});
  EXPECT_TRUE(check_mesh(mesh).valid());
  double near = 0, far = 0;
  std::size_t near_count = 0, far_count = 0;
  for (const auto& t : mesh.triangles) {
    const auto [a, b, c] = corners(mesh, t);
    const double area = (b - a).cross(c - a).norm() / 2;
    const double distance = ((a + b + c) / 3 - scanner).norm();
    if (distance < 3) near += area, ++near_count;
    if (distance > 10) far += area, ++far_count;
  }
  ASSERT_GT(near_count, 100U);
  // Edges a quarter as long: triangles a sixteenth as large.
  EXPECT_NEAR(far / static_cast<double>(far_count) / (near / static_cast<double>(near_count)), 16,
              5);
  // What is left out of the relief is less there.
  ASSERT_EQ(mesh.materials.size(), 3 * scene.surface(0.2).materials.size());
  EXPECT_LT(mesh.materials[2 * mesh.materials.size() / 3].roughness, mesh.materials[0].roughness);
}

TEST(Tunnel, WithoutReliefHasFlatFaces) {
  const TriangleMesh mesh = mesh_of(made("tunnel", with(flat, "edge-length", "0.2")));
  for (const Eigen::Vector3f& v : mesh.vertices) {
    const double x = std::max(-40.0 - v.x(), v.x() - 44.0);
    const double y = std::abs(v.y()) - 5.0;
    const double z = std::max<double>(-v.z(), v.z() - 6.0);
    // Each vertex lies on one of the faces, off the others; 2e-6 m is half a step of a float at 44
    // m. Vertices that cut an edge or corner of the tunnel lie within.
    EXPECT_NEAR(std::max({x, y, z}), 0, 2e-6) << v.transpose();
  }
}

// The relief belongs to the world: a finer mesh shows the same mine.
TEST(Junction, IsTheSameMineForAnyEdgeLength) {
  const Measures coarse =
      measures(mesh_of(made("junction", {{"edge-length", "0.2"}, {"furnished", "false"}})));
  const Measures fine =
      measures(mesh_of(made("junction", {{"edge-length", "0.1"}, {"furnished", "false"}})));
  // What differs is the shortest octave, whose mean is zero, and chords across rounded corners.
  EXPECT_NEAR(coarse.volume / fine.volume, 1, 0.001);
}

TEST(Junction, HasAFlatConcreteFaceAndItsOtherMaterials) {
  const TriangleMesh mesh = mesh_of(made("junction", {{"edge-length", "0.1"}}));
  EXPECT_EQ(mesh.materials.at(concrete).name, "concrete");
  EXPECT_EQ(mesh.materials.at(concrete).reflectance, 0.40);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.material[t] != concrete) continue;
    for (const Eigen::Vector3d& p : corners(mesh, mesh.triangles[t])) {
      // Up to its sharp edges; what rock covers of the cells there may belong to it.
      ASSERT_NEAR(p.x(), 12, 0.1);
      const bool off_the_rim = std::abs(p.y()) < 4.2 && p.z() > 0.3 && p.z() < 5.7;
      if (off_the_rim) {
        ASSERT_NEAR(p.x(), 12, 1e-6);
      }
    }
  }
  const std::vector<double> area = areas(mesh);
  // Floor: the drifts' plan, 30 x 10 + 12 x 8 m; face 10 x 6 m; four lights of 1.5 x 0.3 x 0.3 m.
  // Rims are rounded by 0.4 m, part to each side; relief and stones add some per cent.
  EXPECT_NEAR(area[gravel], 396, 20);
  EXPECT_NEAR(area[concrete], 60, 8);
  EXPECT_NEAR(area[fixture], 4 * (2 * 1.5 * 0.3 + 2 * 1.8 * 0.3), 0.01);
  // Ceiling: the same plan.
  EXPECT_NEAR(area[bedded_sandstone], 396, 25);
}

/// Casts a ray through all triangles: the distance to the first one met. Rays must be off the sides
/// of triangles, which lie at multiples of half an edge length.
double cast(const TriangleMesh& mesh, const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  double nearest = 1e9;
  for (const auto& triangle : mesh.triangles) {
    const auto [a, b, c] = corners(mesh, triangle);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double t = normal.dot(a - from) / normal.dot(along);
    if (!(t > 0 && t < nearest)) continue;
    const Eigen::Vector3d p = from + t * along;
    if (normal.dot((b - a).cross(p - a)) < 0 || normal.dot((c - b).cross(p - b)) < 0 ||
        normal.dot((a - c).cross(p - c)) < 0)
      continue;
    nearest = t;
  }
  return nearest;
}

// How far the rock of a wall, floor and ceiling may lie from its place: four RMS of its relief, and
// half the look-out, twice the overbreak; a stone and a rut; two bedding steps.
constexpr double wall_slack = 4 * 0.07 + 0.05 + 0.2;
constexpr double floor_slack = 4 * 0.01 + 0.15;
constexpr double ceiling_slack = 4 * 0.015 + 0.08;

TEST(Junction, HasItsFacesWhereTheyAreSaidToBe) {
  const TriangleMesh mesh =
      mesh_of(made("junction", {{"edge-length", "0.2"}, {"furnished", "false"}}));
  const Eigen::Vector3d scanner(0.013, 0.017, 2.011);
  EXPECT_NEAR(cast(mesh, scanner, {1, 0, 0}), 12 - 0.013, 1e-5);
  EXPECT_NEAR(cast(mesh, scanner, {-1, 0, 0}), 18, wall_slack);
  EXPECT_NEAR(cast(mesh, scanner, {0, -1, 0}), 5, wall_slack);
  EXPECT_NEAR(cast(mesh, scanner, {0, 0, -1}), 2, floor_slack);
  EXPECT_NEAR(cast(mesh, scanner, {0, 0, 1}), 4, ceiling_slack);
  EXPECT_NEAR(cast(mesh, {5.013, 0, 2.011}, {0, 1, 0}), 17, wall_slack);
}

TEST(Tunnel, HasItsFacesWhereTheyAreSaidToBe) {
  const TriangleMesh mesh = mesh_of(made("tunnel", {{"edge-length", "0.2"}}));
  for (const double x : {-2.013, 2.013}) {
    const Eigen::Vector3d scanner(x, 0.017, 2.011);
    EXPECT_NEAR(cast(mesh, scanner, {1, 0, 0}), 44 - x, wall_slack);
    EXPECT_NEAR(cast(mesh, scanner, {-1, 0, 0}), 40 + x, wall_slack);
    EXPECT_NEAR(cast(mesh, scanner, {0, 1, 0}), 5, wall_slack);
    EXPECT_NEAR(cast(mesh, scanner, {0, -1, 0}), 5, wall_slack);
  }
  // The sixth light is above (1, 1), 0.3 m high and a little clear of the ceiling.
  EXPECT_NEAR(cast(mesh, {1.013, 1.017, 2}, {0, 0, 1}), 3.6, 0.15 + ceiling_slack);
}

}  // namespace
}  // namespace minescan
