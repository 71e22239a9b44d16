// SPDX-License-Identifier: MIT
// Measures of triangle meshes, for tests.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/cloud.h"

namespace minescan {

struct Measures {
  double volume = 0;  // of the open space: positive if normals point into it
  double area = 0;
};

inline std::array<Eigen::Vector3d, 3> corners(const TriangleMesh& mesh,
                                              const std::array<std::uint32_t, 3>& triangle) {
  return {mesh.vertices[triangle[0]].cast<double>(), mesh.vertices[triangle[1]].cast<double>(),
          mesh.vertices[triangle[2]].cast<double>()};
}

inline Measures measures(const TriangleMesh& mesh) {
  Measures m;
  for (const auto& triangle : mesh.triangles) {
    const auto [a, b, c] = corners(mesh, triangle);
    m.volume -= a.dot(b.cross(c)) / 6;  // divergence theorem; the normal is the inner one
    m.area += (b - a).cross(c - a).norm() / 2;
  }
  return m;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

inline bool same_bytes(const TriangleMesh& a, const TriangleMesh& b) {
  return same_bytes(a.vertices, b.vertices) && same_bytes(a.triangles, b.triangles) &&
         same_bytes(a.material, b.material);
}

}  // namespace minescan
