// SPDX-License-Identifier: MIT
// The meshes of exact scenes against the closed forms that scenes/exact.h states.
#include "scenes/exact.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "scenes/half_edge.h"
#include "scenes/scene.h"
#include "scenes/scene_mesh.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::array<double, 4> edge_lengths = {0.4, 0.2, 0.1, 0.05};

// Coordinates below 8 m are floats rounded by at most this.
constexpr double rounding = 2.4e-7;
// Vertices keep this part of an edge away from lattice points, see contour.
constexpr double margin = 1e-3;

/// A valid mesh in one piece and without handles.
void expect_valid(const TriangleMesh& mesh) {
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 1U);
  EXPECT_EQ(check.euler_characteristic, 2);
}

Measures measured(const Scene& scene) {
  const TriangleMesh mesh = mesh_of(scene);
  expect_valid(mesh);
  return measures(mesh);
}

Measures exact_measures(const BoxOptions& o) {
  return {.volume = o.length * o.width * o.height,
          .area = 2 * (o.length * o.width + o.width * o.height + o.height * o.length)};
}

Measures exact_measures(const CylinderOptions& o) {
  return {.volume = pi * o.radius * o.radius * o.length,
          .area = 2 * pi * o.radius * (o.radius + o.length)};
}

Measures exact_measures(const CorridorOptions& o) {
  const double middle = o.first_length + o.second_length;
  return {.volume = middle * o.width * o.height,
          .area = 2 * middle * o.width + 2 * (middle + o.width) * o.height};
}

Measures exact_measures(const IncisedPlanesOptions& o) {
  const double s = o.side, g = o.groove_length, w = o.groove_width, d = o.groove_depth;
  return {.volume = s * s * o.height + (2 * g - w) * w * d,
          .area = 2 * s * s + 4 * s * o.height + 4 * g * d};
}

// The stated formulas themselves, on sizes that are easy to do by hand.
TEST(Exact, ClosedFormsOfSmallWholeNumbers) {
  // An L of 3 x 1 and 1 x 2 squares: legs of 2.5 and 2.5 along their middles, 5 squares high 2.
  const Measures corridor = exact_measures(
      CorridorOptions{.first_length = 2.5, .second_length = 2.5, .width = 1, .height = 2});
  EXPECT_DOUBLE_EQ(corridor.volume, 10);
  EXPECT_DOUBLE_EQ(corridor.area, 2 * 5 + 12 * 2);  // the L's outline is 12 long
  // A cross of five unit squares, one deep, below a room of 10 x 10 x 2.
  const Measures incised = exact_measures(IncisedPlanesOptions{
      .side = 10, .height = 2, .groove_length = 3, .groove_width = 1, .groove_depth = 1});
  EXPECT_DOUBLE_EQ(incised.volume, 200 + 5);
  EXPECT_DOUBLE_EQ(incised.area, 200 + 80 + 12);  // the cross's outline is 12 long
}

// No face of these is near a lattice point, and sharp edges are kept: nothing is left but rounding
// to floats. A face that moves by it changes the volume by its area times it, and the area by its
// outline times it.
TEST(Exact, BoxesAreExactForAllEdgeLengths) {
  for (const double edge : edge_lengths) {
    const BoxOptions o{
        .mesh = {.edge_length = edge}, .length = 6.13, .width = 4.71, .height = 3.17};
    const Measures exact = exact_measures(o);
    const Measures m = measured(make_box(o, 1));
    EXPECT_NEAR(m.volume, exact.volume, rounding * exact.area) << "edge " << edge;
    EXPECT_NEAR(m.area, exact.area, rounding * 8 * (o.length + o.width + o.height))
        << "edge " << edge;
  }
}

// x = 3 m, y = 2.5 m and z = 3 m lie on lattice points for edges of 0.4 and 0.2 m.
TEST(Exact, BoxesWithFacesOnLatticePointsLackTheMarginAtMost) {
  for (const double edge : {0.4, 0.2}) {
    const BoxOptions o{.mesh = {.edge_length = edge}, .length = 6, .width = 5, .height = 3};
    const Measures exact = exact_measures(o);
    const Measures m = measured(make_box(o, 1));
    EXPECT_LT(m.volume, exact.volume) << "edge " << edge;
    EXPECT_NEAR(m.volume, exact.volume, margin * edge * exact.area) << "edge " << edge;
    EXPECT_NEAR(m.area, exact.area, margin * edge * 8 * (o.length + o.width + o.height))
        << "edge " << edge;
  }
}

TEST(Exact, CorridorsAreExactForAllEdgeLengths) {
  for (const double edge : edge_lengths) {
    const CorridorOptions o{.mesh = {.edge_length = edge},
                            .first_length = 5.33,
                            .second_length = 4.12,
                            .width = 2.34,
                            .height = 2.16};
    const Measures exact = exact_measures(o);
    const Measures m = measured(make_corridor(o, 1));
    EXPECT_NEAR(m.volume, exact.volume, rounding * exact.area) << "edge " << edge;
    // All outlines of floor, ceiling and walls.
    const double outline = 2 * (o.first_length + o.second_length + o.width);
    EXPECT_NEAR(m.area, exact.area, rounding * (4 * outline + 12 * o.height)) << "edge " << edge;
  }
}

// The grooves run across the lattice. Tips may lie in a neighbour of the cell that sees three
// faces: of 8 tips together less than a cell, as for turned boxes (contour_test); the grooves have
// 12 tips each at the floor and at their bottom. Few vertices are within the margin of a lattice
// point: 1e-6 of all.
TEST(Exact, IncisedPlanesAreExactButForTheTipsOfTheGrooves) {
  for (const double edge : edge_lengths) {
    const IncisedPlanesOptions o{.mesh = {.edge_length = edge},
                                 .side = 7.12,
                                 .height = 1.73,
                                 .groove_length = 4.3,
                                 .groove_width = 1.03,
                                 .groove_depth = 0.53};
    const Measures exact = exact_measures(o);
    const Measures m = measured(make_incised_planes(o, 1));
    const double cells = 24.0 / 8;
    EXPECT_NEAR(m.volume, exact.volume, 1e-6 * exact.volume + cells * std::pow(edge, 3))
        << "edge " << edge;
    EXPECT_NEAR(m.area, exact.area, 1e-6 * exact.area + cells * edge * edge) << "edge " << edge;
  }
}

/// Slope of a straight line through the logarithms of edge lengths and of errors.
double fitted_order(const std::array<double, 4>& errors) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, n = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double x = std::log(edge_lengths[i]), y = std::log(errors[i]);
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
    ++n;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// Area of the triangles that face along x.
double area_of_ends(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& triangle : mesh.triangles) {
    const auto [a, b, c] = corners(mesh, triangle);
    const Eigen::Vector3d twice = (b - a).cross(c - a);
    if (std::abs(twice.x()) > 0.5 * twice.norm()) area += twice.norm() / 2;
  }
  return area;
}

// Chords across the bend leave gaps of edge^2 / (4 R) and linear interpolation adds edge^2 / (8 R)
// (see contour_test): that times the wall bounds the errors, 2 / R of the volume per metre. The
// section is the same all along, so how the lattice lies about it moves an error by as much as
// itself; the mean over several radii does not have that.
TEST(Exact, CylindersConvergeWithOrderTwo) {
  std::array<double, 4> volume_errors = {}, end_errors = {}, wall_errors = {};
  const int radii = 8;
  for (std::size_t i = 0; i < edge_lengths.size(); ++i) {
    const double edge = edge_lengths[i];
    for (int k = 0; k < radii; ++k) {
      const CylinderOptions o{
          .mesh = {.edge_length = edge}, .length = 1.14, .radius = 2.5 + 0.0437 * k};
      const TriangleMesh mesh = mesh_of(make_cylinder(o, 1));
      expect_valid(mesh);
      const Measures exact = exact_measures(o);
      const Measures m = measures(mesh);
      const double gap = edge * edge * 3 / 8 / o.radius;
      EXPECT_LT(m.volume, exact.volume) << "edge " << edge << " radius " << o.radius;  // inscribed
      EXPECT_NEAR(m.volume / exact.volume, 1, 2 * gap / o.radius)
          << "edge " << edge << " radius " << o.radius;
      EXPECT_NEAR(m.area / exact.area, 1, 2 * gap / o.radius)
          << "edge " << edge << " radius " << o.radius;
      // Rims lie on tangents of the wall: ends are too large, and the last strip of the wall is
      // tilted. A cylinder that is longer by a whole number of edges to both sides has the same
      // rims: the rest of it is wall only.
      end_errors[i] += (area_of_ends(mesh) / (2 * pi * o.radius * o.radius) - 1) / radii;
      CylinderOptions longer = o;
      longer.length += 1.6;
      const Measures longer_exact = exact_measures(longer);
      const Measures longer_m = measured(make_cylinder(longer, 1));
      volume_errors[i] +=
          (1 - (longer_m.volume - m.volume) / (longer_exact.volume - exact.volume)) / radii;
      wall_errors[i] += (1 - (longer_m.area - m.area) / (longer_exact.area - exact.area)) / radii;
    }
  }
  EXPECT_NEAR(fitted_order(volume_errors), 2, 0.2);
  EXPECT_NEAR(fitted_order(end_errors), 2, 0.2);
  EXPECT_NEAR(fitted_order(wall_errors), 2, 0.2);
}

TEST(Exact, RefusesSizesThatDoNotFit) {
  // A leg that ends within the other one.
  EXPECT_THROW(make_corridor({.first_length = 1.5, .width = 3}, 1), std::invalid_argument);
  EXPECT_THROW(make_corridor({.second_length = 1.2, .width = 3}, 1), std::invalid_argument);
  EXPECT_NO_THROW(make_corridor({.second_length = 1.51, .width = 3}, 1));
  // Corners of grooves beyond the walls: (8 + 0.4) / 2 / sqrt(2) = 2.97 m from the middle.
  EXPECT_THROW(make_incised_planes({.side = 5.93}, 1), std::invalid_argument);
  EXPECT_NO_THROW(make_incised_planes({.side = 5.95}, 1));
  // Wider than long.
  EXPECT_THROW(make_incised_planes({.groove_length = 1, .groove_width = 1}, 1),
               std::invalid_argument);
  try {
    make_corridor({.first_length = 1.2, .width = 3}, 1);
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("1.2"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("1.5"), std::string::npos) << e.what();
  }
  // By name, the ranges of the options too.
  for (const Settings& wrong :
       {Settings{{"length", "0"}}, Settings{{"height", "nan"}}, Settings{{"lenght", "5"}}})
    EXPECT_THROW(find_scene("box").make(wrong, 1), std::invalid_argument);
  EXPECT_THROW(find_scene("cylinder").make({{"radius", "-1"}}, 1), std::invalid_argument);
  EXPECT_THROW(find_scene("corridor").make({{"first-length", "1.2"}}, 1), std::invalid_argument);
  EXPECT_THROW(find_scene("incised-planes").make({{"groove-length", "50"}}, 1),
               std::invalid_argument);
}

}  // namespace
}  // namespace minescan
