// SPDX-License-Identifier: MIT
#include "scenes/box.h"

namespace minescan {

Scene make_box(const BoxOptions& options, std::uint64_t seed) {
  Mine mine;
  mine.rock = {.wall = {.rms = 0},
               .ceiling = {.rms = 0},
               .floor = {.rms = 0},
               .bedding_step = 0,
               .corner_radius = 0};
  mine.drifts = {{.from = {-options.length / 2, 0},
                  .to = {options.length / 2, 0},
                  .width = options.width,
                  .height = options.height}};
  return {.name = "box", .mesh = mesh_of(mine, seed, options.edge_length)};
}

}  // namespace minescan
