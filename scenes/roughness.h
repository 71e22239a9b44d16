// SPDX-License-Identifier: MIT
// Rough rock: relief that looks alike at all scales, as broken rock does, and bedding steps. Both
// are functions of the place in the world, so that two scans of one wall see the same relief.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "scenes/implicit.h"

namespace minescan {

/// Statistics of a relief. A profile along a line has a power spectral density ~ k^-(1 + 2 hurst)
/// between the wavelengths `inner` and `outer`.
struct ReliefBand {
  double rms = 0.07;    // metres, of all wavelengths in the band together
  double hurst = 0.75;  // Hurst exponent, in (0, 1]
  double inner = 0.05;  // shortest wavelength, metres
  double outer = 10;    // longest wavelength, metres
};

/// Height of a self-affine relief: a sum of octaves of gradient noise (Perlin 1985, 2002;
/// fractional Brownian motion after Musgrave, in Ebert et al., Texturing and Modeling, 2003).
class Relief {
 public:
  /// Octaves of wavelengths below `finest` are left out (a mesh cannot show them); those that stay
  /// do not depend on it. Throws std::invalid_argument if the band is empty.
  Relief(const ReliefBand& band, std::uint64_t seed, double finest);

  /// Encloses the heights within `radius` of a place; the height itself for radius 0.
  Interval range(const Eigen::Vector3d& place, double radius) const;
  double at(const Eigen::Vector3d& place) const { return range(place, 0).low; }
  /// No height is larger than this, nor smaller than its negative.
  double bound() const { return bound_; }

 private:
  struct Octave {
    Eigen::Matrix3d to_lattice = Eigen::Matrix3d::Identity();
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    double spacing = 1;  // of the noise lattice, metres
    double amplitude = 0;
    std::uint64_t seed = 0;
  };
  std::vector<Octave> octaves_;  // longest wavelength first
  double bound_ = 0;
};

/// Where a layered roof has come down to a higher bedding plane, plate by plate: the height is
/// 0, 1 or 2 steps, the same over each plate (a Voronoi cell in the xy-plane).
class Bedding {
 public:
  /// `plate` is the mean distance between plates' centres, metres.
  Bedding(double step, double plate, std::uint64_t seed);

  Interval range(const Eigen::Vector3d& place, double radius) const;
  double bound() const { return 2 * step_; }

 private:
  double step_ = 0;
  double plate_ = 1;
  std::uint64_t seed_ = 0;
};

}  // namespace minescan
