// SPDX-License-Identifier: MIT
// The rigid motion that best maps points onto given partners, in closed form.
#pragma once

#include <optional>
#include <vector>

#include "core/pose.h"

namespace minescan {

/// The pose that minimises the sum of |T * source[i] - target[i]|^2, by a singular value
/// decomposition (Arun et al. 1987, with Umeyama's sign so that reflections are never returned).
/// None if the points do not fix it: fewer than three, or all on one line.
///
/// weights  what each pair counts, not negative; all alike if empty
std::optional<Pose> align_svd(const std::vector<Eigen::Vector3d>& target,
                              const std::vector<Eigen::Vector3d>& source,
                              const std::vector<double>& weights = {});

/// The same by the unit quaternion of Horn 1987: an independent way for tests, and what the paper's
/// reference for ICP (Besl and McKay 1992) uses.
std::optional<Pose> align_quaternion(const std::vector<Eigen::Vector3d>& target,
                                     const std::vector<Eigen::Vector3d>& source,
                                     const std::vector<double>& weights = {});

}  // namespace minescan
