// SPDX-License-Identifier: MIT
// The search of methods that pair every source point with a quadratic function on the target: pairs
// are found anew after every step.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "core/pose.h"
#include "registration/bounds.h"
#include "registration/result.h"
#include "registration/search.h"

namespace minescan {

/// F(x) = (x - centre)^T A (x - centre) + 2 b . (x - centre) + c, in the target frame.
struct Quadric {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  double operator()(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d d = x - centre;
    return d.dot(A * d + 2 * b) + c;
  }
};

/// A source point and what it is to make small.
struct QuadraticPair {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // source frame
  Quadric quadric = {};
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of the target's surface there
  double weight = 1;
};

/// Half the sum of w F(T p) over fixed pairs.
Score quadratic_score(const std::vector<QuadraticPair>& pairs, const Pose& T_target_source,
                      Curvature curvature);

/// What the surfaces of pairs hold: the sum of w J^T n n^T J, J being the derivative of T p.
Matrix6d held_by(const std::vector<QuadraticPair>& pairs, const Pose& T_target_source);

/// Overwrites the list with the pairs at a pose; returns how many source points have one.
using FindPairs =
    std::function<std::size_t(const Pose& T_target_source, std::vector<QuadraticPair>& pairs)>;

/// How a step (tau, omega) moves the pose.
enum class Motion {
  separate,  // t <- t + tau, R <- Exp(omega) R
  screw,     // points go on along the helix that they begin with the velocity tau + omega x y
};

/// `pose` moved by the screw motion whose velocity at a point p is tau + omega x (p - t), t being
/// the translation of `pose`: the exponential of that twist.
Pose screwed(const Pose& pose, const Vector6d& step);

/// Finds pairs and takes one step of `search` with them, again and again, from the pose of the
/// result. After a step back against the one before, steps are at most half as long as that: pairs
/// that come and go would keep the pose going around for ever. Ends with the status no_overlap when
/// fewer than `needed` points have a pair, converged when a step is below stop_step or nothing
/// lower is found along it, else max_iterations. Sets pose, iterations, evaluations and status;
/// returns the pairs at the last pose, and how many points have one.
struct PairsAtEnd {
  std::vector<QuadraticPair> pairs = {};
  std::size_t met = 0;
};
PairsAtEnd step_and_pair(const FindPairs& find, double needed, double length, Motion motion,
                         const SearchOptions& search, RegistrationResult& result);

/// Directions, and unless they make the result degenerate (the first held less than min_rank) the
/// score, which is the weighted mean of F, and the covariance s^2 (sum of J^T A J)^-1, s^2 being a
/// third of the score: as optimistic as that of register_icp; zero if the score is not positive.
void conclude(const std::vector<QuadraticPair>& pairs, const Matrix6d& held, double length,
              double min_rank, RegistrationResult& result);

/// Sets empty_points and outside_points: those of which are outside `box`.
void count_unmet(const std::vector<Eigen::Vector3d>& points, std::size_t met, const Bounds& box,
                 RegistrationResult& result);

}  // namespace minescan
