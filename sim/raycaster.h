// SPDX-License-Identifier: MIT
// Where rays meet a mesh. Everything about Embree stays behind this header.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/cloud.h"
#include "sim/packet.h"

namespace minescan {

/// The same as a Hit, as far as single precision tells (range off by up to 1e-4 m in a mine).
struct Glance {
  std::uint32_t triangle = no_triangle;
  float range = 0;
  float cosine = 0;
};

/// How a ray caster sorts its triangles: `fast` for many rays, `soon` for few, ready in a fraction
/// of the time.
enum class Tree { fast, soon };

/// Finds the first triangle along a ray, from either side. No ray leaves a closed mesh. Copies
/// share the mesh. Safe to call from many threads at once.
///
/// Embree finds the triangle in single precision (off by up to 1e-4 m in a mine); range and normal
/// are then computed in double precision on that triangle.
class RayCaster {
 public:
  /// Keeps `mesh`. Throws std::invalid_argument if it is empty, has a vertex that is not finite, an
  /// index (of a vertex or a material) that leads nowhere, or a material with a reflectance outside
  /// (0, 1], a wetness outside [0, 1], or a roughness or fine slope that is negative or not finite;
  /// std::runtime_error if Embree fails.
  explicit RayCaster(TriangleMesh mesh, Tree tree = Tree::fast);

  /// Nearest hit within [min_range, max_range], or none. `direction` is a unit vector.
  std::optional<Hit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          double min_range, double max_range) const;

  /// The same from range 0 for a packet of rays, much faster if they are neighbours. Lane i of
  /// `hits` belongs to ray i; its triangle is no_triangle where there is none. Lanes without a ray
  /// are to hold the last one (RayPacket::fill).
  void cast_packet(const RayPacket& rays, double max_range, HitPacket& hits) const;

  /// The same without what takes double precision.
  void glance_packet(const RayPacket& rays, double max_range,
                     std::array<Glance, lanes>& glances) const;

  /// What `ray` met, in double precision; `glance` is what glance_packet found of it.
  Hit hit_of(const Ray& ray, const Glance& glance) const;

  /// The mesh that triangle indices refer to.
  const TriangleMesh& mesh() const;

 private:
  struct Impl;  // keeps Embree out of this header
  std::shared_ptr<const Impl> impl_;
};

}  // namespace minescan
