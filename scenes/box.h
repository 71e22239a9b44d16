// SPDX-License-Identifier: MIT
// An empty box with flat faces: ranges, volume and area are known exactly, for tests.
#pragma once

#include "scenes/mine.h"
#include "scenes/scene.h"

namespace minescan {

struct BoxOptions {
  double edge_length = 0.2;
  double length = 20;
  double width = 10;
  double height = 6;
};

template <class Visitor>
void fields(BoxOptions& o, Visitor&& field) {
  field("edge-length", o.edge_length, edge_length_range, "m", "side of the contouring cubes");
  field("length", o.length, between(1, 500), "m", "size along x");
  field("width", o.width, between(1, 500), "m", "size along y");
  field("height", o.height, between(1, 100), "m", "size along z");
}

/// Centred on the z axis, the floor at z = 0. Its edges are cut by at most edge_length; the seed
/// changes nothing.
Scene make_box(const BoxOptions& options, std::uint64_t seed);

}  // namespace minescan
