// SPDX-License-Identifier: MIT
#include "registration/ndt.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "registration/ndt_field.h"
#include "registration/ndt_score.h"
#include "registration/ndt_sums.h"
#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {

namespace {

/// Points, and the fields that score them.
struct Term {
  const std::vector<NdtField>* fields = nullptr;
  const PackedPoints* points = nullptr;
};

Objective objective_of(const std::vector<Term>& terms, double length) {
  return {.score =
              [terms](const Pose& pose, Curvature curvature) {
                Score sum;
                for (const Term& term : terms) {
                  for (const NdtField& field : *term.fields) {
                    const Score score = ndt_score(field, pose, *term.points, curvature);
                    sum.value += score.value;
                    sum.gradient += score.gradient;
                    sum.hessian += score.hessian;
                    sum.met += score.met;
                  }
                }
                return sum;
              },
          .value =
              [terms](const Pose& pose) {
                double sum = 0;
                for (const Term& term : terms)
                  for (const NdtField& field : *term.fields)
                    sum += ndt_value(field, pose, *term.points);
                return sum;
              },
          .length = length};
}

NdtInformation information_of(const std::vector<NdtField>& fields, const Pose& pose,
                              const PackedPoints& points) {
  NdtInformation sum;
  for (const NdtField& field : fields) {
    const NdtInformation part = ndt_information(field, pose, points);
    sum.gauss_newton += part.gauss_newton;
    sum.surface += part.surface;
    sum.weights += part.weights;
    sum.squares += part.squares;
  }
  return sum;
}

/// Whether a point is scored by the one cell that it lies in, as in the paper's baseline.
bool is_baseline(const NdtOptions& options) {
  const NdtTermOptions& terms = options.terms;
  return options.far_distance == 0 && terms.discretisation == Discretisation::fixed &&
         terms.neighbourhood == Neighbourhood::own && !terms.linked && !terms.endless &&
         terms.density == Density::normal;
}

/// Throws std::invalid_argument if it is not so; `what` needs it.
void require_baseline(const NdtOptions& options, const char* what) {
  if (is_baseline(options)) return;
  throw std::invalid_argument(
      std::string(what) +
      ": expected cells as in method ndt, neither divided nor linked, with neighbours, endless, of "
      "near and far points or with a mixture");
}

/// The target in cells of one size, for one level.
struct Target {
  std::vector<NdtField> fields = {};
  // The cells themselves where they are spread too widely for a field: the plain sums are slower
  // and take as much memory as there are cells, whatever lies between. And where the pose
  // deforms, as only they have an affine score.
  std::optional<NdtGrid> plain = {};

  Target(const std::vector<Eigen::Vector3d>& points, const NdtGridOptions& grid,
         const NdtOptions& options) {
    if (is_baseline(options))
      take(NdtGrid(points, grid), options);
    else
      fields = ndt_fields(points, grid, options.terms);
  }
  Target(NdtGrid grid, const NdtOptions& options) { take(std::move(grid), options); }

  void take(NdtGrid grid, const NdtOptions& options) {
    std::optional<NdtField> field;
    if (options.pose.is_rigid()) field = ndt_field(grid);
    if (field) {
      field->store(options.terms.storage);
      fields.push_back(*std::move(field));
    } else {
      plain = std::move(grid);
    }
  }
  std::size_t bytes() const {
    std::size_t sum = plain ? plain->bytes() : 0;
    for (const NdtField& field : fields) sum += field.bytes();
    return sum;
  }
};

/// What a search has found, and what it says about the pose.
void conclude(const Target& target, const Found& found, const std::vector<Eigen::Vector3d>& points,
              const PackedPoints& packed, double length, const NdtOptions& options,
              RegistrationResult& result) {
  const NdtInformation information = target.plain
                                         ? ndt_information(*target.plain, found.pose, points)
                                         : information_of(target.fields, found.pose, packed);
  const MetCount count = target.plain ? MetCount{.met = found.score.met, .inside = points.size()}
                                      : count_met(target.fields, found.pose, points);
  result.directions = directions_of(information.surface, length);
  result.score = found.score.value;
  result.outside_points = points.size() - std::max(count.inside, count.met);
  result.empty_points = points.size() - result.outside_points - count.met;
  result.status = status_of(result, count.met, needed_points(points.size(), options.min_overlap),
                            options.min_rank, found.converged);
  if (result.status == Status::converged || result.status == Status::max_iterations)
    result.covariance = pose_covariance(information);
}

/// The sums of all levels, the smallest cells first; none where each level goes through the points.
std::vector<SummedCells> merged_cells(const std::vector<Eigen::Vector3d>& points,
                                      const NdtOptions& options) {
  std::vector<SummedCells> levels;
  if (!options.merged) return levels;
  require_baseline(options, "merged");
  if (options.level_ratio != 2) throw std::invalid_argument("merged: expected level-ratio 2");
  levels.push_back(sum_cells(points, Lattice(options.grid.cell_size, options.grid.lattice_origin)));
  while (static_cast<int>(levels.size()) < options.levels)
    levels.push_back(twice_as_large(levels.back()));
  return levels;
}

void run_ndt(const PointCloud& target, const PointCloud& source, const NdtOptions& options,
             RegistrationResult& result) {
  if (!options.pose.is_rigid())
    require_baseline(options, "pose axis_angle with renormalise = false");
  Stopwatch watch;
  const UsedCloud used = used_source(source, options.sampling);
  const std::vector<Eigen::Vector3d>& points = used->points;
  const double length = rms_distance(points);
  const PackedPoints packed(points);
  std::vector<Eigen::Vector3d> near, far;
  for (const Eigen::Vector3d& p : points)
    (options.far_distance > 0 && p.norm() >= options.far_distance ? far : near).push_back(p);
  const PackedPoints packed_near(near), packed_far(far);
  result.used_points = points.size();
  result.time.source = watch.lap();

  const UsedCloud built_from = used_target(target, options.sampling);
  const auto search = [&](const Objective& objective, const SearchOptions& how) {
    const Found found = minimise(objective, result.T_target_source, how, options.pose);
    result.T_target_source = found.pose;
    result.iterations += found.iterations;
    result.evaluations += found.evaluations;
    return found;
  };
  const std::vector<SummedCells> merged = merged_cells(built_from->points, options);
  for (int level = options.levels - 1; level >= 0; --level) {
    NdtGridOptions grid = options.grid;
    grid.cell_size *= std::pow(options.level_ratio, level);
    const Target cells =
        merged.empty() ? Target(built_from->points, grid, options)
                       : Target(NdtGrid(merged[static_cast<std::size_t>(level)], grid), options);
    std::size_t bytes = cells.bytes();
    if (!far.empty()) {
      NdtGridOptions larger = grid;
      larger.cell_size *= 2;
      const Target far_cells(built_from->points, larger, options);
      bytes += far_cells.bytes();
      result.time.target += watch.lap();
      SearchOptions first = options.search;
      first.stop_step = std::max(first.stop_step, 0.01);  // NdtOptions::far_distance
      first.max_iterations = std::min(first.max_iterations, 10);
      search(
          objective_of({{&cells.fields, &packed_near}, {&far_cells.fields, &packed_far}}, length),
          first);
      result.time.align += watch.lap();
    }
    result.target_bytes = std::max(result.target_bytes, bytes);
    result.time.target += watch.lap();

    Objective objective = objective_of({{&cells.fields, &packed}}, length);
    if (cells.plain) {
      objective.score = [&](const Pose& pose, Curvature curvature) {
        return ndt_score(*cells.plain, pose, points, curvature);
      };
      objective.value = [&](const Pose& pose) { return ndt_value(*cells.plain, pose, points); };
      objective.affine = [&](const Pose& pose, Curvature curvature) {
        return ndt_affine_score(*cells.plain, pose, points, curvature);
      };
    }
    const Found found = search(objective, options.search);
    if (level == 0) conclude(cells, found, points, packed, length, options, result);
    result.time.align += watch.lap();
  }
}

}  // namespace

RegistrationResult register_ndt(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const NdtOptions& options) {
  return registered(target, source, T_guess, options, run_ndt);
}

}  // namespace minescan
