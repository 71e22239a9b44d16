// SPDX-License-Identifier: MIT
// What mines and the things in them are made of.
#pragma once

#include <cstdint>
#include <vector>

#include "core/cloud.h"

namespace minescan {

/// Index into mine_materials().
enum MaterialIndex : std::uint8_t {
  sandstone,
  concrete,
  gravel,
  fixture,
  wet_sandstone,
  water,
  steel,
  rubber,
  canvas,
  paint,
  bedded_sandstone,
};

/// All materials of a mine, without roughness. Reflectances at 785-905 nm. Dry rock, concrete and
/// gravel are typical values; those of things are assumed.
std::vector<Material> mine_materials();

}  // namespace minescan
