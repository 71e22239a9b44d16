// SPDX-License-Identifier: MIT
#include "registration/icp.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "registration/alignment.h"
#include "registration/icp_pairs.h"
#include "registration/newton.h"
#include "registration/registered.h"
#include "registration/search.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

/// The limit for pairs in iteration 1, 2, ...
double distance_limit(int iteration, const IcpOptions& o) {
  if (o.decrease_iterations == 0) return o.max_distance;
  const double part = std::min(1.0, static_cast<double>(iteration - 1) / o.decrease_iterations);
  return o.max_distance + part * (o.final_distance - o.max_distance);
}

/// The same points, those close together close in the list: searches for them share their way.
PointCloud in_order_of_place(const PointCloud& cloud) {
  PointCloud sorted;
  for (const std::uint32_t i : KdTree(cloud.points).order()) {
    sorted.points.push_back(cloud.points[i]);
    if (!cloud.normals.empty()) sorted.normals.push_back(cloud.normals[i]);
  }
  return sorted;
}

/// The used source points with their normals, in the source frame.
PointCloud used_cloud(const PointCloud& source, const IcpOptions& options) {
  PointCloud used = options.resample ? source : *used_source(source, options.sampling);
  if (!uses_source_normals(options))
    used.normals.clear();
  else if (used.normals.empty())
    used.normals = found_normals(used.points, options.neighbours, options.leaf_size);
  return in_order_of_place(used);
}

/// What the pairs hold, and how far they are apart.
struct Pull {
  Matrix6d information = Matrix6d::Zero();  // sum of w J^T J
  Vector6d gradient = Vector6d::Zero();     // sum of w r J
  double squares = 0;                       // sum of w r^2
  double weights = 0;
};

/// Residuals n.(p - q), with the derivatives (n, lever x n) of (tau, omega) about `centre`.
Pull pull_along(const IcpPairs& pairs, const Eigen::Vector3d& centre, IcpMetric metric) {
  Pull pull;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d &p = pairs.source[i], &q = pairs.target[i];
    Eigen::Vector3d n = pairs.target_normal[i], lever = p - centre;
    if (metric == IcpMetric::symmetric) {
      // Both normals point to their scanner, which may see the surface from either side.
      n += (n.dot(pairs.source_normal[i]) < 0 ? -1 : 1) * pairs.source_normal[i];
      lever = (p + q) / 2 - centre;  // both ends turn, by half the angle each
    }
    const double r = n.dot(p - q), w = pairs.weight[i];
    Vector6d J;
    J << n, lever.cross(n);
    pull.information.noalias() += (w * J) * J.transpose();
    pull.gradient += w * r * J;
    pull.squares += w * r * r;
    pull.weights += w;
  }
  return pull;
}

/// The same for the distance between the points.
Pull pull_to_points(const IcpPairs& pairs, const Eigen::Vector3d& centre) {
  Pull pull;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PointJacobian J = point_jacobian(pairs.source[i] - centre);
    pull.information += pairs.weight[i] * J.transpose() * J;
    pull.squares += pairs.weight[i] * (pairs.source[i] - pairs.target[i]).squaredNorm();
    pull.weights += pairs.weight[i];
  }
  return pull;
}

/// The same for differences between two flat distributions: J^T M J with the inverse M of the sum
/// of both covariances. For the directions that are held, only what lies across the surfaces
/// counts: `surface` is the sum of w J^T n n^T J.
Pull pull_between_planes(const IcpPairs& pairs, const Eigen::Vector3d& centre, double flatness,
                         Matrix6d* surface = nullptr) {
  Pull pull;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d lever = pairs.source[i] - centre;
    const Eigen::Vector3d d = pairs.source[i] - pairs.target[i];
    const Eigen::Vector3d &a = pairs.source_normal[i], &b = pairs.target_normal[i];
    const double w = pairs.weight[i];
    // Both have the covariance I - (1 - flatness) n n^T; without a normal it is I.
    Eigen::Matrix3d C = -(1 - flatness) * (a * a.transpose() + b * b.transpose());
    C.diagonal().array() += 2;
    const Eigen::Matrix3d M = C.inverse();
    const Eigen::Matrix3d MX = M * -skew(lever), X = skew(lever);
    const Eigen::Vector3d v = M * d;
    pull.information.topLeftCorner<3, 3>() += w * M;
    pull.information.topRightCorner<3, 3>() += w * MX;
    pull.information.bottomRightCorner<3, 3>() += w * (X * MX);
    pull.gradient.head<3>() += w * v;
    pull.gradient.tail<3>() += w * lever.cross(v);
    pull.squares += w * d.dot(v);
    pull.weights += w;
    if (surface) {
      Vector6d along;
      along << b, lever.cross(b);
      *surface += w * along * along.transpose();
    }
  }
  pull.information.bottomLeftCorner<3, 3>() = pull.information.topRightCorner<3, 3>().transpose();
  return pull;
}

/// The motion of the target frame that brings the pairs together, or none if they do not fix it.
std::optional<Pose> motion(const IcpPairs& pairs, const IcpOptions& options) {
  if (options.metric == IcpMetric::point)
    return options.closed_form == ClosedForm::svd
               ? align_svd(pairs.target, pairs.source, pairs.weight)
               : align_quaternion(pairs.target, pairs.source, pairs.weight);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : pairs.source) centre += p / static_cast<double>(pairs.size());
  const Pull pull = options.metric == IcpMetric::generalized
                        ? pull_between_planes(pairs, centre, options.flatness)
                        : pull_along(pairs, centre, options.metric);
  const Eigen::LDLT<Matrix6d> ldlt(pull.information);
  const Vector6d step = -ldlt.solve(pull.gradient);
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive() || !step.allFinite()) return {};
  Pose moved = Pose::Identity();
  if (options.metric != IcpMetric::symmetric) {
    moved.linear() = rotation_exp(step.tail<3>());
    moved.translation() = centre + step.head<3>() - moved.linear() * centre;
    return moved;
  }
  // Rusinkiewicz 2019, section 2.3: half the turn, the shift, half the turn.
  const double half = std::atan(step.tail<3>().norm() / 2);
  const Eigen::Matrix3d turn =
      half > 0 ? rotation_exp(half * step.tail<3>().normalized()) : Eigen::Matrix3d::Identity();
  moved.linear() = turn * turn;
  moved.translation() = centre + turn * (std::cos(half) * step.head<3>()) - moved.linear() * centre;
  return moved;
}

double pose_change(const Pose& from, const Pose& to) {
  const double angle = pose_error(from, to).rotation;
  return std::hypot((to.translation() - from.translation()).norm(), angle);
}

/// What the last pairs say of the pose.
void conclude(const IcpPairs& pairs, const PointCloud& used, const IcpOptions& options,
              RegistrationResult& result) {
  const Eigen::Vector3d origin = result.T_target_source.translation();  // of the source
  Pull pull;
  Matrix6d held = Matrix6d::Zero();  // what surfaces hold
  double coordinates = 3;            // that a pair compares
  switch (options.metric) {
    case IcpMetric::point:
      pull = pull_to_points(pairs, origin);
      held = pull.information;
      break;
    case IcpMetric::generalized:
      pull = pull_between_planes(pairs, origin, options.flatness, &held);
      break;
    case IcpMetric::plane:
    case IcpMetric::symmetric:
      pull = pull_along(pairs, origin, options.metric);
      held = pull.information;
      coordinates = 1;
      break;
  }
  result.directions = directions_of(held, rms_distance(used.points));
  // No weights: pairs of which none counts.
  if (!(pull.weights > 0) || (options.metric != IcpMetric::point &&
                              !(result.directions.front().hold >= options.min_rank))) {
    result.status = Status::degenerate;
    return;
  }
  result.score = pull.squares / pull.weights;
  result.covariance = result.score / coordinates * pull.information.inverse();
}

void run_icp(const PointCloud& whole_target, const PointCloud& source, const IcpOptions& options,
             RegistrationResult& result) {
  if (options.resample &&
      (options.sampling.sampling != Sampling::stable || options.sampling.of == SampleOf::target))
    throw std::invalid_argument("resample: expected sampling stable of the source, found " +
                                value_text(options.sampling.sampling) + " of " +
                                value_text(options.sampling.of));
  Stopwatch watch;
  const PointCloud used = used_cloud(source, options);
  result.used_points = used.points.size();
  result.time.source = watch.lap();

  const UsedCloud used_of_target = used_target(whole_target, options.sampling);
  const PointCloud& target = *used_of_target;
  const KdTree tree(target.points, options.leaf_size);
  Normals normals(target, tree, options.neighbours);
  result.target_bytes = tree.bytes();
  result.time.target = watch.lap();

  const double needed = needed_points(used.points.size(), options.min_overlap);
  IcpMatching matching(target, used, tree, normals, options);
  IcpPairs pairs;
  Pose& T = result.T_target_source;
  const auto find = [&] {
    ++result.evaluations;
    matching.find(T, distance_limit(result.iterations, options), pairs);
  };
  while (result.status == Status::max_iterations && result.iterations < options.max_iterations) {
    ++result.iterations;
    find();
    if (static_cast<double>(matching.matched()) < needed) {
      result.status = Status::no_overlap;
    } else if (const std::optional<Pose> moved = motion(pairs, options)) {
      const Pose next = normalized(*moved * T);
      const bool still = pose_change(T, next) < options.stop_step;
      if (still && result.iterations > options.decrease_iterations)
        result.status = Status::converged;
      T = next;
    } else {
      result.status = Status::degenerate;
    }
  }
  if (result.status == Status::converged || result.status == Status::max_iterations) {
    find();  // from the last pose
    if (static_cast<double>(matching.matched()) < needed)
      result.status = Status::no_overlap;
    else
      conclude(pairs, used, options, result);
  }
  result.outside_points = matching.outside();
  result.empty_points = used.points.size() - matching.matched() - result.outside_points;
  result.time.align = watch.lap();
}

}  // namespace

RegistrationResult register_icp(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const IcpOptions& options) {
  return registered(target, source, T_guess, options, run_icp);
}

}  // namespace minescan
