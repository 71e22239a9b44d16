// SPDX-License-Identifier: MIT
#include "registration/ndt.h"

#include <algorithm>
#include <cmath>

#include "registration/ndt_field.h"
#include "registration/ndt_score.h"
#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {

namespace {

void run_ndt(const PointCloud& target, const PointCloud& source, const NdtOptions& options,
             RegistrationResult& result) {
  Stopwatch watch;
  const std::vector<Eigen::Vector3d> points = sampled_points(source.points, options.sampling);
  const double length = rms_distance(points);
  const PackedPoints packed(points);
  result.used_points = points.size();
  result.time.source = watch.lap();

  for (int level = options.levels - 1; level >= 0; --level) {
    NdtGridOptions grid_options = options.grid;
    grid_options.cell_size *= std::pow(options.level_ratio, level);
    const NdtGrid grid(target.points, grid_options);
    const std::optional<NdtField> field = ndt_field(grid);
    result.target_bytes = std::max(result.target_bytes, field ? field->bytes() : grid.bytes());
    result.time.target += watch.lap();

    Objective objective{.length = length};
    if (field) {
      objective.score = [&](const Pose& pose, Curvature curvature) {
        return ndt_score(*field, pose, packed, curvature);
      };
      objective.value = [&](const Pose& pose) { return ndt_value(*field, pose, packed); };
    } else {
      objective.score = [&](const Pose& pose, Curvature curvature) {
        return ndt_score(grid, pose, points, curvature);
      };
      objective.value = [&](const Pose& pose) { return ndt_value(grid, pose, points); };
    }
    const Found found = minimise(objective, result.T_target_source, options.search);
    result.T_target_source = found.pose;
    result.iterations += found.iterations;
    result.evaluations += found.evaluations;
    if (level == 0) {
      const auto used = static_cast<double>(points.size());
      const NdtInformation information = field ? ndt_information(*field, found.pose, packed)
                                               : ndt_information(grid, found.pose, points);
      result.directions = directions_of(information.surface, length);
      result.score = found.score.value;
      result.empty_points = points.size() - found.score.met;
      result.status = found.converged ? Status::converged : Status::max_iterations;
      if (static_cast<double>(found.score.met) < std::max(6.0, options.min_overlap * used))
        result.status = Status::no_overlap;
      else if (!(result.directions.front().hold >= options.min_rank))
        result.status = Status::degenerate;
      else
        result.covariance = pose_covariance(information);
    }
    result.time.align += watch.lap();
  }
}

}  // namespace

RegistrationResult register_ndt(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const NdtOptions& options) {
  return registered(target, source, T_guess, options, run_ndt);
}

}  // namespace minescan
