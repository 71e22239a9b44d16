// SPDX-License-Identifier: MIT
// Rigid transforms and the error between two of them.
//
// T_target_source maps coordinates: p_target = T_target_source * p_source. Inner names cancel:
// T_world_source = T_world_target * T_target_source.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

namespace minescan {

using Pose = Eigen::Isometry3d;

struct PoseError {
  double translation = 0;  // metres
  double rotation = 0;     // radians, in [0, pi]
};

/// How far `estimate` is from `truth`: both map the same source to the same target. The translation
/// is the distance between the two positions of the source origin (the scanner) in the target
/// frame.
PoseError pose_error(const Pose& truth, const Pose& estimate);

/// The pose `offset` metres and `angle` radians away from `truth`, so that
/// pose_error(truth, result) is {|offset|, angle}. `offset` and `axis` are in the source frame and
/// 0 <= angle <= pi. Turning happens about the source origin (the scanner); about the target
/// origin, turning would move the scanner as well.
Pose displaced(const Pose& truth, const Eigen::Vector3d& offset, const Eigen::Vector3d& axis,
               double angle);

/// Rotation by |omega| radians about omega / |omega| (Rodrigues); the identity for omega = 0.
Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& omega);

/// The matrix of v x (.): skew(v) * w == v.cross(w).
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// `pose` with its linear part made a rotation again (nearest, by its quaternion): products of many
/// increments drift from orthogonality by about 1e-16 each.
Pose normalized(const Pose& pose);

/// "tx,ty,tz,qx,qy,qz,qw", metres and a unit quaternion with w >= 0, in shortest digits that read
/// back to the same doubles.
std::string pose_text(const Pose& pose);

/// The inverse of pose_text. Throws std::invalid_argument unless there are 7 finite numbers of
/// which the last 4 have length 1 within 1e-3 (files with four digits are met); they are
/// normalised.
Pose parse_pose(std::string_view text);

/// The pose of 16 row-major numbers (or 12, the last row left out). Throws std::invalid_argument if
/// the linear part is not a rotation within 1e-3; within that it is replaced by the nearest one.
Pose pose_from_matrix(const std::vector<double>& row_major);

}  // namespace minescan
