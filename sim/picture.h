// SPDX-License-Identifier: MIT
// Pictures of a mine, for people to look at: its plan and a view inside, cast by the same rays as
// scans.
#pragma once

#include <cstdint>
#include <vector>

#include "core/cloud.h"
#include "core/pose.h"
#include "sim/raycaster.h"

namespace minescan {

/// An image, rows from the top, 3 bytes (red, green, blue) per pixel.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb = {};
};

/// The floor seen from above with the ceiling taken off: rays fall through the surfaces that they
/// meet from behind and end at the first one met from the front below such; where there is none is
/// rock, dark, with a darker line along the walls. Lit from the upper left, slopes twice as steep
/// as they are, each material with a tint of its own. Below it a scale bar, the extents along x and
/// y and how these lie: the longer side of the plan lies along the picture, which is `width` wide.
/// Throws std::invalid_argument unless 1 <= width <= 16384. Four rays per pixel.
Picture plan_picture(const RayCaster& caster, int width);

/// What a lamp at the eye shows, helped by a little light from the upper left: x of
/// `T_world_camera` is the view direction, z up. `field` is the horizontal angle of view in
/// radians. With the scale: the distance to the surface in the middle, and a bar of one metre's
/// length there (or of a power of ten, where one metre is too long or too short for the picture),
/// none if there is no surface. Throws std::invalid_argument unless 1 <= width, height <= 16384 and
/// 0 < field < pi, or for a pose that is none. Four rays per pixel.
Picture inside_picture(const RayCaster& caster, const Pose& T_world_camera, double field, int width,
                       int height);

/// One above the other, centred. Throws std::invalid_argument if `rgb` of one does not fit its
/// size.
Picture stacked(const Picture& above, const Picture& below);

}  // namespace minescan
