// SPDX-License-Identifier: MIT
// Functions of many numbers at once, with the widest instructions that the processor has (chosen
// when the program runs). Single precision; the same bits on one kind of processor, between kinds
// within the stated errors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace minescan {

/// Numbers that are worked on together; arrays have room for a multiple of this.
inline constexpr std::size_t lanes = 16;
using Lanes = std::array<float, lanes>;

/// sine[i] and cosine[i] of angle[i], radians, |angle[i]| <= 10000; error up to 2e-7 + 1e-7
/// |angle|.
void sine_cosine(const float* angle, float* sine, float* cosine, std::size_t count);

/// The angle of (x[i], y[i]) in (-pi, pi], 0 for (0, 0); error up to 5e-7.
void arc_tangent(const float* y, const float* x, float* angle, std::size_t count);

/// The angle in [0, pi] whose cosine is x[i]; error up to 5e-7.
void arc_cosine(const float* x, float* angle, std::size_t count);

/// exp(x[i]) - 1 for x[i] in [-80, 80]; relative error up to 5e-7.
void exponential_minus_1(const float* x, float* result, std::size_t count);

/// Four independent standard normal numbers for each of 16 streams: number j of stream i is
/// result[j][i]. Of block `block` of Random(seed, streams[i]), by Box and Muller's method, with
/// uniform numbers of 24 bits, so that none is beyond 5.9 sigma.
void four_normals(std::uint64_t seed, const std::array<std::uint64_t, lanes>& streams,
                  std::uint64_t block, std::array<Lanes, 4>& result);

/// Rays and the triangles that they meet; [0], [1], [2] are x, y, z.
struct TriangleHits {
  using Doubles = std::array<double, lanes>;
  std::array<Lanes, 3> a, b, c;              // corners
  std::array<Doubles, 3> origin, direction;  // direction: unit
  std::array<Doubles, 3> normal;             // result: unit, on the side that the ray came from
  Doubles range, cosine;  // result: to the triangle's plane, and of the incidence
};
void meet_planes(TriangleHits& hits);

/// Hits on a surface with relief, which FineRelief tells of.
struct ReliefHits {
  using Doubles = TriangleHits::Doubles;
  std::array<std::array<double, 3>, 3> to_lattice;  // rows; world to lattice of the noise
  double height;                                    // metres per unit of noise
  double reach;                                     // metres along the beam
  std::uint64_t seed;
  std::array<Doubles, 3> place, direction;  // where the ray met the triangle; unit
  std::array<Doubles, 3> normal;            // of the triangle; becomes that of the relief
  Doubles cosine;                           // likewise
  Doubles shift;                            // result: the range becomes longer by this
};
void apply_relief(ReliefHits& hits);

}  // namespace minescan
