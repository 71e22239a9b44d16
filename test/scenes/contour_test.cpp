// SPDX-License-Identifier: MIT
#include "scenes/contour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "core/parallel.h"
#include "core/random.h"
#include "scenes/half_edge.h"
#include "scenes/mine.h"
#include "scenes/self_intersection.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;

/// Open inside a sphere about `centre`.
ImplicitSurface sphere(const Eigen::Vector3d& centre, double radius) {
  ImplicitSurface s;
  s.at = [=](const Eigen::Vector3d& p) {
    return ImplicitSurface::Sample{.value = (p - centre).norm() - radius};
  };
  s.range = [=](const Eigen::Vector3d& p, double r) {
    const double d = (p - centre).norm() - radius;
    return Interval{d - r, d + r};
  };
  s.bounds.extend(centre - Eigen::Vector3d::Constant(radius));
  s.bounds.extend(centre + Eigen::Vector3d::Constant(radius));
  s.area = 4 * pi * radius * radius;
  s.materials = {{}};
  return s;
}

/// Distance to a half-space and the number of the face that bounds it.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // out of the open space
  double offset = 0;
  std::uint8_t face = 0;
};

/// Open inside all half-spaces.
ImplicitSurface polytope(const std::vector<Plane>& planes, double reach) {
  ImplicitSurface s;
  s.at = [=](const Eigen::Vector3d& p) {
    ImplicitSurface::Sample sample{.value = -1e9};
    for (const Plane& plane : planes) {
      const double value = plane.normal.dot(p) - plane.offset;
      if (value > sample.value) sample = {value, plane.face, plane.face};
    }
    return sample;
  };
  s.range = [at = s.at](const Eigen::Vector3d& p, double r) {
    const double value = at(p).value;
    return Interval{value - r, value + r};
  };
  s.bounds.extend(Eigen::Vector3d::Constant(-reach).eval());
  s.bounds.extend(Eigen::Vector3d::Constant(reach).eval());
  s.area = 24 * reach * reach;
  s.materials.resize(7);
  return s;
}

/// A box about `centre` with sides 2 half along the columns of `axes`; faces 1 ... 6, each of its
/// own material.
ImplicitSurface box(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes,
                    const Eigen::Vector3d& half) {
  std::vector<Plane> planes;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Vector3d normal = sign * axes.col(axis);
      planes.push_back(
          {normal, normal.dot(centre) + half[axis], static_cast<std::uint8_t>(planes.size() + 1)});
    }
  return polytope(planes, centre.norm() + half.norm());
}

Eigen::Matrix3d turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/// A cylinder about the z axis between z = -half and half, its rims sharp.
ImplicitSurface cylinder(double radius, double half) {
  ImplicitSurface s = sphere({0, 0, 0}, std::hypot(radius, half));
  s.at = [=](const Eigen::Vector3d& p) {
    const double wall = p.head<2>().norm() - radius;
    const double end = std::abs(p.z()) - half;
    if (wall > end) return ImplicitSurface::Sample{wall, 0, 1};
    return ImplicitSurface::Sample{end, 0, static_cast<std::uint8_t>(p.z() > 0 ? 2 : 3)};
  };
  s.range = [at = s.at](const Eigen::Vector3d& p, double r) {
    const double value = at(p).value;
    return Interval{value - r, value + r};
  };
  return s;
}

/// The same surface elsewhere. Of distances, ranges are within the radius.
ImplicitSurface turned(const ImplicitSurface& surface, const Eigen::Matrix3d& rotation) {
  ImplicitSurface s = surface;
  s.at = [at = surface.at, rotation](const Eigen::Vector3d& p) {
    return at(rotation.transpose() * p);
  };
  s.range = [at = s.at](const Eigen::Vector3d& p, double r) {
    const double value = at(p).value;
    return Interval{value - r, value + r};
  };
  const double reach = surface.bounds.max().norm();
  s.bounds = {Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach)};
  return s;
}

Eigen::Matrix3d random_rotation(std::uint64_t seed) {
  Random random(seed, 0);
  Eigen::Quaterniond q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = random.normal();
  return q.normalized().toRotationMatrix();
}

/// Two spheres cut each other in an acute edge.
ImplicitSurface lens() {
  ImplicitSurface s = sphere({0, 0, 0}, 1.2);
  s.at = [](const Eigen::Vector3d& p) {
    const double a = (p - Eigen::Vector3d(0, 0, 1.7)).norm() - 2;
    const double b = (p + Eigen::Vector3d(0, 0, 1.7)).norm() - 2;
    return a > b ? ImplicitSurface::Sample{a, 0, 0} : ImplicitSurface::Sample{b, 0, 1};
  };
  return s;
}

/// Open around a surface, with rock beyond a sphere.
ImplicitSurface outside(const ImplicitSurface& surface) {
  ImplicitSurface s = turned(surface, Eigen::Matrix3d::Identity());
  s.at = [at = surface.at](const Eigen::Vector3d& p) {
    ImplicitSurface::Sample sample = at(p);
    const double beyond = p.norm() - 1.8;
    if (beyond > -sample.value) return ImplicitSurface::Sample{beyond, 0, 2};
    sample.value = -sample.value;
    return sample;
  };
  s.range = [at = s.at](const Eigen::Vector3d& p, double r) {
    const double value = at(p).value;
    return Interval{value - r, value + r};
  };
  return s;
}

/// Walls, floor and ceiling with waves and rounded edges (face 0), and a flat end at x = 1.03.
ImplicitSurface rough_room() {
  ImplicitSurface s = sphere({0, 0, 0}, 2);
  s.at = [](const Eigen::Vector3d& p) {
    const double wave =
        0.04 * std::sin(9 * p.x()) * std::sin(8 * p.y() + 1) * std::sin(7 * p.z() + 2);
    const Eigen::Vector3d q = (p.cwiseAbs() - Eigen::Vector3d::Constant(0.7)).cwiseMax(0);
    const double rough = std::max(q.norm() - 0.3, -0.3) + wave;
    const double flat = std::abs(p.x() - 0.8) < 0.5 ? p.x() - 0.83 : -1;
    if (flat > rough) return ImplicitSurface::Sample{flat, 1, 1};
    return ImplicitSurface::Sample{rough, 0, 0};
  };
  s.range = [](const Eigen::Vector3d&, double) { return Interval{-1, 1}; };
  s.materials.resize(2);
  return s;
}

Measures box_measures(const Eigen::Vector3d& half) {
  return {8 * half.prod(), 8 * (half.x() * half.y() + half.y() * half.z() + half.z() * half.x())};
}

void expect_valid(const TriangleMesh& mesh) {
  const MeshCheck check = check_mesh(mesh);
  EXPECT_EQ(check.boundary_edges, 0U);
  EXPECT_EQ(check.refused_triangles, 0U);
  EXPECT_EQ(check.non_manifold_vertices, 0U);
  EXPECT_EQ(check.degenerate_triangles, 0U);
  EXPECT_EQ(check.unused_vertices, 0U);
  EXPECT_EQ(check.self_intersections, 0U);
}

/// Places of the corners, in an order that does not depend on indices.
using Places = std::array<std::array<float, 3>, 3>;
std::vector<Places> places(const TriangleMesh& mesh) {
  std::vector<Places> list;
  for (const auto& triangle : mesh.triangles) {
    Places p;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3f& v = mesh.vertices[triangle[i]];
      p[i] = {v.x(), v.y(), v.z()};
    }
    std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());
    list.push_back(p);
  }
  std::sort(list.begin(), list.end());
  return list;
}

/// Signs without any order, with rock around.
ImplicitSurface random_signs(std::uint64_t seed, double size) {
  ImplicitSurface s;
  s.at = [=](const Eigen::Vector3d& p) {
    if (p.minCoeff() < 0 || p.maxCoeff() > size) return ImplicitSurface::Sample{.value = 1};
    const auto cell = [&](int axis) { return static_cast<std::uint64_t>(p[axis] * 64); };
    Random random(seed, (cell(0) << 40) + (cell(1) << 20) + cell(2));
    return ImplicitSurface::Sample{.value = random.uniform() - 0.5};
  };
  s.range = [](const Eigen::Vector3d&, double) { return Interval{-1, 1}; };
  s.bounds.extend(Eigen::Vector3d::Zero().eval());
  s.bounds.extend(Eigen::Vector3d::Constant(size).eval());
  s.materials = {{}};
  return s;
}

bool crossed(int open_corners, int edge) {
  const CubeEdge ends = cube_edge_ends()[edge];
  return (open_corners >> ends.from & 1) != (open_corners >> ends.to & 1);
}

Eigen::Vector3d middle(int edge) {
  const auto corner = [](int c) { return Eigen::Vector3d(c & 1, c >> 1 & 1, c >> 2 & 1); };
  const CubeEdge ends = cube_edge_ends()[edge];
  return (corner(ends.from) + corner(ends.to)) / 2;
}

/// Whether the middles of two edges lie in one face of the cube.
bool in_one_face(int a, int b) {
  const Eigen::Vector3d p = middle(a), q = middle(b);
  for (int axis = 0; axis < 3; ++axis)
    if (p[axis] == q[axis] && p[axis] != 0.5) return true;
  return false;
}

TEST(MarchingCases, UseAllCrossedEdgesAndNoOthers) {
  for (int open = 0; open < 256; ++open) {
    std::set<int> expected;
    for (int e = 0; e < cube_edges; ++e)
      if (crossed(open, e)) expected.insert(e);
    std::set<int> used;
    for (const auto& triangle : marching_cases()[open])
      used.insert(triangle.begin(), triangle.end());
    EXPECT_EQ(used, expected) << "case " << open;
  }
}

// The two conditions under which cubes join to a closed 2-manifold: the border of a case lies in
// the faces of the cube, and everything else inside.
TEST(MarchingCases, HaveTheirBorderInFacesAndTheirDiagonalsInside) {
  for (int open = 0; open < 256; ++open) {
    std::map<std::pair<int, int>, int> sides;
    for (const auto& t : marching_cases()[open])
      for (int i = 0; i < 3; ++i) ++sides[{t[i], t[(i + 1) % 3]}];
    for (const auto& [side, count] : sides) {
      EXPECT_EQ(count, 1) << "case " << open;
      const bool inside = sides.contains({side.second, side.first});
      EXPECT_NE(inside, in_one_face(side.first, side.second)) << "case " << open;
    }
  }
}

TEST(MarchingCases, HaveNormalsThatPointToTheOpenCorner) {
  for (int corner = 0; corner < cube_corners; ++corner) {
    const auto& triangles = marching_cases()[1 << corner];
    ASSERT_EQ(triangles.size(), 1U);
    const Eigen::Vector3d a = middle(triangles[0][0]);
    const Eigen::Vector3d normal = (middle(triangles[0][1]) - a).cross(middle(triangles[0][2]) - a);
    const Eigen::Vector3d place(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    EXPECT_GT(normal.dot(place - a), 0) << "corner " << corner;
  }
}

// Crossings anywhere on their edges, many near the ends.
TEST(MarchingCases, DoNotCrossThemselves) {
  Random random(1, 0);
  for (int open = 0; open < 256; ++open)
    for (int i = 0; i < 100; ++i) {
      TriangleMesh mesh;
      for (int e = 0; e < cube_edges; ++e) {
        const int from = cube_edge_ends()[e].from;
        Eigen::Vector3f place(static_cast<float>(from & 1), static_cast<float>(from >> 1 & 1),
                              static_cast<float>(from >> 2 & 1));
        const double near = std::exp(-7 * random.uniform());
        place[e / 4] = static_cast<float>(random.uniform() < 0.5 ? near : 1 - near);
        mesh.vertices.push_back(place);
      }
      for (const auto& t : marching_cases()[open]) mesh.triangles.push_back({t[0], t[1], t[2]});
      EXPECT_EQ(count_self_intersections(mesh), 0U) << "case " << open;
    }
}

// A loop runs from face to face of the cube, and the triangles of a case fill its loops.
TEST(MarchingLoops, RunThroughFacesAndBoundTheTriangles) {
  for (int open = 0; open < 256; ++open) {
    std::set<std::pair<int, int>> border;
    std::size_t triangles = 0;
    for (const auto& loop : marching_loops()[open]) {
      EXPECT_GE(loop.size(), 3U);
      triangles += loop.size() - 2;
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const int next = loop[(i + 1) % loop.size()];
        EXPECT_TRUE(crossed(open, loop[i])) << "case " << open;
        EXPECT_TRUE(in_one_face(loop[i], next)) << "case " << open;
        EXPECT_TRUE(border.emplace(loop[i], next).second) << "case " << open;
      }
    }
    EXPECT_EQ(marching_cases()[open].size(), triangles);
    std::set<std::pair<int, int>> sides;
    for (const auto& t : marching_cases()[open])
      for (int i = 0; i < 3; ++i) sides.emplace(t[i], t[(i + 1) % 3]);
    std::erase_if(sides, [](const auto& s) { return !in_one_face(s.first, s.second); });
    EXPECT_EQ(sides, border) << "case " << open;
  }
}

TEST(Contour, MakesValidMeshesOfAnySigns) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    // 40 points a side: all 256 cases, and several blocks.
    const TriangleMesh mesh = contour(random_signs(seed, 2.0), 0.05);
    EXPECT_GT(mesh.triangles.size(), 100000U);
    expect_valid(mesh);
  }
}

// Vertices inside of cells and in faces, and joined cells everywhere, across blocks too.
TEST(Contour, MakesValidMeshesOfAnySignsAndFaces) {
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    ImplicitSurface surface = random_signs(seed, 2.0);
    surface.at = [at = surface.at, seed](const Eigen::Vector3d& p) {
      ImplicitSurface::Sample sample = at(p);
      sample.face = static_cast<std::uint8_t>(3 * (sample.value + 0.5));
      // Few crossings near the middles of edges.
      if (seed == 1)
        sample.value = std::copysign(std::exp(-20 * std::abs(sample.value)), sample.value);
      return sample;
    };
    const TriangleMesh mesh = contour(surface, 0.05);
    EXPECT_GT(mesh.triangles.size(), 100000U);
    expect_valid(mesh);
  }
}

TEST(Contour, PutsVerticesOnTheSphere) {
  const Eigen::Vector3d centre(0.3, -0.2, 0.7);
  const double edge = 0.1;
  const TriangleMesh mesh = contour(sphere(centre, 2), edge);
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 1U);
  EXPECT_EQ(check.euler_characteristic, 2);
  for (const Eigen::Vector3f& v : mesh.vertices)
    // Linear interpolation of a distance with curvature 1 / R errs by edge^2 / (8 R); the margin at
    // the ends of an edge by 1 % of it.
    ASSERT_NEAR((v.cast<double>() - centre).norm(), 2, edge * edge / 16 + 0.01 * edge);
}

TEST(Contour, ConvergesToVolumeAndAreaOfTheSphere) {
  const double radius = 2;
  const double volume = 4.0 / 3 * pi * std::pow(radius, 3);
  const double area = 4 * pi * radius * radius;
  for (const double edge : {0.2, 0.1, 0.05}) {
    const Measures m = measures(contour(sphere({0.3, -0.2, 0.7}, radius), edge));
    // A chord of length c leaves a gap of c^2 / (8 R); no side of a triangle is longer than sqrt(3)
    // edges. The gap times the area bounds the volume; its share of the radius, twice, the area.
    const double gap = 3 * edge * edge / (8 * radius) + edge * edge / (8 * radius);
    EXPECT_LT(m.volume, volume);
    EXPECT_NEAR(m.volume, volume, gap * area) << "edge " << edge;
    EXPECT_NEAR(m.area, area, 2 * gap / radius * area) << "edge " << edge;
  }
}

// Faces are between lattice points here: nothing but rounding to floats, 6e-8 of about a metre, in
// each of three directions.
TEST(Contour, IsExactForBoxes) {
  const Eigen::Vector3d half(1.037, 0.729, 0.523);
  const Measures exact = box_measures(half);
  for (const double edge : {0.2, 0.1, 0.05}) {
    const TriangleMesh mesh =
        contour(box({0.023, 0.017, 0.008}, Eigen::Matrix3d::Identity(), half), edge);
    expect_valid(mesh);
    const Measures m = measures(mesh);
    EXPECT_NEAR(m.volume / exact.volume, 1, 5e-7) << "edge " << edge;
    EXPECT_NEAR(m.area / exact.area, 1, 5e-7) << "edge " << edge;
  }
}

// Vertices keep 1e-3 of an edge away from lattice points, and faces at lattice points move by that.
TEST(Contour, MovesFacesAtLatticePointsByThousandthsOfAnEdge) {
  const double edge = 0.1;
  const Eigen::Vector3d half(0.95, 0.75, 0.55);
  const TriangleMesh mesh =
      contour(box(Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity(), half), edge);
  expect_valid(mesh);
  const Eigen::Vector3d smallest = half - Eigen::Vector3d::Constant(1.01e-3 * edge);
  const Measures m = measures(mesh);
  EXPECT_LE(m.volume, box_measures(half).volume);
  EXPECT_GE(m.volume, box_measures(smallest).volume);
}

// In general position the sharp edges are as exact, across the cells that they cut in odd ways too.
// What is left is at tips: where a cell sees three faces and the tip is in another one that it
// cannot join, a corner is missing: of 8 tips together less than a cell, and two of its faces.
TEST(Contour, IsExactForTurnedBoxesButForTheirTips) {
  const Eigen::Vector3d half(1.037, 0.729, 0.523);
  const Measures exact = box_measures(half);
  for (const double angle : {0.1, 0.5, 0.785, 1.3})
    for (const double edge : {0.2, 0.1, 0.05}) {
      const TriangleMesh mesh =
          contour(box({0.013, 0.021, 0.008}, turned(angle, {1, 2, 3}), half), edge);
      expect_valid(mesh);
      const Measures m = measures(mesh);
      // The margin at lattice points, near which few vertices are: 1e-6.
      EXPECT_NEAR(m.volume, exact.volume, 1e-6 * exact.volume + std::pow(edge, 3))
          << "angle " << angle << " edge " << edge;
      EXPECT_NEAR(m.area, exact.area, 1e-6 * exact.area + 2 * edge * edge)
          << "angle " << angle << " edge " << edge;
    }
}

// Sharp edges in any direction, and acute ones: plates of which the lattice sees one side here and
// the other there.
TEST(Contour, MakesValidMeshesOfSharpEdgesInAnyDirection) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Eigen::Matrix3d rotation = random_rotation(seed);
    const double edge = 0.1;
    const Eigen::Vector3d half(1.037, 0.729, 0.523);
    const TriangleMesh turned_box = contour(box({0.013, 0.021, 0.008}, rotation, half), edge);
    expect_valid(turned_box);
    // Twice what the worst of 250 rotations missed.
    EXPECT_NEAR(measures(turned_box).volume, box_measures(half).volume, 2 * std::pow(edge, 3));
    expect_valid(contour(box({0, 0, 0}, rotation, {0.9, 0.6, 0.06}), edge));
    expect_valid(contour(turned(cylinder(1.013, 0.737), rotation), edge));
    expect_valid(contour(turned(lens(), rotation), edge));
    // Rock that reaches into the open space.
    expect_valid(contour(outside(turned(lens(), rotation)), edge));
  }
}

/// The end of a drift: a flat concrete face against rough rock.
TEST(Contour, MakesValidMeshesOfRoughWallsAgainstFlatFaces) {
  Mine mine;
  mine.drifts["main"] = {.line = {{-6, 0, 0}, {6, 0.7, 0}},
                         .width = 4,
                         .height = 3,
                         .start = End::concrete,
                         .end = End::concrete};
  for (const double edge : {0.3, 0.2, 0.1})
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
      expect_valid(contour(surface_of(mine, seed, edge), edge));
}

TEST(Contour, GivesEachSideOfASharpEdgeItsMaterial) {
  const Eigen::Vector3d half(1.037, 0.729, 0.523);
  const Eigen::Vector3d centre(0.023, 0.017, 0.008);
  const TriangleMesh mesh = contour(box(centre, Eigen::Matrix3d::Identity(), half), 0.1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = corners(mesh, mesh.triangles[t]);
    const Eigen::Vector3d place = ((a + b + c) / 3 - centre).cwiseQuotient(half);
    Eigen::Index axis = 0;
    ASSERT_NEAR(place.cwiseAbs().maxCoeff(&axis), 1, 1e-6);
    EXPECT_EQ(mesh.material[t], 2 * axis + (place[axis] > 0 ? 2 : 1));
  }
}

TEST(Contour, ConvergesWithOrderTwoForSharpRims) {
  const double radius = 1.013, half = 0.737;
  const double volume = 2 * pi * radius * radius * half;
  const double area = 2 * pi * radius * (2 * half + radius);
  for (const double edge : {0.2, 0.1, 0.05, 0.025}) {
    const TriangleMesh mesh = contour(cylinder(radius, half), edge);
    expect_valid(mesh);
    const Measures m = measures(mesh);
    // Chords up to sqrt(2) edges across the bend leave gaps of edge^2 / (4 R), and linear
    // interpolation one of edge^2 / (8 R): that times the wall, 2 / R of the volume per metre.
    const double gap = edge * edge * 3 / 8 / radius;
    EXPECT_NEAR(m.volume / volume, 1, 2 * gap / radius) << "edge " << edge;
    EXPECT_NEAR(m.area / area, 1, 2 * gap / radius) << "edge " << edge;
  }
}

// The flat end stays flat and the rough walls are those of plain marching cubes.
TEST(Contour, KeepsRoughFacesAsTheyAre) {
  const double edge = 0.05;
  ImplicitSurface surface = rough_room();
  const TriangleMesh sharp = contour(surface, edge);
  expect_valid(sharp);
  for (std::size_t t = 0; t < sharp.triangles.size(); ++t)
    if (sharp.material[t] == 1) {
      for (const Eigen::Vector3d& p : corners(sharp, sharp.triangles[t]))
        EXPECT_NEAR(p.x(), 0.83, 1e-6);  // a float's rounding
    }
  surface.at = [at = surface.at](const Eigen::Vector3d& p) {
    ImplicitSurface::Sample sample = at(p);
    sample.face = 0;
    return sample;
  };
  const TriangleMesh plain = contour(surface, edge);
  const auto away = [&](const TriangleMesh& mesh) {
    std::vector<Places> list = places(mesh);
    std::erase_if(list, [&](const Places& p) {
      return std::max({p[0][0], p[1][0], p[2][0]}) > 0.83F - 3 * static_cast<float>(edge);
    });
    return list;
  };
  EXPECT_GT(away(plain).size(), 1000U);
  EXPECT_EQ(away(sharp), away(plain));
}

// A mine may be far larger than its open space; empty space must not cost.
TEST(Contour, CostsNothingForEmptySpace) {
  ImplicitSurface surface = sphere({0.3, -0.2, 0.7}, 2);
  std::atomic<int> calls = 0;
  surface.range = [range = surface.range, &calls](const Eigen::Vector3d& p, double r) {
    ++calls;
    return range(p, r);
  };
  const TriangleMesh mesh = contour(surface, 0.05);
  const int near = calls.exchange(0);
  surface.bounds.extend(Eigen::Vector3d::Constant(-1000).eval());
  surface.bounds.extend(Eigen::Vector3d::Constant(1000).eval());
  EXPECT_TRUE(same_bytes(mesh, contour(surface, 0.05)));
  // Cubes of 2 km are halved down to blocks of 1.6 m: 10 times, about 8 of them asked.
  EXPECT_LE(calls, near + 10 * 8 * 8);
}

TEST(Contour, GivesTheSameBytesForAnyNumberOfThreads) {
  const ImplicitSurface surface = random_signs(7, 2.0);
  TriangleMesh one;
  {
    const ThreadLimit limit(1);
    one = contour(surface, 0.05);
  }
  const ThreadLimit limit(4);
  EXPECT_TRUE(same_bytes(one, contour(surface, 0.05)));
}

// Whoever asks for ranges must not see more or fewer triangles than whoever looks everywhere.
TEST(Contour, DoesNotDependOnHowNarrowRangesAre) {
  ImplicitSurface surface = sphere({0, 0, 0}, 1);
  const TriangleMesh narrow = contour(surface, 0.05);
  surface.range = [](const Eigen::Vector3d&, double) { return Interval{-1, 1}; };
  const TriangleMesh wide = contour(surface, 0.05);
  EXPECT_TRUE(same_bytes(narrow, wide));
}

TEST(Contour, EstimatesItsMemory) {
  const ImplicitSurface surface = sphere({0, 0, 0}, 3);
  const TriangleMesh mesh = contour(surface, 0.05);
  const double bytes = static_cast<double>(
      mesh.vertices.size() * sizeof(Eigen::Vector3f) +
      mesh.triangles.size() * (sizeof(std::array<std::uint32_t, 3>) + sizeof(std::uint8_t)));
  // Twice the mesh: its pieces and the whole. A sphere has 1.5 vertices per square, a mine 1.25.
  EXPECT_NEAR(contour_bytes(surface, 0.05) / (2 * bytes), 1.25 / 1.5, 0.1);
}

TEST(Contour, RefusesEdgesThatAreNoLengthsOrNeedTooMuchMemory) {
  const ImplicitSurface surface = sphere({0, 0, 0}, 100);
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const double edge : {0.0, -1.0, inf, std::nan("")})
    EXPECT_THROW(contour(surface, edge), std::invalid_argument) << edge;
  for (const double edge : {0.01, 1e-9, 1e-300}) {
    try {
      contour(surface, edge);
      FAIL() << "expected an exception for edge length " << edge;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find("GiB"), std::string::npos) << e.what();
    }
  }
}

/// Rooms along a drift of 75 m, several tiles, the axis oblique to the lattice.
ImplicitSurface long_room() {
  ImplicitSurface s = box({3, 1, 1}, turned(0.3, {0, 0, 1}), {37.3, 2.2, 1.4});
  s.at = [at = s.at](const Eigen::Vector3d& p) {
    ImplicitSurface::Sample sample = at(p);
    sample.value += 0.1 * std::sin(3 * p.x()) * std::sin(2 * p.y()) * std::sin(2 * p.z());
    return sample;
  };
  s.range = [at = s.at](const Eigen::Vector3d& p, double r) {
    const double value = at(p).value;
    return Interval{value - 2 * r, value + 2 * r};
  };
  s.bounds = {Eigen::Vector3d(-36, -14, -1), Eigen::Vector3d(42, 16, 3)};
  return s;
}

constexpr double tile_edge = 0.2;

std::vector<Tile> all_tiles(const SurfaceTiles& tiles) {
  return tiles.within(tiles.tile_of({0, 0, 0}), 1000);
}

TEST(SurfaceTiles, AreSquaresOfBlocksFixedInTheWorld) {
  for (const double edge : {0.05, 0.1, 0.2, 0.3, 2.0}) {
    const SurfaceTiles tiles(long_room(), edge, 0);
    const double blocks = tiles.tile_size() / (32 * edge);
    EXPECT_NEAR(blocks, std::round(blocks), 1e-9);
    if (blocks > 1.5) {
      EXPECT_NEAR(tiles.tile_size(), 25.6, 16 * edge);
    }
    for (const double x : {-40.0, -0.01, 0.01, 33.0}) {
      const Eigen::Vector3d place(x, 7, 1);
      EXPECT_TRUE(tiles.box_of(tiles.tile_of(place)).contains(place));
    }
  }
  const SurfaceTiles tiles(long_room(), tile_edge, 0);
  const Eigen::AlignedBox3d a = tiles.box_of({0, 0}), b = tiles.box_of({1, 0});
  EXPECT_EQ(a.max().x(), b.min().x());
  EXPECT_EQ(a.min().z(), -1);
  EXPECT_EQ(a.max().z(), 3);
}

TEST(SurfaceTiles, KnowTheirNeighbours) {
  const SurfaceTiles tiles(long_room(), tile_edge, 0);
  const std::vector<Tile> expected = {{-1, -1}, {-1, 0}, {0, -1}, {0, 0}, {1, -1}, {1, 0}};
  // The bounds reach 14 m to one side and 16 m to the other: two rows of tiles.
  EXPECT_EQ(tiles.within({0, 0}, 0), expected);
  EXPECT_EQ(tiles.within({0, 0}, tiles.tile_size() * 0.99), expected);
  EXPECT_EQ(tiles.within({0, 0}, tiles.tile_size() * 1.01).size(), 8U);  // two more to the left
  EXPECT_EQ(tiles.within({1, 0}, 0).size(), 4U);
  EXPECT_TRUE(tiles.within({0, 7}, 10).empty());
  EXPECT_THROW(tiles.within({0, 0}, -1), std::invalid_argument);
  EXPECT_THROW(tiles.within({0, 0}, std::nan("")), std::invalid_argument);
}

TEST(SurfaceTiles, AreTheWholeTogether) {
  SurfaceTiles tiles(long_room(), tile_edge, 0);
  const TriangleMesh whole = contour(long_room(), tile_edge);
  expect_valid(whole);
  EXPECT_TRUE(same_bytes(whole, tiles.mesh(all_tiles(tiles))));
  std::vector<Places> pieces;
  for (const Tile& tile : all_tiles(tiles)) {
    const TriangleMesh mesh = tiles.mesh(std::vector{tile});
    EXPECT_EQ(check_mesh(mesh).unused_vertices, 0U);
    EXPECT_EQ(check_mesh(mesh).refused_triangles, 0U);
    const std::vector<Places> some = places(mesh);
    pieces.insert(pieces.end(), some.begin(), some.end());
  }
  std::sort(pieces.begin(), pieces.end());
  // Byte for byte: the same numbers.
  EXPECT_EQ(pieces, places(whole));
}

TEST(SurfaceTiles, DoNotDependOnWhatWasAskedBeforeNorOnTheCache) {
  const double large = 1e9;
  for (const double cache : {0.0, 3e5, large}) {
    SurfaceTiles tiles(long_room(), tile_edge, cache);
    const std::vector<Tile> all = all_tiles(tiles);
    std::vector<std::size_t> order(30);
    Random random(5, 0);
    for (std::size_t& i : order) i = random.bits() % all.size();
    for (const std::size_t i : order) {
      const std::vector<Tile> asked = {all[i], all[(i + 1) % all.size()], all[i]};
      SurfaceTiles fresh(long_room(), tile_edge, 0);
      ASSERT_TRUE(same_bytes(tiles.mesh(asked), fresh.mesh(std::vector{asked[1], asked[0]})));
      ASSERT_LE(tiles.bytes_kept(), cache);
    }
    if (cache == 0) {
      EXPECT_EQ(tiles.tiles_made(), 2 * order.size());
    } else if (cache == large) {
      EXPECT_LE(tiles.tiles_made(), all.size());
      EXPECT_GT(tiles.bytes_kept(), 0);
    } else {
      EXPECT_GT(tiles.tiles_made(), all.size());        // some were dropped
      EXPECT_LT(tiles.tiles_made(), 2 * order.size());  // and some not
    }
  }
}

TEST(SurfaceTiles, KeepWhatWasAskedLast) {
  const Tile a = {0, 0}, b = {-1, 0}, c = {-1, -1}, d = {0, -1};
  double largest = 0;
  for (const Tile& tile : {a, b, c, d}) {
    SurfaceTiles one(long_room(), tile_edge, 1e9);
    one.mesh(std::vector{tile});
    largest = std::max(largest, one.bytes_kept());
  }
  SurfaceTiles tiles(long_room(), tile_edge, 2 * largest);
  std::size_t made = 0;
  for (const Tile& other : {b, c, d, b, c, d}) {
    tiles.mesh(std::vector{a});
    const std::size_t before = tiles.tiles_made();
    EXPECT_EQ(before, std::max<std::size_t>(made, 1)) << "the tile asked each time is kept";
    tiles.mesh(std::vector{other});
    made = tiles.tiles_made();
  }
  EXPECT_GT(made, 4U);  // and the others were not

  SurfaceTiles for_one(long_room(), tile_edge, largest);
  for (const Tile& tile : {a, b, c, d}) {
    for_one.mesh(std::vector{tile});
    made = for_one.tiles_made();
    for_one.mesh(std::vector{tile});
    EXPECT_EQ(for_one.tiles_made(), made) << "the last one is kept";
  }
}

TEST(SurfaceTiles, RefuseWhatIsNoLengthOrNoSize) {
  EXPECT_THROW(SurfaceTiles(long_room(), 0, 1), std::invalid_argument);
  EXPECT_THROW(SurfaceTiles(long_room(), std::nan(""), 1), std::invalid_argument);
  EXPECT_THROW(SurfaceTiles(long_room(), 0.1, -1), std::invalid_argument);
  EXPECT_THROW(SurfaceTiles(long_room(), 0.1, std::nan("")), std::invalid_argument);
  // A solid block of rough faces: refused before it takes the memory.
  ImplicitSurface surface = sphere({0, 0, 0}, 1);
  surface.range = [](const Eigen::Vector3d&, double) { return Interval{-1, 1}; };
  surface.bounds.extend(Eigen::Vector3d(20, 20, 20));
  SurfaceTiles tiles(surface, 0.005, 0);
  EXPECT_THROW(tiles.mesh(std::vector{Tile{0, 0}}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
