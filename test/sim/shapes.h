// SPDX-License-Identifier: MIT
// Closed meshes with known ranges and normals, seen from inside.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/cloud.h"
#include "core/random.h"

namespace minescan {

/// Gives every triangle the one material.
inline TriangleMesh with_material(TriangleMesh mesh, double reflectance) {
  mesh.material.assign(mesh.triangles.size(), 0);
  mesh.materials = {{.name = "rock", .reflectance = reflectance}};
  return mesh;
}

/// The box |x| <= half.x, ... about the origin; each face is `steps` by `steps` squares of two
/// triangles. Vertices are shared within a face, and faces meet at equal coordinates.
inline TriangleMesh box(const Eigen::Vector3f& half, std::uint32_t steps = 1,
                        double reflectance = 0.5) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f}) {
      const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      for (std::uint32_t i = 0; i <= steps; ++i) {
        for (std::uint32_t j = 0; j <= steps; ++j) {
          const auto part = [&](std::uint32_t k) {
            return -1.0f + 2.0f * static_cast<float>(k) / static_cast<float>(steps);
          };
          Eigen::Vector3f p;
          p[axis] = side * half[axis];
          p[u] = part(i) * half[u];
          p[v] = part(j) * half[v];
          mesh.vertices.push_back(p);
        }
      }
      for (std::uint32_t i = 0; i < steps; ++i) {
        for (std::uint32_t j = 0; j < steps; ++j) {
          const std::uint32_t a = base + i * (steps + 1) + j;
          const std::uint32_t b = a + steps + 1;
          // u x v points along +axis, so this order faces inwards on the negative side.
          std::array<std::array<std::uint32_t, 3>, 2> pair = {{{a, b, b + 1}, {a, b + 1, a + 1}}};
          for (auto& t : pair) {
            if (side > 0) std::swap(t[1], t[2]);
            mesh.triangles.push_back(t);
          }
        }
      }
    }
  }
  return with_material(std::move(mesh), reflectance);
}

/// How far it is from `origin` inside that box to its surface, and the normal there.
inline std::pair<double, Eigen::Vector3d> box_hit(const Eigen::Vector3d& half,
                                                  const Eigen::Vector3d& origin,
                                                  const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const double side = direction[axis] > 0 ? 1 : -1;
    const double range = (side * half[axis] - origin[axis]) / direction[axis];
    if (range >= nearest) continue;
    nearest = range;
    normal = -side * Eigen::Vector3d::Unit(axis);
  }
  return {nearest, normal};
}

/// An icosahedron with its triangles cut into four `levels` times, vertices on the sphere.
inline TriangleMesh sphere(double radius, int levels, double reflectance = 0.5) {
  const double g = std::numbers::phi;
  std::vector<Eigen::Vector3d> corners;
  for (const double s : {-1.0, 1.0})
    for (const double t : {-g, g})
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::Vector3d p = Eigen::Vector3d::Zero();
        p[axis] = s;
        p[(axis + 1) % 3] = t;
        corners.push_back(p.normalized());
      }
  // Its faces: the triples of corners that are all neighbours.
  const double edge = 2 / std::sqrt(1 + g * g);
  const auto near = [&](std::size_t a, std::size_t b) {
    return std::abs((corners[a] - corners[b]).norm() - edge) < 1e-9;
  };
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (std::uint32_t a = 0; a < 12; ++a)
    for (std::uint32_t b = a + 1; b < 12; ++b)
      for (std::uint32_t c = b + 1; c < 12; ++c)
        if (near(a, b) && near(b, c) && near(c, a)) {
          const double volume = corners[a].dot(corners[b].cross(corners[c]));
          faces.push_back(volume < 0 ? std::array{a, b, c} : std::array{a, c, b});
        }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, added] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                      static_cast<std::uint32_t>(corners.size()));
      if (added) corners.push_back((corners[a] + corners[b]).normalized());
      return found->second;
    };
    std::vector<std::array<std::uint32_t, 3>> smaller;
    for (const auto& [a, b, c] : faces) {
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      smaller.insert(smaller.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(smaller);
  }
  TriangleMesh mesh;
  for (const Eigen::Vector3d& p : corners) mesh.vertices.push_back((radius * p).cast<float>());
  mesh.triangles = std::move(faces);
  return with_material(std::move(mesh), reflectance);
}

/// That sphere with every vertex moved in or out by up to `relief` of the radius: closed, and no
/// plane in it.
inline TriangleMesh cave(double radius, int levels, double relief) {
  TriangleMesh mesh = sphere(radius, levels);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Random random(11, i);
    mesh.vertices[i] *= static_cast<float>(1 + relief * (2 * random.uniform() - 1));
  }
  return mesh;
}

/// A tube of `sides` flat sides along x, corners at `radius`, closed at x = +- half_length.
inline TriangleMesh tube(double radius, double half_length, std::uint32_t sides) {
  TriangleMesh mesh;
  for (const double x : {-half_length, half_length}) {
    mesh.vertices.push_back(Eigen::Vector3d(x, 0, 0).cast<float>());
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.push_back(
          Eigen::Vector3d(x, radius * std::cos(angle), radius * std::sin(angle)).cast<float>());
    }
  }
  const std::uint32_t far = sides + 1;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t a = 1 + i;
    const std::uint32_t b = 1 + (i + 1) % sides;
    mesh.triangles.push_back({a, far + b, far + a});
    mesh.triangles.push_back({a, b, far + b});
    mesh.triangles.push_back({0, a, b});
    mesh.triangles.push_back({far, far + b, far + a});
  }
  return with_material(std::move(mesh), 0.5);
}

/// A direction drawn evenly from the sphere.
inline Eigen::Vector3d random_direction(Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

}  // namespace minescan
