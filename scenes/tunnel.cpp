// SPDX-License-Identifier: MIT
#include "scenes/tunnel.h"

namespace minescan {

Scene make_tunnel(const TunnelOptions& options, std::uint64_t seed) {
  Mine mine;
  mine.rock = options.rock;
  mine.drifts = {
      {.from = {-40, 0}, .to = {44, 0}, .width = options.width, .height = options.height}};
  if (options.fixtures)
    for (int i = 0; i < 11; ++i)  // every 7.5 m; assumed
      mine.fixtures.push_back(
          {.centre = {-36.5 + 7.5 * i, 1}, .bottom = options.height - fixture_drop});
  return {.name = "tunnel", .mesh = mesh_of(mine, seed, options.edge_length)};
}

}  // namespace minescan
