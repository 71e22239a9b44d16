// SPDX-License-Identifier: MIT
// Sixteen of a kind that are worked on together: number [i] of every array belongs to lane i. All
// lanes hold numbers; who has fewer than 16 of something repeats the last one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace minescan {

inline constexpr std::size_t lanes = 16;
using Lanes = std::array<float, lanes>;
using DoubleLanes = std::array<double, lanes>;

/// A vector in each lane.
struct VectorLanes {
  std::array<DoubleLanes, 3> xyz;

  DoubleLanes& operator[](std::size_t k) { return xyz[k]; }
  const DoubleLanes& operator[](std::size_t k) const { return xyz[k]; }
  Eigen::Vector3d lane(std::size_t i) const { return {xyz[0][i], xyz[1][i], xyz[2][i]}; }
  void set(std::size_t i, const Eigen::Vector3d& v) {
    xyz[0][i] = v.x();
    xyz[1][i] = v.y();
    xyz[2][i] = v.z();
  }
};

/// A matrix in each lane.
struct MatrixLanes {
  std::array<VectorLanes, 3> row;

  MatrixLanes() = default;
  /// The same in all of them.
  explicit MatrixLanes(const Eigen::Matrix3d& m) {
    for (std::size_t i = 0; i < lanes; ++i) set(i, m);
  }
  void set(std::size_t i, const Eigen::Matrix3d& m) {
    for (std::size_t k = 0; k < 3; ++k)
      row[k].set(i, m.row(static_cast<Eigen::Index>(k)).transpose());
  }
};

/// The triangle index of a ray that met nothing.
inline constexpr std::uint32_t no_triangle = std::numeric_limits<std::uint32_t>::max();

/// A ray in the world frame; `direction` is a unit vector.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
};
struct RayPacket {
  std::size_t count = 0;  // of rays, at most 16
  VectorLanes origin, direction;

  Ray lane(std::size_t i) const { return {origin.lane(i), direction.lane(i)}; }
  void set(std::size_t i, const Ray& ray) {
    origin.set(i, ray.origin);
    direction.set(i, ray.direction);
  }
  /// Gives lanes without a ray the last one.
  void fill() {
    for (std::size_t i = count; i < lanes; ++i) set(i, lane(count - 1));
  }
};

/// Where a ray met the mesh.
struct Hit {
  std::uint32_t triangle = no_triangle;
  double range = 0;                                  // metres from the origin of the ray
  double cosine = 0;                                 // of the angle between ray and normal, [0, 1]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, on the side the ray came from
};
struct HitPacket {
  std::array<std::uint32_t, lanes> triangle;
  DoubleLanes range, cosine;
  VectorLanes normal;

  Hit lane(std::size_t i) const { return {triangle[i], range[i], cosine[i], normal.lane(i)}; }
  void set(std::size_t i, const Hit& hit) {
    triangle[i] = hit.triangle;
    range[i] = hit.range;
    cosine[i] = hit.cosine;
    normal.set(i, hit.normal);
  }
};

}  // namespace minescan
