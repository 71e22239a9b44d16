// SPDX-License-Identifier: MIT
#include "registration/quadratic_pairs.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "registration/newton.h"
#include "registration/registered.h"

namespace minescan {
namespace {

/// The step that a pose is away from the identity.
Vector6d step_of(const Pose& moved) {
  const Eigen::AngleAxisd turn(moved.linear());
  Vector6d step;
  step << moved.translation(), turn.angle() * turn.axis();
  return step;
}

}  // namespace

Score quadratic_score(const std::vector<QuadraticPair>& pairs, const Pose& T_target_source,
                      Curvature curvature) {
  Score sum{.met = pairs.size()};
  for (const QuadraticPair& pair : pairs) {
    const Eigen::Vector3d y = T_target_source.linear() * pair.point;
    const Eigen::Vector3d d = y + T_target_source.translation() - pair.quadric.centre;
    const Eigen::Matrix3d A = pair.weight * pair.quadric.A;
    const Eigen::Vector3d b = pair.weight * pair.quadric.b;
    const Eigen::Vector3d v = A * d + b;  // half the gradient of w F
    const PointJacobian J = point_jacobian(y);
    sum.value += (d.dot(v + b) + pair.weight * pair.quadric.c) / 2;
    sum.gradient += J.transpose() * v;
    sum.hessian += J.transpose() * (A * J);
    if (curvature == Curvature::gauss_newton) continue;
    sum.hessian.bottomRightCorner<3, 3>() += (v * y.transpose() + y * v.transpose()) / 2;
    sum.hessian.bottomRightCorner<3, 3>().diagonal().array() -= v.dot(y);
  }
  return sum;
}

Matrix6d held_by(const std::vector<QuadraticPair>& pairs, const Pose& T_target_source) {
  Matrix6d held = Matrix6d::Zero();
  for (const QuadraticPair& pair : pairs) {
    const Vector6d along =
        point_jacobian(T_target_source.linear() * pair.point).transpose() * pair.normal;
    held += pair.weight * along * along.transpose();
  }
  return held;
}

Pose screwed(const Pose& pose, const Vector6d& step) {
  const Eigen::Vector3d tau = step.head<3>(), omega = step.tail<3>();
  const double a = omega.norm();
  // (1 - cos a) / a^2 and (a - sin a) / a^3, by their series where digits would cancel.
  const double half = std::sin(a / 2);
  const double one = a > 1e-4 ? 2 * half * half / (a * a) : 0.5;
  const double two = a > 1e-2 ? (a - std::sin(a)) / (a * a * a) : 1.0 / 6 - a * a / 120;
  const Eigen::Vector3d turned = omega.cross(tau);
  Pose moved = pose;
  moved.translation() += tau + one * turned + two * omega.cross(turned);
  moved.linear() = rotation_exp(omega) * pose.linear();
  return moved;
}

PairsAtEnd step_and_pair(const FindPairs& find, double needed, double length, Motion motion,
                         const SearchOptions& search, RegistrationResult& result) {
  PairsAtEnd end;
  Pose& T = result.T_target_source;
  const auto pair = [&] {
    ++result.evaluations;
    end.met = find(T, end.pairs);
    if (!(static_cast<double>(end.met) >= needed)) result.status = Status::no_overlap;
  };
  // The search starts at the identity of a pose that stands for the step; it takes derivatives
  // there, values elsewhere.
  const auto at = [&](const Pose& moved) {
    const Vector6d step = step_of(moved);
    return motion == Motion::screw ? screwed(T, step) : stepped(T, step);
  };
  const Objective objective{
      .score =
          [&](const Pose& moved, Curvature curvature) {
            return quadratic_score(end.pairs, at(moved), curvature);
          },
      .value =
          [&](const Pose& moved) {
            return quadratic_score(end.pairs, at(moved), Curvature::gauss_newton).value;
          },
      .length = length};
  SearchOptions one_step = search;
  one_step.max_iterations = 1;
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>() *= length;
  Vector6d last = Vector6d::Zero();
  pair();
  while (result.status == Status::max_iterations && result.iterations < search.max_iterations) {
    ++result.iterations;
    const Found found = minimise(objective, Pose::Identity(), one_step);
    result.evaluations += found.evaluations;
    const Vector6d step = step_of(found.pose);
    if (scale.cwiseProduct(step).dot(scale.cwiseProduct(last)) < 0)
      one_step.max_step = std::min(one_step.max_step, step.norm() / 2);
    last = step;
    T = normalized(at(found.pose));
    pair();
    if (found.converged && result.status == Status::max_iterations)
      result.status = Status::converged;
  }
  return end;
}

void conclude(const std::vector<QuadraticPair>& pairs, const Matrix6d& held, double length,
              double min_rank, RegistrationResult& result) {
  result.directions = directions_of(held, length);
  if (!(result.directions.front().hold >= min_rank)) {
    result.status = Status::degenerate;
    return;
  }
  double weights = 0;
  for (const QuadraticPair& pair : pairs) weights += pair.weight;
  const Score score = quadratic_score(pairs, result.T_target_source, Curvature::gauss_newton);
  result.score = 2 * score.value / weights;
  const double mean_weight = weights / static_cast<double>(pairs.size());
  if (result.score > 0)
    result.covariance = result.score / 3 * mean_weight * score.hessian.inverse();
}

void count_unmet(const std::vector<Eigen::Vector3d>& points, std::size_t met, const Bounds& box,
                 RegistrationResult& result) {
  std::size_t outside = 0;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d moved = result.T_target_source * p;
    outside += (moved.array() < box.low.array()).any() || (moved.array() > box.high.array()).any();
  }
  result.outside_points = std::min(outside, points.size() - met);
  result.empty_points = points.size() - met - result.outside_points;
}

}  // namespace minescan
