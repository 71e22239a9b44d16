// SPDX-License-Identifier: MIT
#include "scenes/roughness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/random.h"
#include "core/text.h"

namespace minescan {
namespace {

/// Directions spread evenly over the sphere (Fibonacci lattice); noise picks among them by hash.
const std::array<Eigen::Vector3d, 256>& unit_gradients() {
  static const std::array<Eigen::Vector3d, 256> list = [] {
    std::array<Eigen::Vector3d, 256> directions = {};
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double z = 1 - (2 * static_cast<double>(i) + 1) / 256;
      const double angle = 2 * std::numbers::pi * std::numbers::phi * static_cast<double>(i);
      const double r = std::sqrt(1 - z * z);
      directions[i] = {r * std::cos(angle), r * std::sin(angle), z};
    }
    return directions;
  }();
  return list;
}

std::uint64_t mixed(std::uint64_t h) {  // finaliser of SplitMix64 (Steele, Lea and Flood 2014)
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9;
  h = (h ^ (h >> 27)) * 0x94d049bb133111eb;
  return h ^ (h >> 31);
}

// Odd factors keep the places of a lattice apart before mixing; any large odd numbers do.
constexpr std::uint64_t step_x = 0x9e3779b97f4a7c15;
constexpr std::uint64_t step_y = 0xc2b2ae3d27d4eb4f;
constexpr std::uint64_t step_z = 0x165667b19e3779f9;

/// std::floor for numbers that fit; without SSE4.1 std::floor is a function call.
std::int64_t floor_of(double x) {
  const auto truncated = static_cast<std::int64_t>(x);
  return truncated - (x < static_cast<double>(truncated) ? 1 : 0);
}

double fade(double t) { return t * t * t * (t * (6 * t - 15) + 10); }

/// A rotation drawn uniformly (Shoemake 1992).
Eigen::Matrix3d random_rotation(Random& random) {
  Eigen::Quaterniond q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = random.normal();
  return q.normalized().toRotationMatrix();
}

}  // namespace

double gradient_noise(const Eigen::Vector3d& place, std::uint64_t seed) {
  const auto& gradients = unit_gradients();
  const std::int64_t i = floor_of(place.x()), j = floor_of(place.y()), k = floor_of(place.z());
  const double x = place.x() - static_cast<double>(i), y = place.y() - static_cast<double>(j),
               z = place.z() - static_cast<double>(k);
  const std::array<std::uint64_t, 2> hx = {static_cast<std::uint64_t>(i) * step_x,
                                           static_cast<std::uint64_t>(i + 1) * step_x};
  const std::array<std::uint64_t, 2> hy = {static_cast<std::uint64_t>(j) * step_y,
                                           static_cast<std::uint64_t>(j + 1) * step_y};
  const std::array<std::uint64_t, 2> hz = {static_cast<std::uint64_t>(k) * step_z + seed,
                                           static_cast<std::uint64_t>(k + 1) * step_z + seed};
  const auto corner = [&](int a, int b, int c) {
    const Eigen::Vector3d& g = gradients[mixed(hx[a] + hy[b] + hz[c]) & 255];
    return g.x() * (x - a) + g.y() * (y - b) + g.z() * (z - c);
  };
  const double u = fade(x), v = fade(y), w = fade(z);
  const auto along_x = [&](int b, int c) {
    const double low = corner(0, b, c);
    return low + u * (corner(1, b, c) - low);
  };
  const auto along_y = [&](int c) {
    const double low = along_x(0, c);
    return low + v * (along_x(1, c) - low);
  };
  const double low = along_y(0);
  return low + w * (along_y(1) - low);
}

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
    const double reach = gradient_noise_slope * radius / octave.spacing;
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
  const std::int64_t i0 = floor_of(x), j0 = floor_of(y);
  double nearest = 100;
  double second = 100;
  std::uint64_t level = 0;
  for (std::int64_t i = i0 - 2; i <= i0 + 2; ++i) {
    for (std::int64_t j = j0 - 2; j <= j0 + 2; ++j) {
      const std::uint64_t h = mixed(static_cast<std::uint64_t>(i) * step_x +
                                    static_cast<std::uint64_t>(j) * step_y + seed_);
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
