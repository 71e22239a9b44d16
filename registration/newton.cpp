// SPDX-License-Identifier: MIT
#include "registration/newton.h"

#include <Eigen/Eigenvalues>

namespace minescan {
namespace {

Vector6d lengths_to_parameters(double length) {
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>() /= length;
  return scale;
}

}  // namespace

Vector6d newton_step(const Vector6d& gradient, const Matrix6d& hessian, double length,
                     double max_step, Repair repair) {
  const Vector6d scale = lengths_to_parameters(length);
  const Vector6d g = scale.cwiseProduct(gradient);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scale.asDiagonal() * hessian *
                                                       scale.asDiagonal());

  // Far from the solution the Hessian is indefinite and a plain Newton step leads uphill. Shifting
  // all eigenvalues keeps the eigenvectors; the two limits are assumed (the paper gives no repair).
  Vector6d eigenvalues = solver.eigenvalues();
  const double largest = eigenvalues.cwiseAbs().maxCoeff();
  if (repair == Repair::absolute)
    eigenvalues = eigenvalues.cwiseAbs().cwiseMax(1e-6 * largest);
  else if (eigenvalues[0] < 1e-6 * largest)
    eigenvalues.array() += 1e-4 * largest - eigenvalues[0];

  const Matrix6d& V = solver.eigenvectors();
  const Vector6d along = V.transpose() * g;
  Vector6d step = -(V * along.cwiseQuotient(eigenvalues));
  if (!(step.dot(g) < 0)) step = -g;  // a Hessian of zeros, or rounding
  step = scale.cwiseProduct(step);
  const double norm = step.norm();
  return norm > max_step ? Vector6d(step * (max_step / norm)) : step;
}

Pose stepped(const Pose& pose, const Vector6d& step) {
  Pose moved = pose;
  moved.translation() += step.head<3>();
  moved.linear() = rotation_exp(step.tail<3>()) * pose.linear();
  return moved;
}

}  // namespace minescan
