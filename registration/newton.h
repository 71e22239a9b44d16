// SPDX-License-Identifier: MIT
// One step of Newton's method for a pose, where the Hessian may be anything.
#pragma once

#include "registration/ndt_score.h"

namespace minescan {

/// The step (tau, omega) towards lower values: -H^-1 g, with H made positive definite first.
///
/// length    metres by which omega is multiplied, so that all six unknowns are lengths and the
///           eigenvalues of H can be compared: the RMS distance of the points from the source
///           origin
/// max_step  the step is shortened to this norm (metres and radians mixed; paper, section 5)
/// returns   a descent direction: gradient.dot(step) < 0 unless the gradient is zero
Vector6d newton_step(const Vector6d& gradient, const Matrix6d& hessian, double length,
                     double max_step);

/// `hessian` in units of length for all six unknowns, as newton_step sees it.
Matrix6d scaled_hessian(const Matrix6d& hessian, double length);

/// Smallest / largest eigenvalue of a symmetric matrix; 0 if the largest is not positive.
double eigenvalue_quotient(const Matrix6d& symmetric);

/// `pose` moved by a step: t <- t + tau, R <- Exp(omega) R.
Pose stepped(const Pose& pose, const Vector6d& step);

}  // namespace minescan
