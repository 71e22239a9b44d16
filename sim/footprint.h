// SPDX-License-Identifier: MIT
// The footprint of a beam as sub-rays: where they go and how much of the light each stands for.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace minescan {

/// One sub-ray of a Gaussian beam.
struct SubRay {
  double along = 0;   // of the beam's axis, in radii at 1/e^2 of the intensity
  double across = 0;  // the same, at right angles
};

/// The sub-rays of a footprint: the axis, 6 at the radius 1, and 12 on the same hexagonal lattice
/// between them.
inline constexpr std::size_t few_sub_rays = 7;
inline constexpr std::size_t all_sub_rays = 19;
std::span<const SubRay, all_sub_rays> sub_rays();

/// The light of each, sum 1. Of all: the beam's Gaussian at each place. Of the first few: such that
/// the mean square distance from the axis is that of all (0.401), so that smooth surfaces look the
/// same to both.
std::span<const double, few_sub_rays> few_weights();
std::span<const double, all_sub_rays> all_weights();

}  // namespace minescan
