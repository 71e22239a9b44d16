// SPDX-License-Identifier: MIT
#include "registration/pose_parameters.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace minescan {
namespace {

Eigen::Matrix3d unit_skew(int axis) { return skew(Eigen::Vector3d::Unit(axis)); }

/// sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 with a^2 = q, for first = 1, 2, 3: the sum of
/// (-q)^k / (2k + first)!; or its derivative for q, once or twice. Term 30 is below rounding for
/// a <= 10, the longest step.
double rotation_series(int first, double q, int derivative) {
  double factorial = 1;
  for (int i = 2; i <= first; ++i) factorial *= i;
  double sum = 0, power = 1;  // power: q^(k - derivative)
  for (int k = 0; k < 30 + derivative; ++k) {
    double factor = k % 2 == 0 ? 1 : -1;
    for (int i = 0; i < derivative; ++i) factor *= k - i;
    if (k > derivative) power *= q;
    sum += factor * power / factorial;
    factorial *= (2 * k + first + 1.0) * (2 * k + first + 2.0);
  }
  return sum;
}

/// c I + s [r]x + (1 - c) r r^T, eq. 13.
Eigen::Matrix3d axis_angle_matrix(const Eigen::Vector3d& r, double phi) {
  const double c = std::cos(phi), s = std::sin(phi);
  return c * Eigen::Matrix3d::Identity() + s * skew(r) + (1 - c) * r * r.transpose();
}

Eigen::Matrix3d turn_about(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

/// Rx(a) Ry(b) Rz(c), differentiated `orders` times for each.
Eigen::Matrix3d euler_matrix(const Eigen::Vector3d& angles, const std::array<int, 3>& orders = {}) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    R *= turn_about(axis, angles[axis]);
    for (int i = 0; i < orders[static_cast<std::size_t>(axis)]; ++i) R *= unit_skew(axis);
  }
  return R;
}

/// The angles of euler_matrix. Where b = +-pi/2, a is one of many that are right.
Eigen::Vector3d euler_angles(const Eigen::Matrix3d& R) {
  const double a = std::atan2(-R(1, 2), R(2, 2));
  const Eigen::Matrix3d rest = turn_about(0, -a) * R;  // Ry(b) Rz(c)
  return {a, std::atan2(rest(0, 2), rest(2, 2)), std::atan2(rest(1, 0), rest(1, 1))};
}

bool is_about_pose(PoseForm form) {
  return form == PoseForm::local || form == PoseForm::twist || form == PoseForm::right;
}

/// The derivatives of R = Exp(theta), as I + A(q) K + B(q) K^2 with K = [theta]x, q = |theta|^2.
void rotation_vector_derivatives(const Eigen::Vector3d& theta, PoseDerivatives& d) {
  const double q = theta.squaredNorm();
  const Eigen::Matrix3d K = skew(theta), K2 = K * K;
  std::array<double, 3> A, B;
  for (int n = 0; n < 3; ++n) {
    A[static_cast<std::size_t>(n)] = rotation_series(1, q, n);
    B[static_cast<std::size_t>(n)] = rotation_series(2, q, n);
  }
  for (int i = 0; i < 3; ++i) {
    const Eigen::Matrix3d Ki = unit_skew(i), K2i = Ki * K + K * Ki;
    const double qi = 2 * theta[i];
    const auto I = static_cast<std::size_t>(3 + i);
    d.first[I].leftCols<3>() = A[1] * qi * K + A[0] * Ki + B[1] * qi * K2 + B[0] * K2i;
    for (int j = 0; j < 3; ++j) {
      const Eigen::Matrix3d Kj = unit_skew(j), K2j = Kj * K + K * Kj, K2ij = Ki * Kj + Kj * Ki;
      const double qj = 2 * theta[j], qij = i == j ? 2 : 0;
      d.second[I][static_cast<std::size_t>(3 + j)].leftCols<3>() =
          (A[2] * qi * qj + A[1] * qij) * K + A[1] * (qi * Kj + qj * Ki) +
          (B[2] * qi * qj + B[1] * qij) * K2 + B[1] * (qi * K2j + qj * K2i) + B[0] * K2ij;
    }
  }
}

/// Eqs 17 and 18, before they are applied to a point; `unit`: of r / |r| in place of r, at |r| = 1.
void axis_angle_derivatives(const Eigen::Vector3d& r, double phi, bool unit, PoseDerivatives& d) {
  const double c = std::cos(phi), s = std::sin(phi);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity(), K = skew(r), rr = r * r.transpose();
  const auto along = [&](const Eigen::Vector3d& e, double skewed, double symmetric) {
    return Eigen::Matrix3d(skewed * skew(e) + symmetric * (e * r.transpose() + r * e.transpose()));
  };
  const Eigen::Matrix3d P = unit ? Eigen::Matrix3d(I - rr) : I;  // d(r / |r|) / dr
  d.first[6].leftCols<3>() = -s * I + c * K + s * rr;
  d.second[6][6].leftCols<3>() = -c * I - s * K + c * rr;
  for (int i = 0; i < 3; ++i) {
    const auto n = static_cast<std::size_t>(3 + i);
    const Eigen::Vector3d e = P.col(i);
    d.first[n].leftCols<3>() = along(e, s, 1 - c);
    d.second[n][6].leftCols<3>() = along(e, c, s);
    d.second[6][n] = d.second[n][6];
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d f = P.col(j);
      Eigen::Matrix3d R_ij = (1 - c) * (e * f.transpose() + f * e.transpose());
      if (unit) {
        const Eigen::Vector3d bend =
            (3 * r[i] * r[j] - I(i, j)) * r - r[j] * I.col(i) - r[i] * I.col(j);
        R_ij += along(bend, s, 1 - c);
      }
      d.second[n][static_cast<std::size_t>(3 + j)].leftCols<3>() = R_ij;
    }
  }
}

/// |q|^2 R for q = (w, v), of any length: (w^2 - |v|^2) I + 2 w [v]x + 2 v v^T.
Eigen::Matrix3d quaternion_matrix(const Eigen::Vector4d& q) {
  const double w = q[0];
  const Eigen::Vector3d v = q.tail<3>();
  return (w * w - v.squaredNorm()) * Eigen::Matrix3d::Identity() + 2 * w * skew(v) +
         2 * v * v.transpose();
}

/// The derivatives of M(q) / |q|^2 at |q| = 1, M the quadratic form above: nothing along q.
void quaternion_derivatives(const Eigen::Vector4d& q, PoseDerivatives& d) {
  const auto e = [](int i) -> Eigen::Vector4d { return Eigen::Vector4d::Unit(i); };
  const auto M_ij = [&](int i, int j) -> Eigen::Matrix3d {
    return quaternion_matrix(e(i) + e(j)) - quaternion_matrix(e(i)) - quaternion_matrix(e(j));
  };
  const Eigen::Matrix3d M = quaternion_matrix(q);
  std::array<Eigen::Matrix3d, 4> M_i;
  for (int i = 0; i < 4; ++i) {
    Eigen::Matrix3d& first = M_i[static_cast<std::size_t>(i)] = Eigen::Matrix3d::Zero();
    for (int j = 0; j < 4; ++j) first += q[j] * M_ij(i, j);
  }
  for (int i = 0; i < 4; ++i) {
    const auto a = static_cast<std::size_t>(i);
    d.first[3 + a].leftCols<3>() = M_i[a] - 2 * q[i] * M;
    for (int j = 0; j < 4; ++j) {
      const auto b = static_cast<std::size_t>(j);
      d.second[3 + a][3 + b].leftCols<3>() = M_ij(i, j) - 2 * (q[j] * M_i[a] + q[i] * M_i[b]) +
                                             (8 * q[i] * q[j] - (i == j ? 2 : 0)) * M;
    }
  }
}

}  // namespace

PoseParameters::PoseParameters(const Pose& start, const PoseOptions& options)
    : options_(options), base_(start) {
  if (!(options.start_axis.norm() > 0))
    throw std::invalid_argument("start-axis: expected a vector that is not zero, found " +
                                value_text(options.start_axis));
  options_.start_axis.normalize();
  values_ = Parameters::Zero(size());
  if (is_about_pose(options.form)) {
    if (options.stop_rule != StopRule::step)
      throw std::invalid_argument("stop-rule: pose " + value_text(options.form) +
                                  " is taken anew about every pose, where its norm is always 0; "
                                  "expected step");
    return;
  }
  if (options.form == PoseForm::planar) {
    values_.head<2>() = start.translation().head<2>();
    return;
  }
  values_.head<3>() = start.translation();
  if (options.form == PoseForm::euler) {
    values_.segment<3>(3) = euler_angles(start.linear());
    return;
  }
  if (options.form == PoseForm::quaternion) {
    const Eigen::Quaterniond q(start.linear());
    values_.tail<4>() << q.w(), q.x(), q.y(), q.z();
    values_.tail<4>().normalize();
    return;
  }
  const Eigen::AngleAxisd turn(start.linear());
  const bool turns = turn.angle() >= 1e-12;
  if (options.form == PoseForm::rotation_vector) {
    values_.segment<3>(3) = turn.angle() * turn.axis();
  } else {
    values_.segment<3>(3) = turns ? turn.axis() : options_.start_axis;
    values_[6] = turns ? turn.angle() : 0;
  }
}

int PoseParameters::size() const {
  if (options_.form == PoseForm::planar) return 3;
  return options_.form == PoseForm::axis_angle || options_.form == PoseForm::quaternion ? 7 : 6;
}

Pose PoseParameters::pose() const {
  if (is_about_pose(options_.form)) return base_;
  Pose T = base_;
  if (options_.form == PoseForm::planar) {
    T.translation().head<2>() = values_.head<2>();
    T.linear() = turn_about(2, values_[2]) * base_.linear();
    return T;
  }
  T.translation() = values_.head<3>();
  const Eigen::Vector3d r = values_.segment<3>(3);
  if (options_.form == PoseForm::euler)
    T.linear() = euler_matrix(r);
  else if (options_.form == PoseForm::quaternion)
    T.linear() = quaternion_matrix(values_.tail<4>());
  else if (options_.form == PoseForm::rotation_vector)
    T.linear() = rotation_exp(r);
  else
    T.linear() = axis_angle_matrix(r, values_[6]);
  return T;
}

Eigen::Vector3d PoseParameters::unit_axis() const {
  const Eigen::Vector3d r = values_.segment<3>(3);
  return r.norm() > 0 ? r.normalized() : options_.start_axis;
}

Pose PoseParameters::rigid_pose() const {
  Pose T = pose();
  if (options_.form == PoseForm::axis_angle)
    T.linear() = axis_angle_matrix(unit_axis(), values_[6]);
  return T;
}

PoseParameters PoseParameters::moved(const Parameters& step) const {
  PoseParameters to = *this;
  if (!is_about_pose(options_.form)) {
    to.values_ += step;
    if (options_.form == PoseForm::axis_angle && options_.renormalise)
      to.values_.segment<3>(3) = to.unit_axis();
    if (options_.form == PoseForm::quaternion) {
      // A step as long as the quaternion itself may lead to zero, which is no rotation: it then
      // stays as it was.
      const double length = to.values_.tail<4>().norm();
      if (length > 0)
        to.values_.tail<4>() /= length;
      else
        to.values_.tail<4>() = values_.tail<4>();
    }
    if (options_.form == PoseForm::rotation_vector) {
      // The same rotation by less than half a turn: derivatives vanish at a whole one.
      const double angle = to.values_.segment<3>(3).norm(), turn = 2 * std::numbers::pi;
      if (angle > std::numbers::pi) to.values_.segment<3>(3) *= std::remainder(angle, turn) / angle;
    }
    return to;
  }
  const Eigen::Vector3d tau = step.head<3>(), omega = step.tail<3>();
  const Eigen::Matrix3d turn = rotation_exp(omega);
  if (options_.form == PoseForm::twist) {
    const double q = omega.squaredNorm();
    const Eigen::Matrix3d K = skew(omega);
    to.base_.translation() =
        turn * base_.translation() + tau +
        (rotation_series(2, q, 0) * K + rotation_series(3, q, 0) * K * K) * tau;
  } else {
    to.base_.translation() += tau;
  }
  if (options_.form == PoseForm::right)
    to.base_.linear() = base_.linear() * turn;
  else
    to.base_.linear() = turn * base_.linear();
  return to;
}

PoseDerivatives PoseParameters::derivatives() const {
  PoseDerivatives d;
  const Pose T = pose();
  d.at = T.matrix().topRows<3>();
  for (PoseDerivatives::Matrix& m : d.first) m.setZero();
  for (auto& row : d.second)
    for (PoseDerivatives::Matrix& m : row) m.setZero();
  const bool planar = options_.form == PoseForm::planar;
  for (int i = 0; i < (planar ? 2 : 3); ++i) d.first[static_cast<std::size_t>(i)](i, 3) = 1;

  const Eigen::Matrix3d R = T.linear();
  if (planar) {
    d.first[2].leftCols<3>() = unit_skew(2) * R;
    d.second[2][2].leftCols<3>() = unit_skew(2) * unit_skew(2) * R;
  } else if (options_.form == PoseForm::rotation_vector) {
    rotation_vector_derivatives(values_.segment<3>(3), d);
  } else if (options_.form == PoseForm::axis_angle) {
    axis_angle_derivatives(values_.segment<3>(3), values_[6], options_.renormalise, d);
  } else if (options_.form == PoseForm::quaternion) {
    quaternion_derivatives(values_.tail<4>(), d);
  } else if (options_.form == PoseForm::euler) {
    for (std::size_t i = 0; i < 3; ++i) {
      std::array<int, 3> orders = {};
      ++orders[i];
      d.first[3 + i].leftCols<3>() = euler_matrix(values_.segment<3>(3), orders);
      for (std::size_t j = 0; j < 3; ++j) {
        ++orders[j];
        d.second[3 + i][3 + j].leftCols<3>() = euler_matrix(values_.segment<3>(3), orders);
        --orders[j];
      }
    }
  } else if (options_.form == PoseForm::twist) {
    // Exp(xi) = I + X + X^2 / 2 + ...
    std::array<Eigen::Matrix4d, 6> X;
    for (std::size_t i = 0; i < 6; ++i) {
      X[i].setZero();
      if (i < 3)
        X[i](static_cast<int>(i), 3) = 1;
      else
        X[i].topLeftCorner<3, 3>() = unit_skew(static_cast<int>(i) - 3);
      d.first[i] = (X[i] * T.matrix()).topRows<3>();
      for (std::size_t j = 0; j <= i; ++j)
        d.second[i][j] = d.second[j][i] =
            ((X[i] * X[j] + X[j] * X[i]) / 2 * T.matrix()).topRows<3>();
    }
  } else {
    for (int i = 0; i < 3; ++i) {
      const Eigen::Matrix3d Ki = unit_skew(i);
      const auto n = static_cast<std::size_t>(3 + i);
      const bool right = options_.form == PoseForm::right;
      d.first[n].leftCols<3>() = right ? Eigen::Matrix3d(R * Ki) : Eigen::Matrix3d(Ki * R);
      for (int j = 0; j < 3; ++j) {
        const Eigen::Matrix3d Kj = unit_skew(j), twice = (Ki * Kj + Kj * Ki) / 2;
        d.second[n][static_cast<std::size_t>(3 + j)].leftCols<3>() =
            right ? Eigen::Matrix3d(R * twice) : Eigen::Matrix3d(twice * R);
      }
    }
  }
  return d;
}

}  // namespace minescan
