// SPDX-License-Identifier: MIT
#include "scenes/roughness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "core/gradient_noise.h"
#include "core/random.h"
#include "core/text.h"

namespace minescan {
namespace {

// Mean frequency of gradient noise along a line, cycles per spacing of its lattice; found
// numerically, from the spectra of 6000 lines of 64 spacings. Its root mean square is 0.41517.
constexpr double noise_frequency = 0.3425;

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
  if (!(band.hurst > 0 && band.hurst <= 1 && band.fine_hurst > 0 && band.fine_hurst <= 1))
    throw std::invalid_argument("relief: expected Hurst exponents in (0, 1], found " +
                                number_text(band.hurst) + " and " + number_text(band.fine_hurst));
  // Octave k has wavelength outer / 2^k. For a density ~ k^-(1 + 2 H), the variance in an octave
  // goes with wavelength^(2 H); all octaves of the band together have variance rms^2.
  const auto variance_of = [&](double wavelength) {
    const double knee = std::min(band.fine_below, band.outer);
    if (wavelength >= knee) return std::pow(wavelength / band.outer, 2 * band.hurst);
    return std::pow(knee / band.outer, 2 * band.hurst) *
           std::pow(wavelength / knee, 2 * band.fine_hurst);
  };
  double variances = 0;
  double left_out_variances = 0;
  double left_out_slopes = 0;
  int index = 0;
  for (double wavelength = band.outer; wavelength >= band.inner; wavelength /= 2, ++index) {
    const double variance = variance_of(wavelength);
    variances += variance;
    if (wavelength < finest) {
      left_out_variances += variance;
      left_out_slopes += variance * std::pow(2 * std::numbers::pi / wavelength, 2);
      continue;
    }
    if (band.rms == 0) continue;
    // Gradient noise is zero on its lattice and even in variance only off the lattice planes. A
    // rotation and an offset of its own for each octave keep walls and zeros of octaves apart.
    Octave octave;
    octave.seed = derived_seed(seed, "octave" + std::to_string(index));
    Random random(octave.seed, 0);
    octave.spacing = wavelength / gradient_noise_wavelength;
    octave.to_lattice = random_rotation(random) / octave.spacing;
    for (double& o : octave.offset) o = random.uniform();
    octave.amplitude = std::sqrt(variance) / gradient_noise_rms;
    octaves_.push_back(octave);
  }
  const double scale = band.rms / std::sqrt(variances);
  for (Octave& octave : octaves_) {
    octave.amplitude *= scale;
    bound_ += octave.amplitude * gradient_noise_max;
  }
  left_out_ = {.height = scale * std::sqrt(left_out_variances),
               .slope = scale * std::sqrt(left_out_slopes)};
}

double road_density(RoadClass road) {
  if (road == RoadClass::none) return 0;
  return 16e-6 * std::pow(4, static_cast<int>(road) - static_cast<int>(RoadClass::A));
}

ReliefBand road_relief(RoadClass road, double inner, double outer) {
  // Octaves of wavelengths L and variances c L, L halved from each to the next, add up to
  // n^2 G_d(n) = c m / ln 2 on average over an octave: m is the mean frequency of an octave's waves
  // times L. Part of them is longer than `outer`, so the variance is larger than the integral of
  // G_d from 1 / outer to 1 / inner.
  constexpr double n0 = 0.1;
  const double c = road_density(road) * n0 * n0 * std::numbers::ln2 /
                   (noise_frequency * gradient_noise_wavelength);
  const double octaves = std::floor(std::log2(outer / inner)) + 1;
  const double wavelengths = outer * (2 - std::exp2(1 - octaves));  // their sum
  return {.rms = std::sqrt(c * wavelengths), .hurst = 0.5, .inner = inner, .outer = outer};
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

LooseRocks::LooseRocks(double per_area, double size, std::uint64_t seed, double finest)
    : per_area_(per_area), size_(size), seed_(seed), finest_(finest) {
  if (!(per_area >= 0 && per_area <= 1 && size >= 0 && size <= 1))
    throw std::invalid_argument(
        "loose rocks: expected 0 to 1 per square metre of a size of 0 to 1 m, found " +
        number_text(per_area) + " of " + number_text(size) + " m");
}

// One square metre holds one stone or none, wholly.
LooseRocks::Stone LooseRocks::stone_in(std::int64_t i, std::int64_t j) const {
  Stone stone;
  if (lattice_uniform(i, j, 0, seed_) >= per_area_) return stone;
  // Broken rock has many small pieces and few large ones: as many of each doubling in size
  // (assumed).
  const double across = size_ * std::pow(3, -lattice_uniform(i, j, 1, seed_));
  if (across < finest_) return stone;
  stone.radius = across / 2;
  stone.height = across * (0.25 + 0.25 * lattice_uniform(i, j, 2, seed_));
  const double free = 1 - across;
  stone.centre = {static_cast<double>(i) + across / 2 + free * lattice_uniform(i, j, 3, seed_),
                  static_cast<double>(j) + across / 2 + free * lattice_uniform(i, j, 4, seed_)};
  return stone;
}

Interval LooseRocks::range(const Eigen::Vector3d& place, double radius) const {
  if (per_area_ == 0 || size_ == 0) return {0, 0};
  if (radius > 1) return {0, bound()};
  const auto cell = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
  Interval result = {std::numeric_limits<double>::infinity(), 0};
  for (std::int64_t j = cell(place.y() - radius); j <= cell(place.y() + radius); ++j)
    for (std::int64_t i = cell(place.x() - radius); i <= cell(place.x() + radius); ++i) {
      const Stone stone = stone_in(i, j);
      const auto height_at = [&](double distance) {
        const double t = distance / stone.radius;
        return t < 1 ? stone.height * std::sqrt(1 - t * t) : 0;
      };
      const double distance =
          stone.radius > 0 ? (place.head<2>() - stone.centre).norm() : 2 * radius + 1;
      const double high = stone.radius > 0 ? height_at(std::max(0.0, distance - radius)) : 0;
      const double low = stone.radius > 0 ? height_at(distance + radius) : 0;
      result.high = std::max(result.high, high);
      result.low = std::min(result.low, low);
    }
  return result;
}

double normal_upper_quantile(double share) {
  double low = -10, high = 10;
  for (int i = 0; i < 80; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(middle / std::numbers::sqrt2) / 2 > share ? low : high) = middle;
  }
  return low;
}

}  // namespace minescan
