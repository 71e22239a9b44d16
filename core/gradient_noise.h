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

/// What the noise in a cell of the lattice is made of: the gradients at its corners, unit vectors;
/// corner c at (i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)).
std::array<const Eigen::Vector3d*, 8> gradient_noise_corners(std::int64_t i, std::int64_t j,
                                                             std::int64_t k, std::uint64_t seed);

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

/// A number made of the corners of a lattice: equal for equal (i, j, k, seed), without order
/// otherwise.
std::uint64_t lattice_hash(std::int64_t i, std::int64_t j, std::int64_t k, std::uint64_t seed);

/// The same as a number in [0, 1).
inline double lattice_uniform(std::int64_t i, std::int64_t j, std::int64_t k, std::uint64_t seed) {
  return static_cast<double>(lattice_hash(i, j, k, seed) >> 11) * 0x1.0p-53;
}

}  // namespace minescan
