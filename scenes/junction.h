// SPDX-License-Identifier: MIT
// The end of a tunnel with a side passage, as in the paper's junction scan.
#pragma once

#include "scenes/mine.h"
#include "scenes/scene.h"

namespace minescan {

/// Sizes are assumed such that a scan spans about 10 x 30 m (paper, section 5.1) under a roof 6 m
/// high.
struct JunctionOptions {
  double edge_length = 0.05;
  double width = 10;
  double side_width = 8;
  double height = 6;
  bool fixtures = true;
  RockOptions rock = {};
};

template <class Visitor>
void fields(JunctionOptions& o, Visitor&& field) {
  field("edge-length", o.edge_length, edge_length_range, "m", "side of the contouring cubes");
  field("width", o.width, between(3, 20), "m", "width of the tunnel");
  field("side-width", o.side_width, between(2, 12), "m", "width of the side passage");
  field("height", o.height, between(2, 20), "m", "floor to ceiling");
  field("fixtures", o.fixtures, any_number, "", "light fixtures on the ceiling");
  fields(o.rock, field);
}

/// The tunnel runs along x from -18 m to a flat concrete face at +12 m; the side passage leaves
/// towards +y. A scanner stands at about (0, 0, 2).
Scene make_junction(const JunctionOptions& options, std::uint64_t seed);

}  // namespace minescan
