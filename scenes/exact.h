// SPDX-License-Identifier: MIT
// Scenes of flat and round faces with sharp edges, whose ranges, volume and area are known exactly.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "scenes/scene.h"

namespace minescan {

/// An empty box: volume l w h, area 2 (l w + w h + h l).
struct BoxOptions {
  MeshOptions mesh = {.edge_length = 0.2};
  double length = 20;
  double width = 10;
  double height = 6;
};

template <class Visitor>
void fields(BoxOptions& o, Visitor&& field) {
  fields(o.mesh, field);
  field("length", o.length, between(1, 500), "m", "size along x");
  field("width", o.width, between(1, 500), "m", "size along y");
  field("height", o.height, between(1, 100), "m", "size along z");
}

/// Centred on the z axis, the floor at z = 0.
Scene make_box(const BoxOptions& options, std::uint64_t seed);

/// A tunnel of circular section along x with flat ends: volume pi r^2 l, area 2 pi r (r + l).
struct CylinderOptions {
  MeshOptions mesh = {.edge_length = 0.1};
  double length = 20;
  double radius = 3;
};

template <class Visitor>
void fields(CylinderOptions& o, Visitor&& field) {
  fields(o.mesh, field);
  field("length", o.length, between(1, 500), "m", "size along x");
  field("radius", o.radius, between(0.5, 50), "m", "of the section");
}

/// Centred on the z axis, its lowest line at z = 0.
Scene make_cylinder(const CylinderOptions& options, std::uint64_t seed);

/// A corridor with one bend to the left: two straight legs of rectangular section. With legs of
/// lengths a and b along their middles up to the bend, volume (a + b) w h and area
/// 2 (a + b) w + 2 (a + b + w) h.
struct CorridorOptions {
  MeshOptions mesh = {.edge_length = 0.1};
  double first_length = 12;
  double second_length = 8;
  double width = 3;
  double height = 2.5;
};

template <class Visitor>
void fields(CorridorOptions& o, Visitor&& field) {
  fields(o.mesh, field);
  field("first-length", o.first_length, between(1, 500), "m", "from the start to the bend");
  field("second-length", o.second_length, between(1, 500), "m", "from the bend to the end");
  field("width", o.width, between(0.5, 50), "m", "wall to wall");
  field("height", o.height, between(0.5, 50), "m", "floor to ceiling");
}

/// The first leg runs along x with its middle line at y = 0 and ends at the bend at the origin, the
/// second from there along y; the floor at z = 0. Both legs reach half a width beyond the bend.
Scene make_corridor(const CorridorOptions& options, std::uint64_t seed);

/// A square room whose floor has two crossed grooves: a plane slides on a plane, and only the
/// grooves lock them, as a key a lock (the incised planes of Gelfand et al. 2003). Volume s^2 h +
/// (2 g - w) w d with side s, height h and grooves of length g, width w and depth d; area
/// 2 s^2 + 4 s h + 4 g d.
struct IncisedPlanesOptions {
  MeshOptions mesh = {.edge_length = 0.05};
  double side = 12;
  double height = 5;
  double groove_length = 8;
  double groove_width = 0.4;
  double groove_depth = 0.2;
};

template <class Visitor>
void fields(IncisedPlanesOptions& o, Visitor&& field) {
  fields(o.mesh, field);
  field("side", o.side, between(2, 100), "m", "of the room");
  field("height", o.height, between(1, 50), "m", "floor to ceiling");
  field("groove-length", o.groove_length, between(0.5, 100), "m", "of each groove");
  field("groove-width", o.groove_width, between(0.05, 5), "m", "of each groove");
  field("groove-depth", o.groove_depth, between(0.02, 5), "m", "below the floor");
}

/// Centred on the z axis, the floor at z = 0, the grooves along the diagonals. Throws
/// std::invalid_argument for grooves that do not fit into the floor.
Scene make_incised_planes(const IncisedPlanesOptions& options, std::uint64_t seed);

}  // namespace minescan
