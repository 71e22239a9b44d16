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

template <class Vector, class Matrix>
Vector scaled_step(const Vector& gradient, const Matrix& hessian, const Vector& scale,
                   double max_step, Repair repair) {
  const Vector g = scale.cwiseProduct(gradient);
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(scale.asDiagonal() * hessian *
                                                     scale.asDiagonal());

  // Far from the solution the Hessian is indefinite and a plain Newton step leads uphill. Shifting
  // all eigenvalues keeps the eigenvectors; the two limits are assumed (the paper gives no repair).
  Vector eigenvalues = solver.eigenvalues();
  const double largest = eigenvalues.cwiseAbs().maxCoeff();
  if (repair == Repair::absolute)
    eigenvalues = eigenvalues.cwiseAbs().cwiseMax(1e-6 * largest);
  else if (eigenvalues[0] < 1e-6 * largest)
    eigenvalues.array() += 1e-4 * largest - eigenvalues[0];

  const Matrix& V = solver.eigenvectors();
  const Vector along = V.transpose() * g;
  Vector step = -(V * along.cwiseQuotient(eigenvalues));
  if (!(step.dot(g) < 0)) step = -g;  // a Hessian of zeros, or rounding
  step = scale.cwiseProduct(step);
  const double norm = step.norm();
  return norm > max_step ? Vector(step * (max_step / norm)) : step;
}

template <int size>
Parameters sized_step(const ParameterScore& score, const Parameters& scale, double max_step,
                      Repair repair) {
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;
  return scaled_step(Vector(score.gradient), Matrix(score.hessian), Vector(scale), max_step,
                     repair);
}

}  // namespace

Vector6d newton_step(const Vector6d& gradient, const Matrix6d& hessian, double length,
                     double max_step, Repair repair) {
  return scaled_step(gradient, hessian, lengths_to_parameters(length), max_step, repair);
}

Parameters newton_step(const ParameterScore& score, const Parameters& scale, double max_step,
                       Repair repair) {
  switch (score.gradient.size()) {
    case 3:
      return sized_step<3>(score, scale, max_step, repair);
    case 6:
      return sized_step<6>(score, scale, max_step, repair);
    default:
      return sized_step<7>(score, scale, max_step, repair);
  }
}

Pose stepped(const Pose& pose, const Vector6d& step) {
  Pose moved = pose;
  moved.translation() += step.head<3>();
  moved.linear() = rotation_exp(step.tail<3>()) * pose.linear();
  return moved;
}

}  // namespace minescan
