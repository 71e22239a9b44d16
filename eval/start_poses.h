// SPDX-License-Identifier: MIT
// Where the trials of one box of a figure start from: evenly spread directions of the position
// error, random axes of the rotation error.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/pose.h"

namespace minescan {

/// Point `index` of `count` on the unit sphere (Fibonacci lattice): z falls in equal steps, the
/// azimuth turns by the golden angle. For 100 points no two are closer than 17.8 degrees, where
/// independent random ones come as close as 1.3. 0 <= index < count.
Eigen::Vector3d lattice_direction(int index, int count);

/// The directions of one start pose, unit vectors in the source frame.
struct StartDirections {
  Eigen::Vector3d offset = Eigen::Vector3d::UnitX();  // of the position error
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();    // of the rotation error
};

/// Start `index` of `count`. The lattice as a whole is turned at random by the seed, so that no
/// direction of the scanner is privileged. Axes are drawn independently of the lattice and of each
/// other (a second lattice would be correlated with the first). Throws std::invalid_argument unless
/// 0 <= index < count.
StartDirections start_directions(int index, int count, std::uint64_t seed);

/// The pose `translation` metres and `rotation` radians (0 ... pi) away from `truth`. The same
/// index, count and seed give the same directions for all sizes of error.
Pose start_pose(const Pose& truth, int index, int count, std::uint64_t seed, double translation,
                double rotation);

}  // namespace minescan
