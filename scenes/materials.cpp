// SPDX-License-Identifier: MIT
#include "scenes/materials.h"

namespace minescan {

std::vector<Material> mine_materials() {
  return {
      {.name = "sandstone", .reflectance = 0.35},
      {.name = "concrete", .reflectance = 0.40},
      {.name = "gravel", .reflectance = 0.20},
      {.name = "fixture", .reflectance = 0.50},
      {.name = "wet-sandstone", .reflectance = 0.35, .wetness = 1},
      // A mirror: what little comes back is not enough for a range.
      {.name = "water", .reflectance = 0.02},
      {.name = "steel", .reflectance = 0.30},
      {.name = "rubber", .reflectance = 0.08},
      {.name = "canvas", .reflectance = 0.60},
      {.name = "paint", .reflectance = 0.80},
      {.name = "bedded-sandstone", .reflectance = 0.35},  // ceilings
  };
}

}  // namespace minescan
