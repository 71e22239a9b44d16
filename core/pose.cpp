// SPDX-License-Identifier: MIT
#include "core/pose.h"

#include <cmath>
#include <stdexcept>

#include "core/text.h"

namespace minescan {

PoseError pose_error(const Pose& truth, const Pose& estimate) {
  const Eigen::Matrix3d difference = truth.linear().transpose() * estimate.linear();
  // AngleAxis goes through a quaternion and atan2; acos of the trace loses half the digits near 0.
  return {(truth.translation() - estimate.translation()).norm(),
          Eigen::AngleAxisd(difference).angle()};
}

Pose displaced(const Pose& truth, const Eigen::Vector3d& offset, const Eigen::Vector3d& axis,
               double angle) {
  return truth * Eigen::Translation3d(offset) * Eigen::AngleAxisd(angle, axis.normalized());
}

Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& omega) {
  const double angle = omega.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix();
}

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Pose normalized(const Pose& pose) {
  return Eigen::Translation3d(pose.translation()) * Eigen::Quaterniond(pose.linear()).normalized();
}

std::string pose_text(const Pose& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const Eigen::Vector3d t = pose.translation();
  std::string text;
  for (double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    if (!text.empty()) text += ',';
    text += number_text(value);
  }
  return text;
}

Pose parse_pose(std::string_view text) {
  const std::vector<double> values = parse_numbers(text);
  if (values.size() != 7)
    throw std::invalid_argument("expected a pose tx,ty,tz,qx,qy,qz,qw of 7 numbers, found " +
                                std::to_string(values.size()) + " in '" + std::string(text) + "'");
  const Eigen::Quaterniond q(values[6], values[3], values[4], values[5]);
  if (!(std::abs(q.norm() - 1) <= 1e-3))
    throw std::invalid_argument("expected a unit quaternion qx,qy,qz,qw, found length " +
                                number_text(q.norm()) + " in '" + std::string(text) + "'");
  return Eigen::Translation3d(values[0], values[1], values[2]) * q.normalized();
}

Pose pose_from_matrix(const std::vector<double>& row_major) {
  if (row_major.size() != 16 && row_major.size() != 12)
    throw std::invalid_argument("expected a 4 x 4 matrix of 16 numbers, found " +
                                std::to_string(row_major.size()));
  Eigen::Matrix3d linear;
  Eigen::Vector3d translation;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      linear(row, column) = row_major[static_cast<std::size_t>(4 * row + column)];
    translation[row] = row_major[static_cast<std::size_t>(4 * row + 3)];
  }
  const double residual =
      (linear.transpose() * linear - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(residual <= 1e-3 && linear.determinant() > 0))
    throw std::invalid_argument(
        "expected a rotation in the upper left 3 x 3 of the matrix; R^T R "
        "differs from the identity by " +
        number_text(residual));
  return Eigen::Translation3d(translation) * Eigen::Quaterniond(linear).normalized();
}

}  // namespace minescan
