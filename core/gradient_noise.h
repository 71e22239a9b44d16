// SPDX-License-Identifier: MIT
// Gradient noise (Perlin 1985, 2002): a smooth random function of space, the same at one place for
// ever. What roughness is made of, in meshes and in what a scanner sees below their triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace minescan {

/// Noise on the unit lattice: mean 0, its variance and bounds below. Pure.
double gradient_noise(const Eigen::Vector3d& place, std::uint64_t seed);

/// Noise and its derivative.
struct NoiseSlope {
  double value = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};
NoiseSlope gradient_noise_slope(const Eigen::Vector3d& place, std::uint64_t seed);

/// What the noise is made of: unit vectors, of which each corner (i, j, k) of the lattice has the
/// one with the number lattice_hash(i, j, k, seed) & 255.
extern const std::array<Eigen::Vector3d, 256> noise_gradients;

/// Standard deviation over space. With unit gradients in all directions it is sqrt(8 I2) I0, where
/// I0 = int (1-s)^2 dt = 181/462 and I2 = int (1-s)^2 t^2 dt = 535/18018 for s = 6t^5 - 15t^4 +
/// 10t^3.
inline constexpr double gradient_noise_rms = 0.190943636788;
/// Largest value (cell centre, all gradients towards it): sqrt(3) / 2.
inline constexpr double gradient_noise_max = 0.8660254037845;
/// Largest slope: 2.7923, found numerically over the cell with the worst gradient at each corner.
inline constexpr double gradient_noise_steepest = 2.8;
/// Wavelength of its mean square frequency along a line, sqrt(E[n'^2] / E[n^2]) / (2 pi) = 0.4152
/// per spacing of the lattice (integrals over the cell as for the standard deviation).
inline constexpr double gradient_noise_wavelength = 1 / 0.41517;

/// Corners of a lattice before mixing; sums belong to sums of corners. Odd factors keep the corners
/// apart; any large ones do.
inline std::uint64_t lattice_sum(std::int64_t i, std::int64_t j, std::int64_t k) {
  return static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15 +
         static_cast<std::uint64_t>(j) * 0xc2b2ae3d27d4eb4f +
         static_cast<std::uint64_t>(k) * 0x165667b19e3779f9;
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
inline std::uint64_t mixed_bits(std::uint64_t h) {
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9;
  h = (h ^ (h >> 27)) * 0x94d049bb133111eb;
  return h ^ (h >> 31);
}

/// A number made of the corners of a lattice: equal for equal (i, j, k, seed), without order
/// otherwise.
inline std::uint64_t lattice_hash(std::int64_t i, std::int64_t j, std::int64_t k,
                                  std::uint64_t seed) {
  return mixed_bits(lattice_sum(i, j, k) + seed);
}

/// The same as a number in [0, 1).
inline double lattice_uniform(std::int64_t i, std::int64_t j, std::int64_t k, std::uint64_t seed) {
  return static_cast<double>(lattice_hash(i, j, k, seed) >> 11) * 0x1.0p-53;
}

}  // namespace minescan
