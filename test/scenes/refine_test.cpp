// SPDX-License-Identifier: MIT
#include "scenes/refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/parallel.h"
#include "scenes/contour.h"
#include "scenes/half_edge.h"
#include "scenes/mine.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;

/// Open inside a sphere about the origin.
ImplicitSurface sphere(double radius) {
  ImplicitSurface s;
  s.at = [=](const Eigen::Vector3d& p) {
    return ImplicitSurface::Sample{.value = p.norm() - radius};
  };
  s.range = [=](const Eigen::Vector3d& p, double r) {
    const double d = p.norm() - radius;
    return Interval{d - r, d + r};
  };
  s.bounds.extend(Eigen::Vector3d::Constant(-radius).eval());
  s.bounds.extend(Eigen::Vector3d::Constant(radius).eval());
  s.area = 4 * pi * radius * radius;
  s.materials.resize(2);
  return s;
}

/// A sphere cut by the plane z = height: faces 1 and 2, each of its own material.
ImplicitSurface cut_sphere(double radius, double height) {
  ImplicitSurface s = sphere(radius);
  s.at = [=](const Eigen::Vector3d& p) {
    const double round = p.norm() - radius, flat = p.z() - height;
    return round > flat ? ImplicitSurface::Sample{round, 0, 1}
                        : ImplicitSurface::Sample{flat, 1, 2};
  };
  s.range = [at = s.at](const Eigen::Vector3d& p, double r) {
    const double value = at(p).value;
    return Interval{value - r, value + r};
  };
  return s;
}

auto always(const ImplicitSurface& surface) {
  return [=](double) { return surface; };
}

void expect_closed(const TriangleMesh& mesh) {
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.closed());
  EXPECT_EQ(check.degenerate_triangles, 0U);
  EXPECT_EQ(check.unused_vertices, 0U);
}

double longest_edge(const std::array<Eigen::Vector3d, 3>& t) {
  return std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
}

/// The triangles whose corners all are within `range` of a place.
std::vector<std::array<Eigen::Vector3d, 3>> triangles_within(const TriangleMesh& mesh,
                                                             const Eigen::Vector3d& place,
                                                             double range) {
  std::vector<std::array<Eigen::Vector3d, 3>> list;
  for (const auto& triangle : mesh.triangles) {
    const auto t = corners(mesh, triangle);
    if (std::all_of(t.begin(), t.end(),
                    [&](const Eigen::Vector3d& p) { return (p - place).norm() <= range; }))
      list.push_back(t);
  }
  return list;
}

TEST(Refined, PutsVerticesOnTheSphereAndConvergesToItsArea) {
  const double radius = 2, edge = 0.4;
  const TriangleMesh coarse = contour(sphere(radius), edge);
  const double area = 4 * pi * radius * radius;
  const std::vector<Eigen::Vector3d> places = {{0.5, 0, 0}};
  for (int levels = 1; levels <= 3; ++levels) {
    const TriangleMesh mesh =
        refined(coarse, always(sphere(radius)), edge, places, {.range = 100, .levels = levels});
    expect_closed(mesh);
    EXPECT_EQ(check_mesh(mesh).euler_characteristic, 2);
    for (const Eigen::Vector3f& v : mesh.vertices)
      ASSERT_NEAR(v.cast<double>().norm(), radius, 1e-6 + 1e-5 * std::ldexp(edge, -levels));
    // No side is longer than sqrt(3) / 2^levels edges, and a chord of length c leaves a gap of
    // c^2 / (8 R), twice whose share of the radius is missing from the area.
    const double gap = 3 * std::pow(std::ldexp(edge, -levels), 2) / (8 * radius);
    const Measures m = measures(mesh);
    EXPECT_LT(m.area, area);
    EXPECT_NEAR(m.area, area, 2 * gap / radius * area) << "levels " << levels;
  }
}

TEST(Refined, ShortensEdgesNearThePlaceAndLeavesFarOnesAlone) {
  const double radius = 2, edge = 0.2;
  const Refinement refinement = {.range = 0.5, .levels = 3};
  const std::vector<Eigen::Vector3d> places = {{0, 0, 2}};
  const TriangleMesh coarse = contour(sphere(radius), edge);
  const TriangleMesh mesh = refined(coarse, always(sphere(radius)), edge, places, refinement);
  expect_closed(mesh);
  for (int k = 1; k <= refinement.levels; ++k) {
    const double range = refinement.range * std::ldexp(1.0, refinement.levels - k);
    const auto near = triangles_within(mesh, places[0], range);
    EXPECT_GT(near.size(), 100U);
    for (const auto& t : near) {
      // Sides of a cell's diagonal at first, halved. The cut to the middle of the longest side of a
      // triangle with one short side s <= 1/2 may be longer: sqrt(3 / 4 + s^2 / 2) / sqrt(3 / 4).
      EXPECT_LE(longest_edge(t), 1.09 * std::sqrt(3.0) * std::ldexp(edge, -k));
    }
  }
  // Old vertices keep their places in the list, far ones theirs in space; so do far triangles.
  ASSERT_GE(mesh.vertices.size(), coarse.vertices.size());
  const double farthest = refinement.range * 4;
  const auto is_far = [&](std::uint32_t v) {
    return (coarse.vertices[v].cast<double>() - places[0]).norm() > farthest;
  };
  for (std::uint32_t v = 0; v < coarse.vertices.size(); ++v) {
    if (is_far(v)) {
      EXPECT_EQ(mesh.vertices[v], coarse.vertices[v]);
    }
  }
  const std::set<std::array<std::uint32_t, 3>> all(mesh.triangles.begin(), mesh.triangles.end());
  std::size_t far = 0;
  for (const auto& t : coarse.triangles) {
    if (!std::all_of(t.begin(), t.end(), is_far)) continue;
    EXPECT_TRUE(all.contains(t));
    ++far;
  }
  EXPECT_GT(far, 1000U);
}

TEST(Refined, GivesTheSameBytesForAnyNumberOfThreads) {
  const std::vector<Eigen::Vector3d> places = {{0, 0, 2}, {1, 1, 0}};
  const auto make = [&] {
    return refined(contour(cut_sphere(2, 1), 0.1), always(cut_sphere(2, 1)), 0.1, places,
                   {.range = 0.5, .levels = 3});
  };
  TriangleMesh one;
  {
    const ThreadLimit limit(1);
    one = make();
  }
  const ThreadLimit limit(4);
  EXPECT_TRUE(same_bytes(one, make()));
}

TEST(Refined, StaysAClosedManifoldBetweenTwoPlaces) {
  const std::vector<Eigen::Vector3d> places = {{0, 0, 2}, {1.3, 0.4, 1.4}, {-9, 0, 0}};
  for (const double range : {0.05, 0.3, 1.0}) {
    const TriangleMesh mesh = refined(contour(sphere(2), 0.1), always(sphere(2)), 0.1, places,
                                      {.range = range, .levels = 3});
    expect_closed(mesh);
    EXPECT_EQ(check_mesh(mesh).components, 1U);
    EXPECT_EQ(check_mesh(mesh).euler_characteristic, 2);
  }
}

TEST(Refined, KeepsSharpEdges) {
  const double edge = 0.2, height = 1.03;
  const ImplicitSurface surface = cut_sphere(2, height);
  const std::vector<Eigen::Vector3d> places = {{0, 0, 1}};
  const TriangleMesh mesh =
      refined(contour(surface, edge), always(surface), edge, places, {.range = 100, .levels = 2});
  expect_closed(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Eigen::Vector3d& p : corners(mesh, mesh.triangles[t])) {
      // The rim is a chain of chords of up to two cells: they leave gaps of edge^2 / (2 R) to it,
      // R = 1.7 m its radius, but not to the plane: floats at 2 m.
      if (mesh.material[t] % 2 == 1) {
        ASSERT_NEAR(p.z(), height, 2e-7);
      } else {
        ASSERT_NEAR(p.norm(), 2, edge * edge / (2 * 1.7));
      }
    }
}

TEST(Refined, ListsTheMaterialsOfEachLevel) {
  const double edge = 0.2;
  const auto surface = [](double length) {
    ImplicitSurface s = cut_sphere(2, 1.03);
    for (Material& m : s.materials) m.roughness = length;
    return s;
  };
  const std::vector<Eigen::Vector3d> places = {{0, 0, 1}};
  const Refinement refinement = {.range = 0.8, .levels = 2};
  const TriangleMesh mesh =
      refined(contour(surface(edge), edge), surface, edge, places, refinement);
  ASSERT_EQ(mesh.materials.size(), 6U);
  for (std::size_t m = 0; m < 6; ++m)
    EXPECT_EQ(mesh.materials[m].roughness, edge / std::pow(2, m / 2));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto p = corners(mesh, mesh.triangles[t]);
    double farthest = 0;
    for (const Eigen::Vector3d& corner : p)
      farthest = std::max(farthest, (corner - places[0]).norm());
    // Moving onto the surface may take a corner over the border by a little.
    const double slack = 0.02;
    const int level = mesh.material[t] / 2;
    if (farthest < 0.8 - slack) {
      EXPECT_EQ(level, 2);
    }
    if (farthest > 0.8 + slack) {
      EXPECT_LT(level, 2);
    }
    if (farthest < 1.6 - slack) {
      EXPECT_GE(level, 1);
    }
    if (farthest > 1.6 + slack) {
      EXPECT_EQ(level, 0);
    }
  }
}

TEST(Refined, DoesNothingWithoutLevelsOrPlaces) {
  const TriangleMesh coarse = contour(sphere(1), 0.2);
  const std::vector<Eigen::Vector3d> places = {{0, 0, 1}};
  EXPECT_TRUE(same_bytes(coarse, refined(coarse, always(sphere(1)), 0.2, places, {})));
  EXPECT_TRUE(same_bytes(coarse, refined(coarse, always(sphere(1)), 0.2, {}, {.levels = 2})));
}

TEST(Refined, RefusesWhatItCannotDo) {
  const TriangleMesh coarse = contour(sphere(1), 0.2);
  const std::vector<Eigen::Vector3d> places = {{0, 0, 1}};
  const auto run = [&](double edge, const Refinement& refinement) {
    refined(coarse, always(sphere(1)), edge, places, refinement);
  };
  EXPECT_THROW(run(0, {.levels = 1}), std::invalid_argument);
  EXPECT_THROW(run(std::nan(""), {.levels = 1}), std::invalid_argument);
  EXPECT_THROW(run(0.2, {.range = -1, .levels = 1}), std::invalid_argument);
  EXPECT_THROW(run(0.2, {.range = std::nan(""), .levels = 1}), std::invalid_argument);
  EXPECT_THROW(run(0.2, {.levels = -1}), std::invalid_argument);
  EXPECT_THROW(run(0.2, {.levels = 128}), std::invalid_argument);  // 258 materials
  EXPECT_THROW(run(0.2, {.levels = 15}), std::invalid_argument);   // 10^12 triangles
  const std::vector<Eigen::Vector3d> nowhere = {{0, std::nan(""), 1}};
  EXPECT_THROW(refined(coarse, always(sphere(1)), 0.2, nowhere, {.levels = 1}),
               std::invalid_argument);
  EXPECT_THROW(refined(coarse,
                       [](double) {
                         ImplicitSurface s = sphere(1);
                         s.materials.resize(3);
                         return s;
                       },
                       0.2, places, {.levels = 1}),
               std::invalid_argument);
}

/// The part of the area near a place whose normals point against the slope of the surface, into the
/// rock.
double turned_over(const TriangleMesh& mesh, const ImplicitSurface& surface,
                   const Eigen::Vector3d& place, double range) {
  double turned = 0, all = 0;
  for (const auto& t : triangles_within(mesh, place, range)) {
    const Eigen::Vector3d middle = (t[0] + t[1] + t[2]) / 3;
    const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    Eigen::Vector3d slope;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d h = 1e-3 * Eigen::Vector3d::Unit(i);
      slope[i] = surface.at(middle + h).value - surface.at(middle - h).value;
    }
    all += normal.norm();
    if (!(normal.dot(slope) < 0)) turned += normal.norm();
  }
  return turned / all;
}

TEST(Refined, ShowsTheFinerReliefOfAMine) {
  const double edge = 0.1, range = 2;
  Mine mine;
  mine.drifts["main"] = {.line = {{-5, 0, 0}, {5, 0, 0}}, .width = 4, .height = 3};
  // Steps have no slope to compare with; short rough waves and breaks between rounds overhang here
  // and there.
  mine.rock.wall.fine_below = mine.rock.ceiling.fine_below = 0;
  mine.rock.bedding_step = mine.rock.half_cast_spacing = mine.rock.rock_density = 0;
  mine.rock.look_out = mine.rock.overbreak = 0;
  const auto surface = [&](double length) { return surface_of(mine, 1, length); };
  const std::vector<Eigen::Vector3d> places = {{0, 0, 1.5}};
  const TriangleMesh mesh =
      refined(contour(surface(edge), edge), surface, edge, places, {.range = range, .levels = 3});
  expect_closed(mesh);
  const ImplicitSurface finest = surface(edge / 8);
  std::size_t on_surface = 0, all = 0;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    if ((v.cast<double>() - places[0]).norm() > 0.95 * range) continue;
    ++all;
    if (std::abs(finest.at(v.cast<double>()).value) < 1e-4) ++on_surface;
  }
  EXPECT_GT(all, 50000U);
  // Some slivers hold their corners back.
  EXPECT_GT(static_cast<double>(on_surface), 0.97 * static_cast<double>(all));
  // Pieces of slivers that stood upon the coarse mesh to begin with: 6e-6.
  EXPECT_LT(turned_over(mesh, finest, places[0], 0.95 * range), 1e-5);
}

// Waves as short as a level shows and steeper than any relief: without care, slivers turn over (10
// did). All triangles still face the middle of the sphere.
TEST(Refined, TurnsNoTriangleOver) {
  const double edge = 0.2;
  const auto surface = [](double length) {
    ImplicitSurface s = sphere(2);
    const double k = pi / length;  // waves of two edges
    const double height = length < 0.15 ? 2 / k : 0;
    s.at = [=](const Eigen::Vector3d& p) {
      const double wave = std::sin(k * p.x()) * std::sin(k * p.y() + 1) * std::sin(k * p.z() + 2);
      return ImplicitSurface::Sample{.value = p.norm() - 2 + height * wave};
    };
    return s;
  };
  const std::vector<Eigen::Vector3d> places = {{0, 0, 0}};
  const TriangleMesh mesh =
      refined(contour(sphere(2), edge), surface, edge, places, {.range = 100, .levels = 2});
  expect_closed(mesh);
  std::size_t turned = 0;
  for (const auto& triangle : mesh.triangles) {
    const auto t = corners(mesh, triangle);
    if (!((t[1] - t[0]).cross(t[2] - t[0]).dot(t[0]) < 0)) ++turned;
  }
  EXPECT_EQ(turned, 0U);
}

TEST(Refined, StaysAClosedManifoldInAMineWithBeddingAndConcrete) {
  const double edge = 0.1;
  Mine mine;
  mine.drifts["main"] = {
      .line = {{-5, 0, 0}, {5, 0, 0}}, .width = 4, .height = 3, .end = End::concrete};
  const auto surface = [&](double length) { return surface_of(mine, 2, length); };
  const std::vector<Eigen::Vector3d> places = {{0, 0, 2}, {4, 0, 1}};
  expect_closed(
      refined(contour(surface(edge), edge), surface, edge, places, {.range = 1.5, .levels = 3}));
}

}  // namespace
}  // namespace minescan
