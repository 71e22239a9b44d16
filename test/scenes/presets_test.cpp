// SPDX-License-Identifier: MIT
// The scenes that can be made by name.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/parallel.h"
#include "scenes/half_edge.h"
#include "scenes/scene.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

Scene made(const std::string& name, Settings settings, std::uint64_t seed = 1) {
  return find_scene(name).make(settings, seed);
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

const Settings flat = {{"wall-rms", "0"},     {"ceiling-rms", "0"},  {"floor-rms", "0"},
                       {"bedding-step", "0"}, {"fixtures", "false"}, {"corner-radius", "0"}};

Settings with(Settings settings, const std::string& name, const std::string& value) {
  settings[name] = value;
  return settings;
}

TEST(Scenes, AreClosedManifoldsInOnePiece) {
  for (const SceneKind& kind : scenes()) {
    for (const std::uint64_t seed : {1, 2}) {
      const Scene scene = kind.make({{"edge-length", "0.2"}}, seed);
      EXPECT_EQ(scene.name, kind.name);
      EXPECT_EQ(scene.mesh.material.size(), scene.mesh.triangles.size());
      const MeshCheck check = check_mesh(scene.mesh);
      EXPECT_TRUE(check.valid()) << kind.name;
      EXPECT_EQ(check.components, 1U) << kind.name;
      EXPECT_EQ(check.euler_characteristic, 2) << kind.name;   // no holes through pillars
      EXPECT_GT(measures(scene.mesh).volume, 0) << kind.name;  // normals point into the open space
    }
  }
}

TEST(Scenes, AreClosedManifoldsAtTheirDefaults) {
  const MeshCheck check = check_mesh(made("junction", {}).mesh);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 1U);
  EXPECT_GT(check.triangles, 1000000U);
}

TEST(Scenes, DependOnSeedAndSettingsOnly) {
  const Settings coarse = {{"edge-length", "0.2"}};
  for (const std::string name : {"junction", "tunnel"}) {
    TriangleMesh one;
    {
      const ThreadLimit limit(1);
      one = made(name, coarse, 7).mesh;
    }
    const ThreadLimit limit(4);
    EXPECT_TRUE(same_bytes(one, made(name, coarse, 7).mesh)) << name;
    EXPECT_FALSE(same_bytes(one, made(name, coarse, 8).mesh)) << name;
  }
}

TEST(Scenes, RefuseWrongSettings) {
  for (const SceneKind& kind : scenes()) {
    for (const std::string value : {"0", "-1", "1e9", "1e-9", "nan", "", "five"})
      EXPECT_THROW(kind.make({{"edge-length", value}}, 1), std::invalid_argument) << value;
    EXPECT_THROW(kind.make({{"edge-lenght", "0.1"}}, 1), std::invalid_argument);
  }
  EXPECT_THROW(made("junction", {{"wall-inner", "20"}}), std::invalid_argument);
  EXPECT_THROW(find_scene("tunel"), std::invalid_argument);
}

// Faces at lattice-independent places: contouring a flat face is exact. Each edge of the box loses
// less than a triangle of sides edge-length, corners less than that again.
TEST(Box, ConvergesToItsVolumeAndArea) {
  const double length = 12.3, width = 7.7, height = 5.1;
  for (const std::string edge_text : {"0.4", "0.2", "0.1", "0.05"}) {
    const double edge = std::stod(edge_text);
    const Measures m = measures(
        made("box",
             {{"edge-length", edge_text}, {"length", "12.3"}, {"width", "7.7"}, {"height", "5.1"}})
            .mesh);
    const double edges = 4 * (length + width + height);
    const double area = 2 * (length * width + width * height + height * length);
    const double volume = length * width * height;
    // Vertices stay 1 % of an edge away from lattice points: a face may move by that.
    const double face = 0.01 * edge;
    EXPECT_NEAR(m.volume, volume, edges * edge * edge / 2 + area * face) << "edge " << edge;
    EXPECT_NEAR(m.area, area, edges * edge + 2 * edges * face) << "edge " << edge;
  }
}

TEST(Tunnel, WithoutReliefHasFlatFaces) {
  const Scene scene = made("tunnel", with(flat, "edge-length", "0.2"));
  for (const Eigen::Vector3f& v : scene.mesh.vertices) {
    const double x = std::max(-40.0 - v.x(), v.x() - 44.0);
    const double y = std::abs(v.y()) - 5.0;
    const double z = std::max<double>(-v.z(), v.z() - 6.0);
    // Each vertex lies on one of the faces, off the others; 2e-6 m is half a step of a float at 44
    // m. Vertices that cut an edge or corner of the tunnel lie within.
    EXPECT_NEAR(std::max({x, y, z}), 0, 2e-6) << v.transpose();
  }
}

TEST(Tunnel, HasWallsOfTheStatedRms) {
  double sum = 0, squares = 0;
  long n = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const Scene scene = made("tunnel", {{"edge-length", "0.25"}, {"wall-rms", "0.07"}}, seed);
    for (const Eigen::Vector3f& v : scene.mesh.vertices) {
      // Away from roof, floor and ends, whose rounding reaches 0.4 m and relief.
      if (std::abs(v.y()) < 4 || v.z() < 1 || v.z() > 5 || std::abs(v.x() - 2) > 40) continue;
      const double height = std::abs(v.y()) - 5.0;
      sum += height;
      squares += height * height;
      ++n;
    }
  }
  // Each seed has 2 walls of 80 m, 19 cells of the longest octave each: with its share of the
  // variance, sqrt(2 / 228) / 2 = 5 % of the deviation; twice that. The mean of as many cells is
  // within 0.07 / sqrt(228) = 5 mm; three times that.
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(n)) / 0.07, 1, 0.1);
  EXPECT_NEAR(sum / static_cast<double>(n), 0, 0.015);
}

// The relief belongs to the world: a finer mesh shows the same mine.
TEST(Junction, IsTheSameMineForAnyEdgeLength) {
  const Measures coarse = measures(made("junction", {{"edge-length", "0.2"}}).mesh);
  const Measures fine = measures(made("junction", {{"edge-length", "0.1"}}).mesh);
  // What differs is the shortest octave, whose mean is zero, and chords across rounded corners.
  EXPECT_NEAR(coarse.volume / fine.volume, 1, 0.0005);
}

TEST(Junction, HasAFlatConcreteFaceAndItsOtherMaterials) {
  const Scene scene = made("junction", {{"edge-length", "0.1"}});
  const TriangleMesh& mesh = scene.mesh;
  ASSERT_EQ(mesh.materials.size(), 4U);
  EXPECT_EQ(mesh.materials[1].name, "concrete");
  EXPECT_EQ(mesh.materials[1].reflectance, 0.40);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.material[t] != 1) continue;
    for (const Eigen::Vector3d& p : corners(mesh, mesh.triangles[t])) {
      ASSERT_NEAR(p.x(), 12, 0.3) << "only at the end of the tunnel";
      // Off the rounding at its rim: 0.4 m and the relief of the neighbouring faces.
      const bool off_the_rim = std::abs(p.y()) < 4.2 && p.z() > 0.5 && p.z() < 5.4;
      if (off_the_rim) {
        ASSERT_NEAR(p.x(), 12, 1e-6);
      }
    }
  }
  const std::vector<double> area = areas(mesh);
  // Floor: the drifts' plan, 30 x 10 + 12 x 8 m; face 10 x 6 m; four lights of 1.5 x 0.3 x 0.3 m.
  // Rims are rounded by 0.4 m, part to each side; relief adds some per cent.
  EXPECT_NEAR(area[2], 396, 20);
  EXPECT_NEAR(area[1], 60, 8);
  EXPECT_NEAR(area[3], 4 * (1.5 * 0.3 + 2 * 1.8 * 0.3), 2);
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

TEST(Junction, HasItsFacesWhereTheyAreSaidToBe) {
  const TriangleMesh mesh = made("junction", {{"edge-length", "0.2"}}).mesh;
  const Eigen::Vector3d scanner(0.013, 0.017, 2.011);
  // Four RMS of relief, and the bedding.
  EXPECT_NEAR(cast(mesh, scanner, {1, 0, 0}), 12 - 0.013, 1e-5);
  EXPECT_NEAR(cast(mesh, scanner, {-1, 0, 0}), 18, 0.28);
  EXPECT_NEAR(cast(mesh, scanner, {0, -1, 0}), 5, 0.28);
  EXPECT_NEAR(cast(mesh, scanner, {0, 0, -1}), 2, 0.06);
  EXPECT_NEAR(cast(mesh, scanner, {0, 0, 1}), 4, 0.06 + 0.08);
  EXPECT_NEAR(cast(mesh, {5.013, 0, 2.011}, {0, 1, 0}), 17, 0.28);
}

TEST(Tunnel, HasItsFacesWhereTheyAreSaidToBe) {
  const TriangleMesh mesh = made("tunnel", {{"edge-length", "0.2"}}).mesh;
  for (const double x : {-2.013, 2.013}) {
    const Eigen::Vector3d scanner(x, 0.017, 2.011);
    EXPECT_NEAR(cast(mesh, scanner, {1, 0, 0}), 44 - x, 0.28);
    EXPECT_NEAR(cast(mesh, scanner, {-1, 0, 0}), 40 + x, 0.28);
    EXPECT_NEAR(cast(mesh, scanner, {0, 1, 0}), 5, 0.28);
    EXPECT_NEAR(cast(mesh, scanner, {0, -1, 0}), 5, 0.28);
  }
  // The sixth light is above (1, 1). 3.7 m is a multiple of half the edge length, where vertices
  // keep 1 % of an edge away from the lattice point.
  EXPECT_NEAR(cast(mesh, {1.013, 1.017, 2}, {0, 0, 1}), 3.7, 0.0021);
}

}  // namespace
}  // namespace minescan
