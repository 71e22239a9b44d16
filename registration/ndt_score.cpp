// SPDX-License-Identifier: MIT
#include "registration/ndt_score.h"

#include <cmath>

#include "registration/newton.h"

namespace minescan {
namespace {

// Below e^-120 a point has left its cell's reach for good; leaving it out also keeps exp away from
// numbers that are slow to calculate with.
constexpr double max_exponent = 120;

/// A point seen from the mean of a cell.
struct Seen {
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();  // C^-1
  Eigen::Vector3d y = Eigen::Vector3d::Zero();  // R x: turned, not shifted
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  // L x'
  double squared = 0;                           // x'^T L x'

  Seen(const NdtCell& cell, const Pose& T, const Eigen::Vector3d& point)
      : L(information_matrix(cell)), y(T.linear() * point) {
    const Eigen::Vector3d x = y + T.translation() - cell.mean;  // eq. 7
    v = L * x;
    squared = x.dot(v);
  }
  double density() const {  // eq. 4 with c = 1
    return squared / 2 < max_exponent ? std::exp(-squared / 2) : 0;
  }
  PointJacobian jacobian() const { return point_jacobian(y); }
};

}  // namespace

Score ndt_score(const NdtCell& cell, const Pose& T_target_source, const Eigen::Vector3d& point,
                Curvature curvature) {
  const Seen seen(cell, T_target_source, point);
  const double w = seen.density();
  const PointJacobian J = seen.jacobian();
  const Vector6d h = J.transpose() * seen.v;
  Score term{.value = -w, .gradient = w * h, .met = 1};  // eqs 6 and 8, one term
  term.hessian = w * (J.transpose() * seen.L * J);
  if (curvature == Curvature::gauss_newton) return term;
  Matrix6d S = Matrix6d::Zero();  // v^T times the second derivatives of x'
  S.bottomRightCorner<3, 3>() = (seen.v * seen.y.transpose() + seen.y * seen.v.transpose()) / 2;
  S.bottomRightCorner<3, 3>().diagonal().array() -= seen.v.dot(seen.y);
  term.hessian += w * (S - h * h.transpose());  // eq. 9
  return term;
}

Score ndt_score(const NdtGrid& grid, const Pose& T_target_source,
                const std::vector<Eigen::Vector3d>& points, Curvature curvature) {
  Score sum;
  for (const Eigen::Vector3d& p : points) {
    const NdtCell* const cell = grid.find(T_target_source * p);
    if (!cell) continue;
    const Score term = ndt_score(*cell, T_target_source, p, curvature);
    sum.value += term.value;
    sum.gradient += term.gradient;
    sum.hessian += term.hessian;
    ++sum.met;
  }
  return sum;
}

AffineScore ndt_affine_score(const NdtGrid& grid, const Pose& T_target_source,
                             const std::vector<Eigen::Vector3d>& points, Curvature curvature) {
  AffineScore sum;
  for (const Eigen::Vector3d& p : points) {
    const NdtCell* const cell = grid.find(T_target_source * p);
    if (!cell) continue;
    const Seen seen(*cell, T_target_source, p);
    const double w = seen.density();
    sum.value -= w;
    ++sum.met;
    // x' is linear in the matrix, so that its columns' derivatives are (x, 1) times the identity.
    const Eigen::Vector4d x = p.homogeneous();
    Eigen::Matrix3d M = w * seen.L;
    if (curvature == Curvature::full) M -= w * seen.v * seen.v.transpose();
    for (int a = 0; a < 4; ++a) {
      sum.gradient.segment<3>(3 * a) += w * x[a] * seen.v;
      for (int b = 0; b < 4; ++b) sum.hessian.block<3, 3>(3 * a, 3 * b) += x[a] * x[b] * M;
    }
  }
  return sum;
}

double ndt_value(const NdtGrid& grid, const Pose& T_target_source,
                 const std::vector<Eigen::Vector3d>& points) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points)
    if (const NdtCell* const cell = grid.find(T_target_source * p))
      sum -= Seen(*cell, T_target_source, p).density();
  return sum;
}

NdtInformation ndt_information(const NdtGrid& grid, const Pose& T_target_source,
                               const std::vector<Eigen::Vector3d>& points) {
  NdtInformation sum;
  for (const Eigen::Vector3d& p : points) {
    const NdtCell* const cell = grid.find(T_target_source * p);
    if (!cell) continue;
    const Seen seen(*cell, T_target_source, p);
    const double w = seen.density();
    const PointJacobian J = seen.jacobian();
    const Vector6d along_normal = J.transpose() * grid.normal(*cell);
    sum.gauss_newton += w * (J.transpose() * seen.L * J);
    sum.surface += w * along_normal * along_normal.transpose();
    sum.weights += w;
    sum.squares += w * seen.squared;
  }
  return sum;
}

Matrix6d pose_covariance(const NdtInformation& information) {
  return information.squares / (1.5 * information.weights) * information.gauss_newton.inverse();
}

}  // namespace minescan
