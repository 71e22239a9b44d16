// SPDX-License-Identifier: MIT
// Scans and poses of 3DTK (the 3D Toolkit, formerly slam6D) in its "uos" format: scan000.3d with
// lines "x y z" and scan000.pose with "x y z" and "theta_x theta_y theta_z".
//
// Their frame is left-handed and in centimetres, x right, y up, z forward; ours is right-handed and
// in metres, x forward, y left, z up: x = z' / 100, y = -x' / 100, z = y' / 100 with theirs primed.
// Angles are degrees, and the rotation is Rx(theta_x) Ry(theta_y) Rz(theta_z) in their coordinates.
// Sources: 3DTK src/scanio/helper.cc (ScanDataTransform_xyz, readPoseHelper) and
// include/slam6d/globals.icc (EulerToMatrix4).
#pragma once

#include <string>
#include <string_view>

#include "core/pose.h"

namespace minescan {

/// T_world_scanner, metres and our axes, of the text of a .pose file. Throws std::runtime_error
/// "name:line: what" or "name: what" unless it is six finite numbers.
Pose parse_uos_pose(std::string_view text, const std::string& name);

/// The inverse of parse_uos_pose, up to a few roundings.
std::string print_uos_pose(const Pose& T_world_scanner);

}  // namespace minescan
