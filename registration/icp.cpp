// SPDX-License-Identifier: MIT
#include "registration/icp.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "registration/alignment.h"
#include "registration/kdtree.h"
#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {

namespace {

struct Pairs {
  std::vector<Eigen::Vector3d> target = {};
  std::vector<Eigen::Vector3d> source = {};  // in the source frame
};

/// The limit for pairs in iteration 1, 2, ...
double distance_limit(int iteration, const IcpOptions& o) {
  if (o.decrease_iterations == 0) return o.max_distance;
  const double part = std::min(1.0, static_cast<double>(iteration - 1) / o.decrease_iterations);
  return o.max_distance + part * (o.final_distance - o.max_distance);
}

void find_pairs(const KdTree& tree, const PointCloud& target,
                const std::vector<Eigen::Vector3d>& points, const Pose& T, double max_distance,
                double error, Pairs& pairs) {
  pairs.target.clear();
  pairs.source.clear();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d moved = T * p;
    const std::optional<Neighbour> neighbour = tree.nearest(moved, max_distance, error);
    if (!neighbour) continue;
    pairs.target.push_back(target.points[neighbour->index]);
    pairs.source.push_back(p);
  }
}

double pose_change(const Pose& from, const Pose& to) {
  const double angle = pose_error(from, to).rotation;
  return std::hypot((to.translation() - from.translation()).norm(), angle);
}

double mean_squared_distance(const Pairs& pairs, const Pose& T) {
  double sum = 0;
  for (std::size_t i = 0; i < pairs.source.size(); ++i)
    sum += (T * pairs.source[i] - pairs.target[i]).squaredNorm();
  return sum / static_cast<double>(pairs.source.size());
}

Matrix6d covariance(const Pairs& pairs, const Pose& T, double mean_squared) {
  Matrix6d JtJ = Matrix6d::Zero();
  for (const Eigen::Vector3d& p : pairs.source) {
    Eigen::Matrix<double, 3, 6> J;
    J << Eigen::Matrix3d::Identity(), -skew(T.linear() * p);
    JtJ += J.transpose() * J;
  }
  return mean_squared / 3 * JtJ.inverse();
}

void run_icp(const PointCloud& target, const PointCloud& source, const IcpOptions& options,
             RegistrationResult& result) {
  Stopwatch watch;
  const std::vector<Eigen::Vector3d> points = sampled_points(source.points, options.sampling);
  result.used_points = points.size();
  result.time.source = watch.lap();

  const KdTree tree(target.points, options.leaf_size);
  result.target_bytes = tree.bytes();
  result.time.target = watch.lap();

  const double needed = std::max(6.0, options.min_overlap * static_cast<double>(points.size()));
  Pairs pairs;
  while (result.status == Status::max_iterations && result.iterations < options.max_iterations) {
    ++result.iterations;
    ++result.evaluations;
    find_pairs(tree, target, points, result.T_target_source,
               distance_limit(result.iterations, options), options.tree_error, pairs);
    if (static_cast<double>(pairs.source.size()) < needed) {
      result.status = Status::no_overlap;
    } else if (const std::optional<Pose> pose = align_svd(pairs.target, pairs.source)) {
      const bool still = pose_change(result.T_target_source, *pose) < options.stop_step;
      if (still && result.iterations > options.decrease_iterations)
        result.status = Status::converged;
      result.T_target_source = *pose;
    } else {
      result.status = Status::degenerate;
    }
  }
  result.empty_points = points.size() - pairs.source.size();
  if (result.status == Status::converged || result.status == Status::max_iterations) {
    result.score = mean_squared_distance(pairs, result.T_target_source);
    result.covariance = covariance(pairs, result.T_target_source, result.score);
  }
  result.time.align = watch.lap();
}

}  // namespace

RegistrationResult register_icp(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const IcpOptions& options) {
  return registered(target, source, T_guess, options, run_icp);
}

}  // namespace minescan
