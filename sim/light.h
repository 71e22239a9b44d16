// SPDX-License-Identifier: MIT
// The light that beams bring back.
#pragma once

#include <array>
#include <cstddef>

#include "sim/footprint.h"
#include "sim/packet.h"

namespace minescan {

/// What one sub-ray of a beam met.
struct Facet {
  double weight = 1;  // share of the beam's light
  double range = 0;   // metres, above 0
  double signal = 0;  // reflectance * cos(incidence)
};

/// Most facets of a beam and tones of a scanner.
inline constexpr std::size_t max_facets = all_sub_rays;
inline constexpr std::size_t max_tones = 4;

/// The light of up to 16 beams on its way into the receiver: number [k][i] is that of sub-ray k of
/// beam i.
struct Light {
  std::size_t sub_rays = 0;                         // of each beam; the first is its axis
  std::array<DoubleLanes, max_facets> weight = {};  // 0: nothing comes back
  std::array<DoubleLanes, max_facets> range, signal;
  // Standard normal numbers: block b, number j of beam i is normals[b][j][i]. Number 3 of block 0
  // is left to others than the receiver.
  std::array<std::array<Lanes, 4>, 1 + max_tones / 2> normals = {};
  DoubleLanes age = {};  // seconds since the instrument was switched on

  /// Makes room for `count` sub-rays of each beam, from which nothing comes back yet.
  void clear(std::size_t count) {
    sub_rays = count;
    for (std::size_t k = 0; k < count; ++k) {
      weight[k].fill(0);
      range[k].fill(1);  // a number, so that all 16 beams can be worked on alike
      signal[k].fill(0);
    }
  }

  void set(std::size_t k, std::size_t beam, const Facet& facet) {
    weight[k][beam] = facet.weight;
    range[k][beam] = facet.range;
    signal[k][beam] = facet.signal;
  }
};

}  // namespace minescan
