// SPDX-License-Identifier: MIT
#include "scenes/junction.h"

namespace minescan {

Scene make_junction(const JunctionOptions& options, std::uint64_t seed) {
  Mine mine;
  mine.rock = options.rock;
  mine.drifts = {
      {.from = {-18, 0},
       .to = {12, 0},
       .width = options.width,
       .height = options.height,
       .end_to = End::concrete},
      {.from = {5, 0}, .to = {5, 17}, .width = options.side_width, .height = options.height}};
  if (options.fixtures)
    for (const double x : {-13.5, -7.5, -1.5, 4.5})
      mine.fixtures.push_back({.centre = {x, 1}, .bottom = options.height - fixture_drop});
  return {.name = "junction", .mesh = mesh_of(mine, seed, options.edge_length)};
}

}  // namespace minescan
