// SPDX-License-Identifier: MIT
#include "sim/raycaster.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "test/sim/shapes.h"

namespace minescan {
namespace {

using Eigen::Vector3d;

constexpr double far = 1000;

TEST(RayCaster, AgreesWithTheClosedFormOfABox) {
  const Vector3d half(5, 4, 3);
  const RayCaster caster(box(half.cast<float>(), 7));
  const Vector3d origin(1.25, -2.5, 0.75);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    Random random(1, i);
    const Vector3d direction = random_direction(random);
    const std::optional<Hit> hit = caster.cast(origin, direction, 0, far);
    const auto [range, normal] = box_hit(half, origin, direction);
    ASSERT_TRUE(hit) << direction.transpose();
    // The planes are exact in single precision, so only double rounding is left; at an edge the
    // neighbouring face may be taken, whose plane is as far within Embree's single precision.
    ASSERT_NEAR(hit->range, range, hit->normal.isApprox(normal) ? 1e-12 : 1e-5);
    ASSERT_NEAR(hit->cosine, -hit->normal.dot(direction), 1e-12);
    ASSERT_GE(hit->cosine, 0);
  }
}

TEST(RayCaster, AgreesWithASphereWithinItsTessellation) {
  const double radius = 10;
  const TriangleMesh mesh = sphere(radius, 5);
  const RayCaster caster(mesh);
  double longest_edge = 0;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      longest_edge = std::max(
          longest_edge,
          static_cast<double>((mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm()));
  // A triangle with no angle over 90 degrees lies inside its circumcircle, whose radius is at most
  // edge / sqrt(2); no point of it is nearer to the centre than this.
  const double circle = longest_edge / std::sqrt(2.0);
  const double inner = std::sqrt(radius * radius - circle * circle);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    Random random(2, i);
    const Vector3d direction = random_direction(random);
    const std::optional<Hit> hit = caster.cast(Vector3d::Zero(), direction, 0, far);
    ASSERT_TRUE(hit);
    ASSERT_GE(hit->range, inner);
    ASSERT_LE(hit->range, radius * (1 + 1e-7));  // vertices are rounded to single precision
    // The normal passes through the circumcentre, at most `circle` from the point hit.
    ASSERT_GE(hit->cosine, std::cos(std::asin(2 * circle / radius)));
  }
}

TEST(RayCaster, AgreesWithACylinderWithinItsTessellation) {
  const double radius = 3;
  const std::uint32_t sides = 500;
  const RayCaster caster(tube(radius, 40, sides));
  const double sagitta = radius * (1 - std::cos(std::numbers::pi / sides));
  const double y = 1.5;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    Random random(3, i);
    const Vector3d direction = random_direction(random);
    const double flat = std::hypot(direction.y(), direction.z());
    if (flat < 0.2) continue;  // the ends of the tube
    const std::optional<Hit> hit = caster.cast({0.5, y, 0}, direction, 0, far);
    ASSERT_TRUE(hit);
    // |(y, 0) + t u| = radius in the cross section, u the unit direction there.
    const double yu = y * direction.y() / flat;
    const double t = -yu + std::sqrt(yu * yu + radius * radius - y * y);
    const double exact = t / flat;
    const Vector3d point = Vector3d(0.5, y, 0) + exact * direction;
    const double cosine = (direction.y() * point.y() + direction.z() * point.z()) / radius;
    // The flat side is nearer by up to the sagitta along the normal; 1e-6 for rounded vertices.
    ASSERT_LE(hit->range, exact + 1e-6 / cosine);
    ASSERT_GE(hit->range, exact - (2 * sagitta + 1e-6) / cosine);
    ASSERT_NEAR(hit->cosine, cosine, 2 * std::numbers::pi / sides);
  }
}

// The nearest triangle by the definition: solve for range and barycentric coordinates, for each.
std::optional<Hit> brute_force(const TriangleMesh& mesh, const Vector3d& origin,
                               const Vector3d& direction) {
  std::optional<Hit> nearest;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vector3d a = mesh.vertices[t[0]].cast<double>();
    Eigen::Matrix3d m;
    m << mesh.vertices[t[1]].cast<double>() - a, mesh.vertices[t[2]].cast<double>() - a, -direction;
    const Vector3d uvt = m.inverse() * (origin - a);
    if (!(uvt[0] >= 0 && uvt[1] >= 0 && uvt[0] + uvt[1] <= 1 && uvt[2] >= 0)) continue;
    if (nearest && nearest->range <= uvt[2]) continue;
    nearest = Hit{.triangle = i, .range = uvt[2], .cosine = 0, .normal = m.col(0).cross(m.col(1))};
  }
  return nearest;
}

TEST(RayCaster, AgreesWithBruteForce) {
  const TriangleMesh mesh = cave(8, 3, 0.2);
  const RayCaster caster(mesh);
  const Vector3d origin(1, 2, -0.5);
  int same = 0;
  const int rays = 2000;
  for (std::uint64_t i = 0; i < rays; ++i) {
    Random random(4, i);
    const Vector3d direction = random_direction(random);
    const std::optional<Hit> expected = brute_force(mesh, origin, direction);
    const std::optional<Hit> hit = caster.cast(origin, direction, 0, far);
    ASSERT_TRUE(expected && hit);
    if (hit->triangle != expected->triangle) {
      // Near an edge single precision may take the neighbour.
      ASSERT_NEAR(hit->range, expected->range, 1e-4);
      continue;
    }
    ++same;
    ASSERT_NEAR(hit->range, expected->range, 1e-11);  // double rounding, more when seen edge-on
    ASSERT_NEAR(std::abs(hit->normal.dot(expected->normal.normalized())), 1, 1e-12);
    ASSERT_NEAR(hit->normal.norm(), 1, 1e-12);
    ASSERT_LE(hit->normal.dot(direction), 0);
    ASSERT_NEAR(hit->cosine, -hit->normal.dot(direction), 1e-12);
  }
  // Single precision errs by about 1e-6 of an edge, and there are 3 edges to be near to.
  EXPECT_GE(same, rays - 4);
}

// Directions that are hard for single precision: along the axes with components of about 1e-16, at
// vertices, and at the middles of edges.
std::vector<Vector3d> awkward_directions(const TriangleMesh& mesh, const Vector3d& origin) {
  std::vector<Vector3d> list;
  for (int i = 0; i < 720; ++i) {
    const double angle = i * std::numbers::pi / 360;
    list.emplace_back(std::cos(angle), std::sin(angle), 0);
    list.emplace_back(0, std::cos(angle), std::sin(angle));
    list.emplace_back(std::sin(angle), 0, std::cos(angle));
    for (const double tiny : {1e-16, -1e-16, 6e-17, 1e-30, 1e-40})
      list.emplace_back(std::cos(angle), std::sin(angle), tiny);
  }
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d a = mesh.vertices[t[k]].cast<double>();
      const Vector3d b = mesh.vertices[t[(k + 1) % 3]].cast<double>();
      list.push_back((a - origin).normalized());
      list.push_back(((a + b) / 2 - origin).normalized());
    }
  }
  return list;
}

int leaks(const TriangleMesh& mesh, const Vector3d& origin) {
  const RayCaster caster(mesh);
  std::vector<Vector3d> directions = awkward_directions(mesh, origin);
  for (std::uint64_t i = 0; directions.size() < 70000 || directions.size() % 16 != 5; ++i) {
    Random random(5, i);
    directions.push_back(random_direction(random));
  }
  int lost = 0;
  for (std::size_t i = 0; i < directions.size(); i += lanes) {
    HitPacket hits;
    RayPacket rays;
    rays.count = std::min(lanes, directions.size() - i);
    for (std::size_t k = 0; k < rays.count; ++k) rays.set(k, {origin, directions[i + k]});
    rays.fill();
    caster.cast_packet(rays, far, hits);
    for (std::size_t k = 0; k < rays.count; ++k) {
      if (hits.triangle[k] == no_triangle) ++lost;
      if (!caster.cast(origin, directions[i + k], 0, far)) ++lost;
    }
  }
  return lost;
}

TEST(RayCaster, LosesNoRayInAClosedMesh) {
  EXPECT_EQ(leaks(box({5, 4, 3}, 40), {0, 0, 0}), 0);
  EXPECT_EQ(leaks(box({5, 4, 3}, 40), {1.25, -2.5, 0.75}), 0);
  EXPECT_EQ(leaks(cave(8, 5, 0.05), {0, 0, 0}), 0);
  EXPECT_EQ(leaks(sphere(8, 5), {3, 0, 0}), 0);
}

TEST(RayCaster, PacketsSeeWhatSingleRaysSee) {
  const RayCaster caster(cave(8, 5, 0.1));
  const Vector3d origin(0.5, 0.25, -1);
  for (std::uint64_t i = 0; i < 3000; ++i) {
    Random random(6, i);
    const Vector3d centre = random_direction(random);
    RayPacket rays;
    rays.count = 1 + i % lanes;
    for (std::size_t k = 0; k < rays.count; ++k)
      rays.set(k, {origin, (centre + 0.01 * random_direction(random)).normalized()});
    rays.fill();
    HitPacket hits;
    caster.cast_packet(rays, far, hits);
    std::array<Glance, lanes> glances;
    caster.glance_packet(rays, far, glances);
    for (std::size_t k = 0; k < rays.count; ++k) {
      const std::optional<Hit> alone = caster.cast(origin, rays.direction.lane(k), 0, far);
      ASSERT_TRUE(alone);
      const Hit hit = hits.lane(k);
      ASSERT_EQ(glances[k].triangle, hit.triangle);
      ASSERT_NEAR(glances[k].range, hit.range, 1e-4);
      ASSERT_NEAR(glances[k].cosine, hit.cosine, 1e-4);
      // The same triangle but for ties at edges, which single precision breaks either way.
      ASSERT_NEAR(hit.range, alone->range, hit.triangle == alone->triangle ? 1e-12 : 1e-4);
    }
  }
}

TEST(RayCaster, KeepsToTheRangeAskedFor) {
  const RayCaster caster(box({2, 2, 2}));
  const Vector3d x = Vector3d::UnitX();
  EXPECT_TRUE(caster.cast(Vector3d::Zero(), x, 0, 2.5));
  EXPECT_FALSE(caster.cast(Vector3d::Zero(), x, 0, 1.5));
  EXPECT_FALSE(caster.cast(Vector3d::Zero(), x, 2.5, 10));
  const std::optional<Hit> beyond = caster.cast({-5, 0, 0}, x, 4, 10);  // through the first wall
  ASSERT_TRUE(beyond);
  EXPECT_DOUBLE_EQ(beyond->range, 7);
}

TEST(RayCaster, SeesBothSidesOfATriangle) {
  const RayCaster caster(box({2, 2, 2}));
  const std::optional<Hit> outside = caster.cast({-5, 0.5, 0.25}, Vector3d::UnitX(), 0, 10);
  ASSERT_TRUE(outside);
  EXPECT_DOUBLE_EQ(outside->range, 3);
  EXPECT_TRUE(outside->normal.isApprox(-Vector3d::UnitX()));
}

template <class Error>
std::string message_of(TriangleMesh mesh) {
  try {
    RayCaster caster(std::move(mesh));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(RayCaster, RejectsMeshesThatAreWrong) {
  using Wrong = std::invalid_argument;
  EXPECT_EQ(message_of<Wrong>({}), "mesh: expected at least 1 triangle, found none");

  TriangleMesh mesh = box({1, 1, 1});
  mesh.vertices[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(message_of<Wrong>(mesh).find("vertex 3: expected finite coordinates"),
            std::string::npos);

  mesh = box({1, 1, 1});
  mesh.triangles[2][1] = 1000;
  EXPECT_EQ(message_of<Wrong>(mesh), "mesh: triangle 2: expected vertices below 24, found 1000");

  mesh = box({1, 1, 1});
  mesh.material[5] = 1;
  EXPECT_EQ(message_of<Wrong>(mesh), "mesh: triangle 5: expected a material below 1, found 1");

  mesh = box({1, 1, 1});
  mesh.material.pop_back();
  EXPECT_EQ(message_of<Wrong>(mesh),
            "mesh: expected one material for each of 12 triangles, found 11");

  mesh = box({1, 1, 1}, 1, 1.5);
  EXPECT_NE(message_of<Wrong>(mesh).find("reflectance in (0, 1], found 1.5"), std::string::npos);

  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto message_with = [&](double Material::*member, double value) {
    mesh = box({1, 1, 1});
    mesh.materials[0].*member = value;
    return message_of<Wrong>(mesh);
  };
  EXPECT_EQ(message_with(&Material::wetness, 1.25),
            "mesh: material 'rock': expected a wetness in [0, 1], found 1.25");
  EXPECT_EQ(message_with(&Material::roughness, -0.5),
            "mesh: material 'rock': expected a finite roughness >= 0, found -0.5");
  EXPECT_EQ(message_with(&Material::fine_slope, infinity),
            "mesh: material 'rock': expected a finite fine slope >= 0, found inf");
  for (double Material::*member :
       {&Material::reflectance, &Material::wetness, &Material::roughness, &Material::fine_slope})
    EXPECT_NE(message_with(member, std::nan("")).find("found nan"), std::string::npos);
}

}  // namespace
}  // namespace minescan
