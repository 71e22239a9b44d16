// SPDX-License-Identifier: MIT
// Room-and-pillar mines of any size: a grid of drifts that leaves pillars of rock between them.
#pragma once

#include <cstdint>

#include "scenes/mine.h"

namespace minescan {

/// Rooms and pillars of 8 to 12 m are usual in flat sandstone (assumed).
struct RoomAndPillarOptions {
  int rows = 4;
  int columns = 8;
  double spacing = 20;
  double width = 10;
  double height = 6;
  double jitter = 0.5;
  double gaps = 0.2;
  double dead_ends = 0.15;
  double dip = 0;
  bool furnished = true;
  RockOptions rock = {.wet_share = 0.1, .puddle_share = 0.03};
};

template <class Visitor>
void fields(RoomAndPillarOptions& o, Visitor&& field) {
  field("rows", o.rows, between(1, 500), "", "drifts along x");
  field("columns", o.columns, between(2, 500), "", "drifts along y");
  field("spacing", o.spacing, between(4, 100), "m", "from one drift to the next, middle to middle");
  field("width", o.width, between(2, 40), "m", "of the drifts");
  field("height", o.height, between(2, 20), "m", "floor to ceiling");
  field("jitter", o.jitter, between(0, 3), "m",
        "by how much crossings lie beside the grid, at most");
  field("gaps", o.gaps, between(0, 1), "", "part of the inner drifts between crossings not driven");
  field("dead-ends", o.dead_ends, between(0, 1), "",
        "part of the places at the border where a drift was begun and left");
  field("dip", o.dip, between(-0.2, 0.2), "", "slope of all floors, rising along x");
  field("furnished", o.furnished, "whether lights, bolts, pipes and so on are there");
  fields(o.rock, field);
}

/// The first crossing is at the origin, rows lie along x. The drifts around the border are all
/// there, and every crossing can be reached; which of the others are missing is drawn by `seed`.
/// Throws std::invalid_argument unless rock is left between the drifts.
Mine room_and_pillar(const RoomAndPillarOptions& options, std::uint64_t seed);

/// Where crossing (column, row) lies, floor level.
Eigen::Vector3d crossing(const RoomAndPillarOptions& options, std::uint64_t seed, int column,
                         int row);

}  // namespace minescan
