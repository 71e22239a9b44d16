// SPDX-License-Identifier: MIT
// The function that 3D-NDT minimises, with its derivatives.
//
// Six parameters (tau, omega): t <- t + tau, R <- Exp(omega) R, derivatives at zero. The paper's
// own seven (a translation, an angle and an axis of free length) lose rank at angle 0 and let the
// length of the axis drift, so that the source is deformed; the paper names six as sufficient
// (section 3).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/pose.h"
#include "registration/ndt_grid.h"
#include "registration/search.h"

namespace minescan {

/// The term of one source point and one cell, written as in the literature. The derivatives are
/// exact; Score::hessian is as `curvature` says.
Score ndt_score(const NdtCell& cell, const Pose& T_target_source, const Eigen::Vector3d& point,
                Curvature curvature = Curvature::full);

/// The sum of the terms over `points` (source frame), each with the cell that it lies in: minus the
/// sum of the scaled densities (paper, eq. 6). Terms below e^-120 are left out of the value and the
/// derivatives alike. Smooth only while no point changes its cell.
///
/// The plain form: registration/ndt_sums.h does the same for many points at a time.
Score ndt_score(const NdtGrid& grid, const Pose& T_target_source,
                const std::vector<Eigen::Vector3d>& points, Curvature curvature = Curvature::full);

/// The same sum for any (R, t), with its derivatives for the matrix.
AffineScore ndt_affine_score(const NdtGrid& grid, const Pose& T_target_source,
                             const std::vector<Eigen::Vector3d>& points,
                             Curvature curvature = Curvature::full);

/// The value alone: equal to ndt_score(...).value to the last bit.
double ndt_value(const NdtGrid& grid, const Pose& T_target_source,
                 const std::vector<Eigen::Vector3d>& points);

/// How the points fix the pose, w being a point's density in its cell.
struct NdtInformation {
  /// The sum of w J^T C^-1 J, the Gauss-Newton part of the Hessian.
  Matrix6d gauss_newton = Matrix6d::Zero();
  /// The sum of w J^T n n^T J, n being the direction in which the cell is thinnest: what a surface
  /// holds, and that is all. Cells hold points along a wall as well, by their mere borders, so that
  /// the Hessian has full rank even on a plane.
  Matrix6d surface = Matrix6d::Zero();
  double weights = 0;  // the sum of w
  double squares = 0;  // the sum of w x'^T C^-1 x'
};
NdtInformation ndt_information(const NdtGrid& grid, const Pose& T_target_source,
                               const std::vector<Eigen::Vector3d>& points);

/// The covariance of the pose: the inverse of gauss_newton, scaled by how far the points really lie
/// from the means, relative to what the cells say (of points distributed as the cells say, weighted
/// by their densities, the mean of x'^T C^-1 x' is 3/2).
Matrix6d pose_covariance(const NdtInformation& information);

}  // namespace minescan
