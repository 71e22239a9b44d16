// SPDX-License-Identifier: MIT
// A plain tunnel, as in the paper's tunnel scans: only bumps and light fixtures hold two scans in
// place along it.
#pragma once

#include "scenes/mine.h"
#include "scenes/scene.h"

namespace minescan {

/// Sizes assumed; see JunctionOptions.
struct TunnelOptions {
  double edge_length = 0.05;
  double width = 10;
  double height = 6;
  bool fixtures = true;
  RockOptions rock = {};
};

template <class Visitor>
void fields(TunnelOptions& o, Visitor&& field) {
  field("edge-length", o.edge_length, edge_length_range, "m", "side of the contouring cubes");
  field("width", o.width, between(3, 20), "m", "width of the tunnel");
  field("height", o.height, between(2, 20), "m", "floor to ceiling");
  field("fixtures", o.fixtures, any_number, "", "light fixtures on the ceiling");
  fields(o.rock, field);
}

/// The tunnel runs along x from -40 to +44 m, so that its ends are out of reach of scanners at
/// (-2, 0, 2) and (2, 0, 2).
Scene make_tunnel(const TunnelOptions& options, std::uint64_t seed);

}  // namespace minescan
