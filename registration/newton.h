// SPDX-License-Identifier: MIT
// One step of Newton's method for a pose, where the Hessian may be anything.
#pragma once

#include "core/pose.h"
#include "registration/search.h"

namespace minescan {

/// The step (tau, omega) towards lower values: -H^-1 g, with H made positive definite first.
///
/// length    metres by which omega is multiplied, so that all six unknowns are lengths and the
///           eigenvalues of H can be compared
/// max_step  the step is shortened to this norm (metres and radians mixed; paper, section 5)
/// returns   a descent direction: gradient.dot(step) < 0 unless the gradient is zero
Vector6d newton_step(const Vector6d& gradient, const Matrix6d& hessian, double length,
                     double max_step, Repair repair = Repair::shift);

/// The same for 3, 6 or 7 parameters that are scaled by `scale` each before they are compared:
/// for the pose, 1 for tau and 1 / length for omega.
Parameters newton_step(const ParameterScore& score, const Parameters& scale, double max_step,
                       Repair repair = Repair::shift);

/// How a point moves with (tau, omega): [I | -[y]x], y being the point turned but not shifted.
using PointJacobian = Eigen::Matrix<double, 3, 6>;
inline PointJacobian point_jacobian(const Eigen::Vector3d& y) {
  PointJacobian J;
  J << Eigen::Matrix3d::Identity(), -skew(y);
  return J;
}

/// `pose` moved by a step: t <- t + tau, R <- Exp(omega) R.
Pose stepped(const Pose& pose, const Vector6d& step);

}  // namespace minescan
