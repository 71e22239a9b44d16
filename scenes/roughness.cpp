// SPDX-License-Identifier: MIT
#include "scenes/roughness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/gradient_noise.h"
#include "core/random.h"
#include "core/text.h"

namespace minescan {
namespace {

/// A rotation drawn uniformly (Shoemake 1992).
Eigen::Matrix3d random_rotation(Random& random) {
  Eigen::Quaterniond q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = random.normal();
  return q.normalized().toRotationMatrix();
}

}  // namespace

Relief::Relief(const ReliefBand& band, std::uint64_t seed, double finest) {
  if (!(band.inner > 0 && band.inner <= band.outer && std::isfinite(band.outer)))
    throw std::invalid_argument("relief: expected wavelengths 0 < inner <= outer, found inner " +
                                number_text(band.inner) + " m, outer " + number_text(band.outer) +
                                " m");
  // Octave k has wavelength outer / 2^k. For a density ~ k^-(1 + 2 H), the variance in an octave
  // goes with wavelength^(2 H); all octaves of the band together have variance rms^2.
  double variances = 0;
  for (double wavelength = band.outer; wavelength >= band.inner; wavelength /= 2) {
    const double variance = std::pow(wavelength / band.outer, 2 * band.hurst);
    variances += variance;
    if (wavelength < finest || band.rms == 0) continue;
    // Gradient noise is zero on its lattice and even in variance only off the lattice planes. A
    // rotation and an offset of its own for each octave keep walls and zeros of octaves apart.
    Octave octave;
    octave.seed = derived_seed(seed, "octave" + std::to_string(octaves_.size()));
    Random random(octave.seed, 0);
    octave.spacing = wavelength / gradient_noise_wavelength;
    octave.to_lattice = random_rotation(random) / octave.spacing;
    for (double& o : octave.offset) o = random.uniform();
    octave.amplitude = std::sqrt(variance) / gradient_noise_rms;
    octaves_.push_back(octave);
  }
  for (Octave& octave : octaves_) {
    octave.amplitude *= band.rms / std::sqrt(variances);
    bound_ += octave.amplitude * gradient_noise_max;
  }
}

Interval Relief::range(const Eigen::Vector3d& place, double radius) const {
  double sum = 0;
  double slack = 0;
  for (const Octave& octave : octaves_) {
    const double reach = gradient_noise_steepest * radius / octave.spacing;
    if (reach < gradient_noise_max) {
      const Eigen::Vector3d q = octave.to_lattice * place + octave.offset;
      sum += octave.amplitude * gradient_noise(q, octave.seed);
      slack += octave.amplitude * reach;
    } else {  // cheaper and narrower than its value here and the slope
      slack += octave.amplitude * gradient_noise_max;
    }
  }
  return {sum - slack, sum + slack};
}

Bedding::Bedding(double step, double plate, std::uint64_t seed)
    : step_(step), plate_(plate), seed_(seed) {
  if (!(step >= 0 && plate > 0))
    throw std::invalid_argument("bedding: expected step >= 0 and plate > 0, found step " +
                                number_text(step) + " m, plate " + number_text(plate) + " m");
}

Interval Bedding::range(const Eigen::Vector3d& place, double radius) const {
  if (step_ == 0) return {0, 0};
  // One centre in each square of a grid. The nearest lies within sqrt(2) of a square's side, so two
  // squares to each side are enough.
  const double x = place.x() / plate_;
  const double y = place.y() / plate_;
  const std::int64_t i0 = static_cast<std::int64_t>(std::floor(x)),
                     j0 = static_cast<std::int64_t>(std::floor(y));
  double nearest = 100;
  double second = 100;
  std::uint64_t level = 0;
  for (std::int64_t i = i0 - 2; i <= i0 + 2; ++i) {
    for (std::int64_t j = j0 - 2; j <= j0 + 2; ++j) {
      const std::uint64_t h = lattice_hash(i, j, 0, seed_);
      const double dx = static_cast<double>(i) + static_cast<double>(h >> 48) * 0x1p-16 - x;
      const double dy =
          static_cast<double>(j) + static_cast<double>(h >> 32 & 0xffff) * 0x1p-16 - y;
      const double distance = std::sqrt(dx * dx + dy * dy);
      if (distance < nearest) {
        second = nearest;
        nearest = distance;
        level = (h & 0xffffffff) % 3;
      } else {
        second = std::min(second, distance);
      }
    }
  }
  // Moving by `radius` changes either distance by at most `radius`: no border lies nearer.
  if (second - nearest > 2 * radius / plate_) {
    const double height = step_ * static_cast<double>(level);
    return {height, height};
  }
  return radius > 0
             ? Interval{0, bound()}
             : Interval{step_ * static_cast<double>(level), step_ * static_cast<double>(level)};
}

}  // namespace minescan
