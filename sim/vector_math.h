// SPDX-License-Identifier: MIT
// Functions of many numbers at once, with the widest instructions that the processor has (chosen
// when the program runs). Single precision; the same bits on one kind of processor, between kinds
// within the stated errors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sim/packet.h"

namespace minescan {

// Arrays of `count` have room for a multiple of `lanes`.

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

/// matrix * v in each lane, in double precision; the same bits on every processor.
void product(const MatrixLanes& matrix, const VectorLanes& v, VectorLanes& result);

/// The corners of triangles; [0], [1], [2] are x, y, z.
struct Corners {
  std::array<Lanes, 3> a, b, c;
};
/// Where rays meet the planes of triangles. Leaves the triangle numbers of `hits` alone.
void meet_planes(const RayPacket& rays, const Corners& corners, HitPacket& hits);

/// The relief of a surface, which FineRelief tells of.
struct ReliefNoise {
  std::array<std::array<double, 3>, 3> to_lattice = {};  // rows; world to lattice of the noise
  double height = 0;                                     // metres per unit of noise
  double reach = 0;                                      // metres along the beam
  std::uint64_t seed = 0;
};
/// Gives the chosen ones of `hits` the relief; `rays` are what met them. shift[i] becomes by how
/// much the range is longer then, metres.
void apply_relief(const ReliefNoise& relief, const RayPacket& rays,
                  const std::array<bool, lanes>& chosen, HitPacket& hits, DoubleLanes& shift);

}  // namespace minescan
