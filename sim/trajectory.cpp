// SPDX-License-Identifier: MIT
#include "sim/trajectory.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace minescan {
namespace {

Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

// d phi / dt = J^-1 w, where R = R0 exp(phi) and w is the angular velocity in the body frame.
Eigen::Matrix3d inverse_right_jacobian(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  // The closed form cancels to 1/12 near 0; of the series the next term is angle^4 / 30240.
  const double c = angle < 1e-3 ? 1.0 / 12 + angle * angle / 720
                                : 1 / (angle * angle) - 1 / (2 * angle * std::tan(angle / 2));
  const Eigen::Matrix3d k = skew(phi);
  return Eigen::Matrix3d::Identity() + k / 2 + c * k * k;
}

// The derivatives at all knots, from the mean rate and the duration of each piece between them.
std::vector<Eigen::Vector3d> knot_rates(const std::vector<Eigen::Vector3d>& mean,
                                        const std::vector<double>& duration) {
  const std::size_t pieces = mean.size();
  if (pieces == 1) return {mean[0], mean[0]};
  std::vector<Eigen::Vector3d> rates(pieces + 1);
  // How much the rate changes from the middle of piece i - 1 to that of piece i, per second.
  const auto change = [&](std::size_t i) -> Eigen::Vector3d {
    return 2 * (mean[i] - mean[i - 1]) / (duration[i - 1] + duration[i]);
  };
  for (std::size_t i = 1; i < pieces; ++i) rates[i] = mean[i - 1] + duration[i - 1] / 2 * change(i);
  rates[0] = mean[0] - duration[0] / 2 * change(1);
  rates[pieces] = mean[pieces - 1] + duration[pieces - 1] / 2 * change(pieces - 1);
  return rates;
}

}  // namespace

void check(const Trajectory& trajectory) {
  const auto& [times, poses] = trajectory;
  if (times.size() != poses.size())
    throw std::invalid_argument(
        fmt::format("trajectory: {} times for {} poses: expected as many of one as of the other",
                    times.size(), poses.size()));
  if (poses.size() < 2)
    throw std::invalid_argument(
        fmt::format("trajectory: expected two poses or more, found {}", poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!std::isfinite(times[i]))
      throw std::invalid_argument(
          fmt::format("trajectory: time {} = {} s: expected a finite number", i, times[i]));
    if (i > 0 && !(times[i] > times[i - 1]))
      throw std::invalid_argument(
          fmt::format("trajectory: time {} = {} s: expected more than the {} s before it", i,
                      times[i], times[i - 1]));
    const Eigen::Vector3d position = poses[i].translation();
    if (!position.allFinite())
      throw std::invalid_argument(
          fmt::format("trajectory: pose {} is at ({}, {}, {}): expected finite numbers", i,
                      position.x(), position.y(), position.z()));
    const Eigen::Matrix3d R = poses[i].linear();
    const double residual = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    // Assumed: far above what rounding does, far below what a beam shows.
    if (!(residual <= 1e-6))
      throw std::invalid_argument(fmt::format(
          "trajectory: pose {}: expected a rotation, R^T R differs from the identity by {}", i,
          residual));
    if (!(R.determinant() > 0))
      throw std::invalid_argument(
          fmt::format("trajectory: pose {}: expected a rotation, found a mirror image", i));
  }
}

SmoothPath::SmoothPath(const Trajectory& trajectory) : times_(trajectory.times) {
  check(trajectory);
  std::vector<Pose> poses;
  for (const Pose& pose : trajectory.poses) poses.push_back(normalized(pose));

  const std::size_t count = poses.size() - 1;
  std::vector<double> duration(count);
  std::vector<Eigen::Vector3d> turn(count);  // in the frame of either pose: it leaves itself alone
  std::vector<Eigen::Vector3d> velocity(count);
  std::vector<Eigen::Vector3d> turn_rate(count);
  for (std::size_t i = 0; i < count; ++i) {
    duration[i] = times_[i + 1] - times_[i];
    turn[i] = rotation_log(poses[i].linear().transpose() * poses[i + 1].linear());
    velocity[i] = (poses[i + 1].translation() - poses[i].translation()) / duration[i];
    turn_rate[i] = turn[i] / duration[i];
  }
  const std::vector<Eigen::Vector3d> v = knot_rates(velocity, duration);
  const std::vector<Eigen::Vector3d> w = knot_rates(turn_rate, duration);

  // Cubics with given values and derivatives at u = 0 and 1, the value at 0 taken off.
  const auto square = [](const Eigen::Vector3d& end, const Eigen::Vector3d& m0,
                         const Eigen::Vector3d& m1) -> Eigen::Vector3d {
    return 3 * end - 2 * m0 - m1;
  };
  const auto cube = [](const Eigen::Vector3d& end, const Eigen::Vector3d& m0,
                       const Eigen::Vector3d& m1) -> Eigen::Vector3d { return m0 + m1 - 2 * end; };
  for (std::size_t i = 0; i < count; ++i) {
    const double h = duration[i];
    Piece piece{.duration = h, .p0 = poses[i].translation(), .R0 = poses[i].linear()};
    const Eigen::Vector3d step = poses[i + 1].translation() - poses[i].translation();
    piece.p1 = h * v[i];
    piece.p2 = square(step, piece.p1, h * v[i + 1]);
    piece.p3 = cube(step, piece.p1, h * v[i + 1]);
    const Eigen::Vector3d end_rate = h * (inverse_right_jacobian(turn[i]) * w[i + 1]);
    piece.r1 = h * w[i];
    piece.r2 = square(turn[i], piece.r1, end_rate);
    piece.r3 = cube(turn[i], piece.r1, end_rate);
    pieces_.push_back(piece);
  }
}

Pose SmoothPath::at(double time) const {
  if (!(times_.front() <= time && time <= times_.back()))
    throw std::invalid_argument(fmt::format("time = {} s: expected one from {} s to {} s", time,
                                            times_.front(), times_.back()));
  const auto later = std::upper_bound(times_.begin() + 1, times_.end() - 1, time);
  const auto i = static_cast<std::size_t>(later - times_.begin()) - 1;
  const Piece& c = pieces_[i];
  const double u = (time - times_[i]) / c.duration;
  Pose T_world_body;
  T_world_body.translation() = c.p0 + u * (c.p1 + u * (c.p2 + u * c.p3));
  T_world_body.linear() = c.R0 * rotation_exp(u * (c.r1 + u * (c.r2 + u * c.r3)));
  T_world_body.makeAffine();
  return T_world_body;
}

}  // namespace minescan
