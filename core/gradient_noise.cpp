// SPDX-License-Identifier: MIT
#include "core/gradient_noise.h"

#include <array>
#include <cmath>
#include <numbers>

namespace minescan {
namespace {

/// Directions spread evenly over the sphere (Fibonacci lattice); noise picks among them by hash.
const std::array<Eigen::Vector3d, 256> unit_gradients = [] {
  std::array<Eigen::Vector3d, 256> directions = {};
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / 256;
    const double angle = 2 * std::numbers::pi * std::numbers::phi * static_cast<double>(i);
    const double r = std::sqrt(1 - z * z);
    directions[i] = {r * std::cos(angle), r * std::sin(angle), z};
  }
  return directions;
}();

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
    gradient = gradient_noise_corners(i, j, k, seed);
    for (std::size_t c = 0; c < 8; ++c) {
      const std::size_t a = c & 1, b = c >> 1 & 1, d = c >> 2;
      const Eigen::Vector3d& g = *gradient[c];
      dot[c] = g.x() * (t[0] - static_cast<double>(a)) + g.y() * (t[1] - static_cast<double>(b)) +
               g.z() * (t[2] - static_cast<double>(d));
    }
  }
};

}  // namespace

std::array<const Eigen::Vector3d*, 8> gradient_noise_corners(std::int64_t i, std::int64_t j,
                                                             std::int64_t k, std::uint64_t seed) {
  const std::uint64_t low = static_cast<std::uint64_t>(i) * step_x +
                            static_cast<std::uint64_t>(j) * step_y +
                            static_cast<std::uint64_t>(k) * step_z + seed;
  std::array<const Eigen::Vector3d*, 8> gradients = {};
  for (std::size_t c = 0; c < 8; ++c)
    gradients[c] =
        &unit_gradients[mixed(low + (c & 1) * step_x + (c >> 1 & 1) * step_y + (c >> 2) * step_z) &
                        255];
  return gradients;
}

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

std::uint64_t lattice_hash(std::int64_t i, std::int64_t j, std::int64_t k, std::uint64_t seed) {
  return mixed(static_cast<std::uint64_t>(i) * step_x + static_cast<std::uint64_t>(j) * step_y +
               static_cast<std::uint64_t>(k) * step_z + seed);
}

}  // namespace minescan
