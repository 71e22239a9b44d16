// SPDX-License-Identifier: MIT
// The part of a validation that needs mines: their rock, distances in them, and what the scanners
// of the table see there.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sim/picture.h"
#include "sim/validation.h"

namespace minescan {

/// The relief of generated rock, and distances in a rough mine.
const std::vector<ValidationRow>& rock_rows();

/// One scan of a scanner in the mine it is meant for: what became of its beams, and pictures.
struct PresetScan {
  std::string scanner = {};
  std::string scene = {};
  std::vector<Finding> findings = {};
  Picture points = {};
  Picture grid = {};  // empty where beams lie on no grid
};

/// Scans with every row of scanners(), mine by mine, each handed to `take` when it is done.
void scan_presets(std::uint64_t seed, const std::function<void(const PresetScan&)>& take);

}  // namespace minescan
