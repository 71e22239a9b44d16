// SPDX-License-Identifier: MIT
// Laser scanners as plain numbers, and what one of them sees from one pose.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "sim/raycaster.h"

namespace minescan {

/// How the plane that the mirror sweeps is moved between two sweeps.
enum class Motion {
  yaw,    // a vertical plane turns about the vertical axis
  pitch,  // a plane across the view direction tilts about the left axis
};
constexpr auto names_of(Motion) { return std::to_array<std::string_view>({"yaw", "pitch"}); }

struct Scanner;  // the numbers: see below

/// Scans from T_world_scanner. Beam i draws its noise from stream i of `seed`, so the result does
/// not depend on the number of threads. `scene` is written into the result.
Scan scan(const RayCaster& caster, const Scanner& scanner, const Pose& T_world_scanner,
          std::uint64_t seed, const std::string& scene);

/// All scanners known by name.
const std::vector<Scanner>& scanners();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Scanner& find_scanner(const std::string& name);

}  // namespace minescan
