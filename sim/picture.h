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

/// The floor seen from above with the ceiling taken off (rays fall through the first surface that
/// they meet from behind), shaded; rock is dark. With a scale bar whose length is written beside
/// it. The longer side of the plan lies along the picture, which has about the stated width.
Picture plan_picture(const RayCaster& caster, int width);

/// What a lamp beside the eye shows: x of `T_world_camera` is the view direction, z up. `field` is
/// the horizontal angle of view in radians. With the scale: the distance to the surface in the
/// middle, and a bar of one metre's length there.
Picture inside_picture(const RayCaster& caster, const Pose& T_world_camera, double field, int width,
                       int height);

/// One above the other, centred.
Picture stacked(const Picture& above, const Picture& below);

}  // namespace minescan
