// SPDX-License-Identifier: MIT
// The relief of a surface that its triangles leave out, as one wave of gradient noise; see `scan`.
#pragma once

#include <array>

#include "core/cloud.h"
#include "sim/packet.h"
#include "sim/vector_math.h"

namespace minescan {

/// How far fine relief may move a point along its beam, in its wavelengths (assumed). Beyond, at
/// grazing incidence, the beam would meet another wave before.
inline constexpr double fine_relief_reach = 2;

/// The fine relief of one material.
class FineRelief {
 public:
  explicit FineRelief(const Material& material);

  /// Whether there is any.
  bool exists() const { return noise_.height > 0; }

  /// Turns the chosen ones of `hits` into what they are with the relief; `rays` are what met them.
  /// shift[i] becomes by how much the range is longer then, metres.
  void apply(const RayPacket& rays, const std::array<bool, lanes>& chosen, HitPacket& hits,
             DoubleLanes& shift) const {
    apply_relief(noise_, rays, chosen, hits, shift);
  }

 private:
  ReliefNoise noise_ = {};
};

}  // namespace minescan
