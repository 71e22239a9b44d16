// SPDX-License-Identifier: MIT
#include "scenes/self_intersection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/random.h"
#include "scenes/contour.h"

namespace minescan {
namespace {

// The oracle: all pairs, by separating axes, in whole numbers. Coordinates up to 2^24 need 106
// bits.

__extension__ using Int = __int128;
using Vector = Eigen::Matrix<Int, 3, 1>;

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Int dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

bool parted(const std::vector<Vector>& p, const std::vector<Vector>& q, const Vector& axis) {
  Int low_p = dot(p[0], axis), high_p = low_p, low_q = dot(q[0], axis), high_q = low_q;
  for (const Vector& v : p) {
    low_p = std::min(low_p, dot(v, axis));
    high_p = std::max(high_p, dot(v, axis));
  }
  for (const Vector& v : q) {
    low_q = std::min(low_q, dot(v, axis));
    high_q = std::max(high_q, dot(v, axis));
  }
  return high_p < low_q || high_q < low_p;
}

/// Of two convex sets of two or three corners each.
bool apart(const std::vector<Vector>& p, const std::vector<Vector>& q) {
  std::vector<Vector> edges, normals;
  for (const auto* shape : {&p, &q}) {
    const std::vector<Vector>& v = *shape;
    for (std::size_t i = 0; i < v.size(); ++i) edges.push_back(v[(i + 1) % v.size()] - v[i]);
    if (v.size() == 3) normals.push_back(cross(v[1] - v[0], v[2] - v[0]));
  }
  for (const Vector& normal : normals) {
    if (parted(p, q, normal)) return true;
    for (const Vector& edge : edges)
      if (parted(p, q, cross(normal, edge))) return true;
  }
  for (const Vector& a : edges)
    for (const Vector& b : edges)
      if (parted(p, q, cross(a, b))) return true;
  return false;
}

bool is_null(const Vector& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

bool expected_to_meet(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& s,
                      const std::array<std::uint32_t, 3>& t) {
  const auto corner = [&](std::uint32_t i) {
    const Eigen::Vector3f& v = mesh.vertices[i];
    return Vector(static_cast<Int>(v.x()), static_cast<Int>(v.y()), static_cast<Int>(v.z()));
  };
  std::vector<Vector> common, only_s, only_t;
  for (const std::uint32_t i : s)
    (std::find(t.begin(), t.end(), i) != t.end() ? common : only_s).push_back(corner(i));
  for (const std::uint32_t i : t)
    if (std::find(s.begin(), s.end(), i) == s.end()) only_t.push_back(corner(i));
  const std::vector<Vector> all_s = {corner(s[0]), corner(s[1]), corner(s[2])};
  const std::vector<Vector> all_t = {corner(t[0]), corner(t[1]), corner(t[2])};
  if (is_null(cross(all_s[1] - all_s[0], all_s[2] - all_s[0]))) return false;
  if (is_null(cross(all_t[1] - all_t[0], all_t[2] - all_t[0]))) return false;
  if (common.empty()) return !apart(all_s, all_t);
  // Seen from the common corner, what is common goes on to a side opposite.
  if (common.size() == 1) return !apart(only_s, all_t) || !apart(all_s, only_t);
  if (common.size() == 3) return true;
  const Vector side = common[1] - common[0];
  const Vector height_s = cross(side, only_s[0] - common[0]);
  const Vector height_t = cross(side, only_t[0] - common[0]);
  return is_null(cross(height_s, height_t)) && dot(height_s, height_t) > 0;
}

std::size_t expected_count(const TriangleMesh& mesh) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      count += expected_to_meet(mesh, mesh.triangles[i], mesh.triangles[j]) ? 1 : 0;
  return count;
}

Eigen::Vector3f lattice_point(Random& random, std::uint64_t size) {
  const auto coordinate = [&] { return static_cast<float>(random.below(size)); };
  const float x = coordinate(), y = coordinate(), z = coordinate();
  return {x, y, z};
}

void add_random_triangles(TriangleMesh& mesh, Random& random, std::size_t count) {
  while (mesh.triangles.size() < count) {
    std::array<std::uint32_t, 3> t = {};
    for (std::uint32_t& corner : t)
      corner = static_cast<std::uint32_t>(random.below(mesh.vertices.size()));
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
}

/// Triangles between few points in few places: they share corners and sides, touch, lie in planes.
TriangleMesh small_soup(std::uint64_t stream) {
  Random random(1, stream);
  TriangleMesh mesh;
  const std::uint64_t size = 2 + random.below(5);
  for (int i = 0; i < 14; ++i) mesh.vertices.push_back(lattice_point(random, size));
  add_random_triangles(mesh, random, 30);
  return mesh;
}

TriangleMesh pair_of(const std::array<Eigen::Vector3f, 3>& s,
                     const std::array<Eigen::Vector3f, 3>& t) {
  return {.vertices = {s[0], s[1], s[2], t[0], t[1], t[2]}, .triangles = {{0, 1, 2}, {3, 4, 5}}};
}

/// Two triangles of five points that share the first, or of four that share the first two.
std::size_t fan(const std::vector<Eigen::Vector3f>& points) {
  TriangleMesh mesh{.vertices = points, .triangles = {{0, 1, 2}, {0, 3, 4}}};
  if (points.size() == 4) mesh.triangles[1] = {1, 0, 3};
  return count_self_intersections(mesh);
}

/// A box's sides are cut from its lowest corner to its highest one.
void add_box(TriangleMesh& mesh, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                               (i & 4) != 0 ? high.z() : low.z());
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t u = 1U << (axis + 1) % 3, v = 1U << (axis + 2) % 3;
    for (const std::uint32_t start : {0U, 1U << axis}) {
      const std::uint32_t a = first + start, b = a + u, c = a + v, d = a + u + v;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
}

bool area_seen(const TriangleMesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return has_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
}

TEST(SelfIntersections, AreThoseThatSeparatingAxesFindInSmallSoups) {
  std::size_t most = 0;
  for (std::uint64_t stream = 0; stream < 150; ++stream) {
    const TriangleMesh mesh = small_soup(stream);
    const std::size_t expected = expected_count(mesh);
    EXPECT_EQ(count_self_intersections(mesh), expected) << "stream " << stream;
    most = std::max(most, expected);
  }
  EXPECT_GT(most, 100U);
}

TEST(SelfIntersections, AreFoundBetweenTrianglesOfAllSizes) {
  TriangleMesh mesh;
  Random random(2, 0);
  for (std::uint32_t i = 0; i < 700; ++i) {
    // From needles' points to as large as everything.
    const std::uint64_t size = i % 50 == 0 ? 1 << 20 : i % 7 == 0 ? 1 << 17 : 1 << 15;
    const Eigen::Vector3f place = lattice_point(random, (1 << 20) - size + 1);
    for (int k = 0; k < 3; ++k) mesh.vertices.emplace_back(place + lattice_point(random, size));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const std::size_t expected = expected_count(mesh);
  EXPECT_GT(expected, 20U);
  EXPECT_LT(expected, 2000U);
  EXPECT_EQ(count_self_intersections(mesh), expected);
  const ThreadLimit one(1);
  EXPECT_EQ(count_self_intersections(mesh), expected);
}

// The products of these coordinates need 75 bits: in double precision the points would be above or
// below the plane at random.
TEST(SelfIntersections, AreExactInAPlaneThatIsNotAlongTheAxes) {
  for (std::uint64_t stream = 0; stream < 50; ++stream) {
    Random random(3, stream);
    const Eigen::Vector3f u = lattice_point(random, 1 << 20), v = lattice_point(random, 1 << 20);
    TriangleMesh mesh;
    for (int i = 0; i < 25; ++i) {
      const Eigen::Vector3f steps = lattice_point(random, 8);
      mesh.vertices.emplace_back(steps.x() * u + steps.y() * v);  // below 2^24: not rounded
    }
    for (int i = 0; i < 3; ++i) mesh.vertices.push_back(lattice_point(random, 1 << 23));
    add_random_triangles(mesh, random, 40);
    EXPECT_EQ(count_self_intersections(mesh), expected_count(mesh)) << "stream " << stream;
  }
}

TEST(SelfIntersections, StayWhenTheUnitChanges) {
  for (std::uint64_t stream = 0; stream < 40; ++stream) {
    const TriangleMesh mesh = small_soup(stream);
    const std::size_t count = count_self_intersections(mesh);
    // The smallest numbers there are, and nearly the largest.
    for (const int power : {-149, 124}) {
      TriangleMesh scaled = mesh;
      for (Eigen::Vector3f& v : scaled.vertices) v *= std::ldexp(1.0F, power);
      EXPECT_EQ(count_self_intersections(scaled), count) << "stream " << stream << " 2^" << power;
    }
  }
}

// The differences of these coordinates need more bits than a double has.
TEST(SelfIntersections, AreExactForCoordinatesOfVerySmallAndVeryLargeSize) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  const float far = 0x1p100F;
  std::array<Eigen::Vector3f, 3> wall = {{{-far, -far, -1}, {far, far, -1}, {0, 0, 1}}};
  for (int turns = 0; turns < 3; ++turns) {
    for (const auto& [x, count] : {std::pair{tiny, 0U}, {0.0F, 1U}, {-tiny, 1U}}) {
      std::array<Eigen::Vector3f, 3> beside = {{{x, 0, 0.25F}, {5, 1, 3}, {4, 1, -3}}};
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(count_self_intersections(pair_of(wall, beside)), count) << x;
        EXPECT_EQ(count_self_intersections(pair_of(beside, wall)), count) << x;
        std::rotate(beside.begin(), beside.begin() + 1, beside.end());
      }
    }
    std::rotate(wall.begin(), wall.begin() + 1, wall.end());
  }
}

TEST(SelfIntersections, AreExactForDifferencesOfManyBits) {
  for (std::uint64_t stream = 0; stream < 300; ++stream) {
    Random random(4, stream);
    const float p = static_cast<float>((1 << 23) + random.below(1 << 23));
    const float q = static_cast<float>((1 << 23) + random.below(1 << 23));
    const auto power = [&] { return std::ldexp(1.0F, static_cast<int>(random.below(40))); };
    // The plane through the z axis and (p, q), and a place within the wall.
    const auto in_plane = [&](float along, float z) {
      return Eigen::Vector3f(along * p, along * q, z);
    };
    const float left = power(), right = power(), away = power(), nearby = 1 / power();
    const std::array<Eigen::Vector3f, 3> wall = {
        {in_plane(-2 * left, -1), in_plane(2 * right, -1), in_plane(0, 1)}};
    const Eigen::Vector3f place = in_plane(nearby / 2, 0);
    const auto touching_with = [&](float x) {
      return count_self_intersections(pair_of(
          wall,
          {{{x, place.y(), place.z()}, {away * q, -away * p, 3}, {away * q, -away * p, -3}}}));
    };
    EXPECT_EQ(touching_with(place.x()), 1U) << "stream " << stream;
    EXPECT_EQ(touching_with(std::nextafter(place.x(), 0.0F)), 1U) << "stream " << stream;
    EXPECT_EQ(touching_with(std::nextafter(place.x(), place.x() + 1)), 0U) << "stream " << stream;
  }
}

TEST(SelfIntersections, CountTrianglesThatTouchWithoutACommonCorner) {
  const std::array<Eigen::Vector3f, 3> floor = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};
  const auto meets_floor = [&](const std::array<Eigen::Vector3f, 3>& t) {
    return count_self_intersections(pair_of(floor, t)) == 1;
  };
  EXPECT_TRUE(meets_floor({{{1, 1, 0}, {1, 1, 3}, {2, 1, 3}}}));           // a corner within
  EXPECT_TRUE(meets_floor({{{2, 2, 0}, {5, 5, 3}, {5, 5, 4}}}));           // a corner on a side
  EXPECT_TRUE(meets_floor({{{0, 0, 0}, {-1, 0, 3}, {0, -1, 3}}}));         // corners in one place
  EXPECT_TRUE(meets_floor({{{-1, 2, -1}, {1, 2, 1}, {-1, 2, 9}}}));        // side through side
  EXPECT_TRUE(meets_floor({{{1, 1, 0}, {2, 1, 0}, {1, 2, 0}}}));           // one within the other
  EXPECT_TRUE(meets_floor({{{-9, -9, 0}, {19, -9, 0}, {-9, 19, 0}}}));     // and round it
  EXPECT_TRUE(meets_floor({{{4, 0, 0}, {8, 0, 0}, {8, 4, 0}}}));           // in a plane, a corner
  EXPECT_FALSE(meets_floor({{{1, 1, 0.01F}, {1, 1, 3}, {2, 1, 3}}}));      // above
  EXPECT_FALSE(meets_floor({{{2.01F, 2, 0}, {5, 5, 3}, {5, 5, -3}}}));     // beside
  EXPECT_FALSE(meets_floor({{{4, 4, 0}, {4, 2, 0}, {2.01F, 2.01F, 0}}}));  // in its plane
  EXPECT_FALSE(meets_floor({{{0, 0, 0.01F}, {4, 0, 0.01F}, {0, 4, 0.01F}}}));  // parallel
}

TEST(SelfIntersections, OfTrianglesWithACommonCornerAreWhatIsCommonBesidesIt) {
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {-2, 0, 0}, {0, -2, 0}}), 0U);  // in a plane
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 1, 5}, {1, 1, 1}}), 0U);    // above
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 1, 1}, {1, 1, -1}}), 1U);   // through
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {9, 9, 9}, {9, 9, -9}}), 1U);   // and beyond
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {-1, -1, 1}, {-1, -1, -1}}), 0U);
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 1, 0}, {0, 0, 3}}), 1U);   // a side within
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 0, 0}, {0, 0, 3}}), 1U);   // side on side
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {-1, 0, 0}, {0, 0, 3}}), 0U);  // in one line
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {9, 1, 0}, {1, -9, 0}}), 1U);  // overlapping
}

TEST(SelfIntersections, OfTrianglesWithACommonSideAreFolds) {
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, -2, 0}}), 0U);
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 2, 0.001F}}), 0U);
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {9, 1, 0}}), 1U);
  EXPECT_EQ(fan({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 2, 0}}), 1U);
  EXPECT_EQ(count_self_intersections({.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}},
                                      .triangles = {{0, 1, 2}, {0, 2, 1}}}),
            1U);
}

TEST(SelfIntersections, AreNotAmongNestedBoxes) {
  TriangleMesh mesh;
  for (int i = 1; i < 20; ++i) {
    const Eigen::Vector3f half = Eigen::Vector3f(0.1F, 0.3F, 0.7F) * static_cast<float>(i);
    add_box(mesh, -half, half);
  }
  EXPECT_EQ(count_self_intersections(mesh), 0U);
}

// The rod goes through one triangle of the plate's top and one of its bottom. Each time the line
// around it crosses the four sides of the rod and both triangles of each.
TEST(SelfIntersections, OfARodThroughAPlateAreTwoPerSideAndFace) {
  TriangleMesh mesh;
  add_box(mesh, {0, 0, 0}, {10, 10, 1});
  add_box(mesh, {6, 2, -3}, {7, 3, 5});
  EXPECT_EQ(count_self_intersections(mesh), 2U * 4 * 2);
}

TEST(SelfIntersections, AreNotInContours) {
  for (const Eigen::Vector3d& centre :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.3, 100.1, -7)}) {
    ImplicitSurface sphere;
    sphere.at = [=](const Eigen::Vector3d& p) {
      return ImplicitSurface::Sample{.value = (p - centre).norm() - 2};
    };
    sphere.range = [=](const Eigen::Vector3d& p, double r) {
      const double d = (p - centre).norm() - 2;
      return Interval{d - r, d + r};
    };
    sphere.bounds.extend(centre - Eigen::Vector3d::Constant(2));
    sphere.bounds.extend(centre + Eigen::Vector3d::Constant(2));
    sphere.area = 50;
    sphere.materials = {{}};
    TriangleMesh mesh = contour(sphere, 0.1);
    EXPECT_GT(mesh.triangles.size(), 5000U);
    EXPECT_EQ(count_self_intersections(mesh), 0U);

    // One vertex moved to the other end.
    mesh.vertices[0] = (2 * centre).cast<float>() - mesh.vertices[0];
    EXPECT_GT(count_self_intersections(mesh), 0U);
  }
}

TEST(SelfIntersections, LeaveOutTrianglesWithoutArea) {
  TriangleMesh mesh =
      pair_of({{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}}, {{{1, 1, -1}, {1, 1, 0}, {1, 1, 1}}});
  EXPECT_EQ(count_self_intersections(mesh), 0U);
  EXPECT_FALSE(area_seen(mesh, 1));
  EXPECT_TRUE(area_seen(mesh, 0));
  for (const float odd :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    mesh.vertices[5] = {1, 1.5F, odd};
    EXPECT_FALSE(area_seen(mesh, 1));
    EXPECT_EQ(count_self_intersections(mesh), 0U);
  }
  EXPECT_EQ(count_self_intersections({}), 0U);
}

TEST(HasArea, IsWhatCornersInALineDoNotHave) {
  // 8 bits to spare: nothing is rounded.
  const Eigen::Vector3f start(3, 9, 27), step(12345, -4321, 777);
  TriangleMesh mesh{.vertices = {start, start + step, start + 3 * step}, .triangles = {{0, 1, 2}}};
  EXPECT_FALSE(area_seen(mesh, 0));
  for (int axis = 0; axis < 3; ++axis) {
    TriangleMesh moved = mesh;
    moved.vertices[1][axis] = std::nextafter(moved.vertices[1][axis], 0.0F);
    EXPECT_TRUE(area_seen(moved, 0));
  }
}

TEST(HasArea, IsDecidedExactly) {
  for (std::uint64_t stream = 0; stream < 300; ++stream) {
    Random random(5, stream);
    const float p = static_cast<float>((1 << 23) + random.below(1 << 23));
    const float q = static_cast<float>((1 << 23) + random.below(1 << 23));
    const auto power = [&] { return std::ldexp(1.0F, static_cast<int>(random.below(40))); };
    TriangleMesh mesh{.triangles = {{0, 1, 2}}};
    for (const float along : {-power(), power(), 0.5F / power()})
      mesh.vertices.emplace_back(along * p, along * q, 0);
    EXPECT_FALSE(area_seen(mesh, 0)) << "stream " << stream;
    mesh.vertices[2].x() = std::nextafter(mesh.vertices[2].x(), 0.0F);
    EXPECT_TRUE(area_seen(mesh, 0)) << "stream " << stream;
  }
}

}  // namespace
}  // namespace minescan
