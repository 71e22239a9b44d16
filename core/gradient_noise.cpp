// SPDX-License-Identifier: MIT
#include "core/gradient_noise.h"

#include <array>
#include <cmath>
#include <numbers>

namespace minescan {

// Directions spread evenly over the sphere (Fibonacci lattice).
const std::array<Eigen::Vector3d, 256> noise_gradients = [] {
  std::array<Eigen::Vector3d, 256> directions = {};
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / 256;
    const double angle = 2 * std::numbers::pi * std::numbers::phi * static_cast<double>(i);
    const double r = std::sqrt(1 - z * z);
    directions[i] = {r * std::cos(angle), r * std::sin(angle), z};
  }
  return directions;
}();

namespace {

/// std::floor for numbers that fit; without SSE4.1 std::floor is a function call.
std::int64_t floor_of(double x) {
  const auto truncated = static_cast<std::int64_t>(x);
  return truncated - (x < static_cast<double>(truncated) ? 1 : 0);
}

double fade(double t) { return t * t * t * (t * (6 * t - 15) + 10); }
double fade_slope(double t) { return 30 * t * t * (t * (t - 2) + 1); }

/// The cell of a place and what its eight corners contribute.
struct NoiseCell {
  std::array<double, 3> t = {};    // place within the cell
  std::array<double, 8> dot = {};  // corner i at (i & 1, i >> 1 & 1, i >> 2 & 1)
  std::array<const Eigen::Vector3d*, 8> gradient = {};

  NoiseCell(const Eigen::Vector3d& place, std::uint64_t seed) {
    const std::int64_t i = floor_of(place.x()), j = floor_of(place.y()), k = floor_of(place.z());
    t = {place.x() - static_cast<double>(i), place.y() - static_cast<double>(j),
         place.z() - static_cast<double>(k)};
    const std::uint64_t low = lattice_sum(i, j, k) + seed;
    for (std::size_t c = 0; c < 8; ++c) {
      const std::size_t a = c & 1, b = c >> 1 & 1, d = c >> 2;
      const std::uint64_t step = lattice_sum(
          static_cast<std::int64_t>(a), static_cast<std::int64_t>(b), static_cast<std::int64_t>(d));
      gradient[c] = &noise_gradients[mixed_bits(low + step) & 255];
      const Eigen::Vector3d& g = *gradient[c];
      dot[c] = g.x() * (t[0] - static_cast<double>(a)) + g.y() * (t[1] - static_cast<double>(b)) +
               g.z() * (t[2] - static_cast<double>(d));
    }
  }
};

}  // namespace

double gradient_noise(const Eigen::Vector3d& place, std::uint64_t seed) {
  const NoiseCell cell(place, seed);
  const double u = fade(cell.t[0]), v = fade(cell.t[1]), w = fade(cell.t[2]);
  const auto along_x = [&](std::size_t c) {
    return cell.dot[c] + u * (cell.dot[c + 1] - cell.dot[c]);
  };
  const auto along_y = [&](std::size_t c) {
    const double low = along_x(c);
    return low + v * (along_x(c + 2) - low);
  };
  const double low = along_y(0);
  return low + w * (along_y(4) - low);
}

NoiseSlope gradient_noise_slope(const Eigen::Vector3d& place, std::uint64_t seed) {
  const NoiseCell cell(place, seed);
  const std::array<double, 3> f = {fade(cell.t[0]), fade(cell.t[1]), fade(cell.t[2])};
  const std::array<double, 3> df = {fade_slope(cell.t[0]), fade_slope(cell.t[1]),
                                    fade_slope(cell.t[2])};
  NoiseSlope result;
  for (std::size_t c = 0; c < 8; ++c) {
    std::array<double, 3> weight = {};
    std::array<double, 3> change = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool high = (c >> axis & 1) != 0;
      weight[axis] = high ? f[axis] : 1 - f[axis];
      change[axis] = high ? df[axis] : -df[axis];
    }
    const double all = weight[0] * weight[1] * weight[2];
    result.value += all * cell.dot[c];
    result.slope += all * *cell.gradient[c];
    result.slope += cell.dot[c] * Eigen::Vector3d(change[0] * weight[1] * weight[2],
                                                  weight[0] * change[1] * weight[2],
                                                  weight[0] * weight[1] * change[2]);
  }
  return result;
}

}  // namespace minescan
