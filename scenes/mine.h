// SPDX-License-Identifier: MIT
// A mine as data: drifts with flat roofs in one plane, as rooms and tunnels of a room-and-pillar
// mine are, what hangs from the roof, and how rough the rock is. Scenes fill in a Mine; `mesh_of`
// makes the triangles.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "scenes/implicit.h"
#include "scenes/roughness.h"

namespace minescan {

enum class End { rock, concrete };

/// A straight drift of rectangular section, floor at z = 0. Drifts that overlap are one open space.
struct Drift {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  // on the axis, at the faces of both ends
  Eigen::Vector2d to = Eigen::Vector2d::UnitX();
  double width = 10;
  double height = 6;
  End end_from = End::rock;
  End end_to = End::rock;  // a cast concrete face is flat
};

/// A box hanging from the roof.
struct Fixture {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  // unit vector
  double length = 1.5;
  double width = 0.3;
  double bottom = 5.7;  // z of its lower side; it reaches up into the rock
};

/// Rock surfaces of a sandstone mine. The relief of the walls is assumed from joints in rock (self-
/// affine, Hurst exponents of 0.6-0.9 up to metres) and blasting overbreak; the roof follows the
/// bedding; the floor is a gravel road of class D to E of ISO 8608 (density ~ k^-2, so H = 0.5; 9.9
/// and 19.9 mm RMS over wavelengths of 0.35-10 m).
struct RockOptions {
  ReliefBand wall = {.rms = 0.07, .hurst = 0.75};
  ReliefBand ceiling = {.rms = 0.015, .hurst = 0.75};
  ReliefBand floor = {.rms = 0.015, .hurst = 0.5};
  double bedding_step = 0.04;  // assumed
  double bedding_plate = 2.5;  // assumed
  double corner_radius = 0.4;  // where faces meet; assumed
};

template <class Visitor>
void fields(RockOptions& o, Visitor&& field) {
  const Range rms = between(0, 0.5);
  const Range hurst = above_up_to(0, 1);
  const Range wavelength = between(0.01, 100);
  field("wall-rms", o.wall.rms, rms, "m", "relief of the walls, RMS over its band of wavelengths");
  field("wall-hurst", o.wall.hurst, hurst, "", "Hurst exponent of the walls");
  field("wall-inner", o.wall.inner, wavelength, "m", "shortest wavelength of the walls' relief");
  field("wall-outer", o.wall.outer, wavelength, "m", "longest wavelength of the walls' relief");
  field("ceiling-rms", o.ceiling.rms, rms, "m", "relief of the ceiling, without its bedding steps");
  field("ceiling-hurst", o.ceiling.hurst, hurst, "", "Hurst exponent of the ceiling");
  field("floor-rms", o.floor.rms, rms, "m", "relief of the floor");
  field("floor-hurst", o.floor.hurst, hurst, "", "Hurst exponent of the floor");
  field("bedding-step", o.bedding_step, rms, "m", "height of a bedding step of the ceiling");
  field("bedding-plate", o.bedding_plate, between(0.2, 50), "m",
        "size of the plates between steps");
  field("corner-radius", o.corner_radius, between(0, 2), "m",
        "rounding where walls, ceiling and floor meet");
}

/// How far light fixtures hang below the roof; assumed.
inline constexpr double fixture_drop = 0.3;

struct Mine {
  std::vector<Drift> drifts = {};
  std::vector<Fixture> fixtures = {};
  RockOptions rock = {};
};

/// The mine as a function of space, its relief drawn by `seed`; wavelengths below `finest` left
/// out. Throws std::invalid_argument for a mine without drifts or a drift without length, width or
/// height.
ImplicitSurface surface_of(const Mine& mine, std::uint64_t seed, double finest);

/// Sides of triangles that make sense: below 1 cm the relief has no more to show, above 2 m a drift
/// is no longer a drift.
inline constexpr Range edge_length_range = between(0.01, 2);

/// Its triangles; relief that they cannot show (below two edges) is left out.
TriangleMesh mesh_of(const Mine& mine, std::uint64_t seed, double edge_length);

}  // namespace minescan
