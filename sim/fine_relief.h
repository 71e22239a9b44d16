// SPDX-License-Identifier: MIT
// The relief of a surface that its triangles leave out, as one wave of gradient noise; see `scan`.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "core/cloud.h"
#include "sim/raycaster.h"

namespace minescan {

/// How far fine relief may move a point along its beam, in its wavelengths (assumed). Beyond, at
/// grazing incidence, the beam would meet another wave before.
inline constexpr double fine_relief_reach = 2;

/// The fine relief of one material.
class FineRelief {
 public:
  explicit FineRelief(const Material& material);

  /// Whether there is any.
  bool exists() const { return height_ > 0; }

  /// Turns those of `hits` that `chosen` lists into what they are with the relief; rays[i] met
  /// hits[i], and shifts[i] becomes by how much its range is longer then, metres. At most 16 are
  /// chosen.
  void apply(std::span<const Ray> rays, std::span<const std::uint8_t> chosen, std::span<Hit> hits,
             std::span<double> shifts) const;

 private:
  Eigen::Matrix3d to_lattice_ = Eigen::Matrix3d::Zero();  // from the world
  double height_ = 0;                                     // metres per unit of noise
  double reach_ = 0;                                      // metres along the beam
  std::uint64_t seed_ = 0;
};

}  // namespace minescan
