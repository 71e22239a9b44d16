// SPDX-License-Identifier: MIT
// Poses over time, and the smooth path through them: where a scanner is while it turns its mirror.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/pose.h"

namespace minescan {

/// Where a body was at some times. Both arrays have the same length, 2 or more.
struct Trajectory {
  std::vector<double> times = {};  // seconds, each later than the one before
  std::vector<Pose> poses = {};    // T_world_body
};

/// Throws std::invalid_argument, naming the index and what was found there, unless there are two
/// poses or more, a finite time for each that is later than the one before, and each pose is
/// finite and a rotation within 1e-6.
void check(const Trajectory& trajectory);

/// The path through all poses of a trajectory whose velocity and angular velocity do not jump.
/// Built once, asked for every beam. Safe to ask from many threads at once.
///
/// Between two poses the position is the cubic with the positions and velocities at both ends
/// (Hermite). So is the rotation, written as a rotation vector seen from the earlier pose; the
/// angular velocity at the later one goes into its derivative through the inverse right Jacobian of
/// the exponential map (Barfoot, State Estimation for Robotics, 2017, chapter 7). The velocity
/// at a pose is that of the parabola through it and its two neighbours, at both ends of the path of
/// the nearest parabola, so the error shrinks with the third power of the time between poses.
class SmoothPath {
 public:
  /// Throws std::invalid_argument as `check` does. Between two poses the body turns by less than
  /// half a turn: of more, the poses do not tell the direction.
  explicit SmoothPath(const Trajectory& trajectory);

  /// T_world_body at `time`, seconds. Throws std::invalid_argument before the first and after the
  /// last time of the trajectory, and for NaN. O(log poses).
  Pose at(double time) const;

 private:
  // From one pose to the next, for u = 0 ... 1: p(u) = p0 + p1 u + p2 u^2 + p3 u^3, and the
  // rotation is R0 exp(r1 u + r2 u^2 + r3 u^3).
  struct Piece {
    double duration = 0;
    Eigen::Vector3d p0 = {}, p1 = {}, p2 = {}, p3 = {};
    Eigen::Matrix3d R0 = {};
    Eigen::Vector3d r1 = {}, r2 = {}, r3 = {};
  };

  std::vector<double> times_;  // one more than pieces
  std::vector<Piece> pieces_;
};

}  // namespace minescan
