// SPDX-License-Identifier: MIT
#include "registration/ndt.h"

#include <algorithm>
#include <cmath>

#include "registration/check_input.h"
#include "registration/ndt_score.h"
#include "registration/newton.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

/// Where the search stands.
struct State {
  Pose pose = Pose::Identity();
  NdtScore score = {};
  int iterations = 0;
  bool converged = false;
};

/// RMS distance from the origin: the lever by which a rotation moves the points.
double rms_distance(const std::vector<Eigen::Vector3d>& points) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += p.squaredNorm();
  const double rms = std::sqrt(sum / static_cast<double>(points.size()));
  return rms > 0 ? rms : 1;
}

/// Newton's method with a backtracking line search.
State minimise(const NdtGrid& grid, const std::vector<Eigen::Vector3d>& points, const Pose& start,
               const NdtOptions& options) {
  const double length = rms_distance(points);
  State state{.pose = start, .score = ndt_score(grid, start, points)};
  while (!state.converged && state.iterations < options.max_iterations) {
    ++state.iterations;
    const NdtScore& at = state.score;
    const Vector6d step = newton_step(at.gradient, at.hessian, length, options.max_step);
    const double slope = at.gradient.dot(step);

    // Every trial looks up its cells anew, so the score may jump and a decrease is not certain: at
    // most 10 halvings. The full step mostly does, so there the derivatives are computed at once.
    double alpha = 1;
    bool decreased = false;
    for (int halvings = 0; halvings <= 10 && !decreased; ++halvings) {
      if (halvings > 0) alpha /= 2;
      const Pose trial = stepped(state.pose, alpha * step);
      const double limit = at.value + 1e-4 * alpha * slope;  // Armijo
      if (halvings > 0 && !(ndt_value(grid, trial, points) <= limit)) continue;
      const NdtScore there = ndt_score(grid, trial, points);
      if (!(there.value <= limit)) continue;
      state.pose = trial;
      state.score = there;
      decreased = true;
    }
    // A search that finds nothing lower has tried a step of norm max_step / 2^10 or less, which the
    // defaults put below stop_step: it counts as a step too short to go on.
    state.converged = !decreased || alpha * step.norm() < options.stop_step;
  }
  state.pose = normalized(state.pose);
  return state;
}

}  // namespace

RegistrationResult register_ndt(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const NdtOptions& options) {
  check_options(options);
  check_clouds(target, source, T_guess);
  Stopwatch watch;
  RegistrationResult result{.target_points = target.points.size(),
                            .source_points = source.points.size()};
  const std::vector<Eigen::Vector3d> points = sampled_points(source.points, options.sampling);
  result.used_points = points.size();
  result.time.source = watch.lap();

  State state{.pose = T_guess};
  for (int level = options.levels - 1; level >= 0; --level) {
    NdtGridOptions grid_options = options.grid;
    grid_options.cell_size *= std::pow(options.level_ratio, level);
    const NdtGrid grid(target.points, grid_options);
    result.target_bytes = std::max(result.target_bytes, grid.bytes());
    result.time.target += watch.lap();

    state = minimise(grid, points, state.pose, options);
    result.iterations += state.iterations;
    if (level == 0) {
      const double needed = std::max(6.0, options.min_overlap * static_cast<double>(points.size()));
      const NdtInformation information = ndt_information(grid, state.pose, points);
      const double rank =
          eigenvalue_quotient(scaled_hessian(information.surface, rms_distance(points)));
      result.T_target_source = state.pose;
      result.score = state.score.value;
      result.status = state.converged ? Status::converged : Status::max_iterations;
      if (static_cast<double>(state.score.met) < needed)
        result.status = Status::no_overlap;
      else if (!(rank >= options.min_rank))
        result.status = Status::degenerate;
      else
        result.covariance = information.gauss_newton.inverse();
    }
    result.time.align += watch.lap();
  }
  if (result.status == Status::no_overlap || result.status == Status::degenerate)
    result.T_target_source = T_guess;
  result.cpu = watch.cpu();
  return result;
}

}  // namespace minescan
