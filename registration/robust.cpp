// SPDX-License-Identifier: MIT
#include "registration/robust.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <vector>

#include "registration/ndt_field.h"
#include "registration/ndt_sums.h"
#include "registration/registered.h"
#include "registration/sampling.h"
#include "registration/search.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

// The searches, coarse to fine. How long their steps may be and when they end was found by trials,
// as the defaults of RobustOptions: none of it matters much. Norms of (metres, radians).
const SearchOptions through_blurs = {.optimiser = Optimiser::levenberg_marquardt,
                                     .max_step = 1,
                                     .stop_step = 0.02,
                                     .max_iterations = 30};
const SearchOptions compared = {.max_step = 0.3, .stop_step = 2e-3, .max_iterations = 15};
const SearchOptions with_all_points = {.max_step = 0.2, .stop_step = 1e-3, .max_iterations = 50};
const SearchOptions at_the_end = {.max_step = 0.2, .stop_step = 1e-4, .max_iterations = 50};
// Two ends are the same if they are this part of a middle cell apart (assumed).
constexpr double same_place = 0.2;

/// `field`, which is made from `grid`, with every distribution blurred by a standard deviation of
/// `blur` metres. Of a wall only the distance from its plane counts.
NdtField blurred(NdtField field, const NdtGrid& grid, double blur, bool walls) {
  for (std::size_t c = 0; c < grid.cells().size(); ++c) {
    const NdtCell& cell = grid.cells()[c];
    Eigen::Matrix3d C = information_matrix(cell).inverse();
    C.diagonal().array() += blur * blur;
    Eigen::Matrix3d L = C.inverse();
    if (walls) {
      const Eigen::Vector3d& n = grid.normal(cell);
      L = n.dot(L * n) * n * n.transpose();
    }
    field.rows[c].set_information(L);
  }
  return field;
}

/// The target at three sizes of cells.
struct Levels {
  NdtGrid fine_grid, middle_grid, coarse_grid;
  NdtField fine, middle;
  std::vector<NdtField> walls, bodies;  // coarse, one per blur

  Levels(const SummedCells& small, const SummedCells& medium, const RobustOptions& options)
      : fine_grid(small, grid_options(options)),
        middle_grid(medium, grid_options(options)),
        coarse_grid(twice_as_large(medium), grid_options(options)) {
    fine = checked_ndt_field(fine_grid);
    middle = checked_ndt_field(middle_grid);
    if (empty()) return;
    // Two cells more on each side, where every place looks at the cell nearest to it.
    NdtField linked = checked_ndt_field(coarse_grid, 2);
    link_cells(linked);
    for (const double blur : options.blurs)
      walls.push_back(blurred(linked, coarse_grid, blur, true));
    linked.endless = true;
    if (options.bodies != 0)
      for (const double blur : options.blurs)
        bodies.push_back(blurred(linked, coarse_grid, blur, false));
  }
  bool empty() const { return fine.number.empty() || middle.number.empty(); }
  std::size_t bytes() const {
    std::size_t sum = fine.bytes() + middle.bytes();
    for (const std::vector<NdtField>* list : {&walls, &bodies})
      for (const NdtField& field : *list) sum += field.bytes();
    return sum;
  }

 private:
  static NdtGridOptions grid_options(const RobustOptions& o) {
    return {.min_cell_points = o.min_cell_points, .eigenvalue_ratio = o.eigenvalue_ratio};
  }
};

/// A direction of the target frame along which its walls say little of the position, as along a
/// tunnel, and the spring that holds coarse searches there: they would drift to where most of one
/// scan lies within the other.
struct Axis {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // unit vector, or zero: none
  double stiffness = 0;                                 // 1/m^2, of a score as NDT's

  bool is_there() const { return stiffness > 0; }
};

/// The direction to which the target's walls are most parallel, if they are enough so; the spring
/// is as strong as `points` points that sit in cells of one metre.
Axis axis_of(const NdtGrid& grid, std::size_t points, double weak) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const NdtCell& cell : grid.cells()) sum += grid.normal(cell) * grid.normal(cell).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  if (solver.eigenvalues()[0] >= weak * solver.eigenvalues()[2]) return {};
  return {.direction = solver.eigenvectors().col(0), .stiffness = static_cast<double>(points)};
}

/// Searches that count together.
struct Searches {
  double length = 1;
  int iterations = 0;
  int evaluations = 0;

  Found run(const NdtField& field, const PackedPoints& points, const Pose& start,
            const SearchOptions& options, const Axis& axis = {}) {
    const Eigen::Vector3d& u = axis.direction;
    const double k = axis.stiffness;
    const auto stretch = [&](const Pose& pose) {
      return u.dot(pose.translation() - start.translation());
    };
    Objective objective{.length = length};
    objective.score = [&](const Pose& pose, Curvature curvature) {
      Score score = ndt_score(field, pose, points, curvature);
      score.value += k * stretch(pose) * stretch(pose) / 2;
      score.gradient.head<3>() += k * stretch(pose) * u;
      score.hessian.topLeftCorner<3, 3>() += k * u * u.transpose();
      return score;
    };
    objective.value = [&](const Pose& pose) {
      return ndt_value(field, pose, points) + k * stretch(pose) * stretch(pose) / 2;
    };
    Found found = minimise(objective, start, options);
    iterations += found.iterations;
    evaluations += found.evaluations;
    return found;
  }
};

/// The most likely pose so far, among ends of searches that are compared in the same cells.
class Candidates {
 public:
  Candidates(const Levels& levels, const PackedPoints& points, Searches& searches, const Axis& axis,
             const Pose& guess)
      : levels_(levels), points_(points), searches_(searches), axis_(axis), best_(guess) {}

  /// Searches from `start`, with cells as walls and as bodies.
  void search_from(const Pose& start) {
    const Pose by_walls = through(levels_.walls, start);
    refine(by_walls);
    if (levels_.bodies.empty()) return;
    const double before = value_;
    const Pose by_bodies = refine(through(levels_.bodies, start));
    // The same place by two ways that are led astray by different things.
    const PoseError apart = pose_error(best_, by_bodies);
    const double same = same_place * levels_.middle.side;
    agreed_ = before < 0 && value_ >= before && apart.translation < same &&
              apart.rotation < same / searches_.length;
  }
  /// Refines `pose` in the middle cells and keeps it if it is the most likely.
  Pose refine(const Pose& pose) {
    const Found found = searches_.run(levels_.middle, points_, pose, compared);
    if (found.score.value < value_) {
      best_ = found.pose;
      value_ = found.score.value;
    }
    return found.pose;
  }

  const Pose& best() const { return best_; }
  /// Whether the last searches from one start, of both kinds, have ended at the best pose.
  bool agreed() const { return agreed_; }

 private:
  Pose through(const std::vector<NdtField>& blurs, const Pose& start) {
    Pose pose = start;
    for (const NdtField& field : blurs)
      pose = searches_.run(field, points_, pose, through_blurs, axis_).pose;
    return pose;
  }

  const Levels& levels_;
  const PackedPoints& points_;
  Searches& searches_;
  const Axis& axis_;
  Pose best_;
  double value_ = 0;  // no distribution met
  bool agreed_ = false;
};

Pose turned(const Pose& pose, double angle) {
  Pose result = pose;
  result.linear() = rotation_exp({0, 0, angle}) * pose.linear();
  return result;
}

/// The best of all starts that the options ask for.
Pose coarse_pose(const Levels& levels, const PackedPoints& points, Searches& searches,
                 const Pose& guess, const RobustOptions& options) {
  const Axis axis = axis_of(levels.coarse_grid, points.size(), options.weak);
  Candidates candidates(levels, points, searches, axis, guess);
  candidates.search_from(guess);
  if (!candidates.agreed() || axis.is_there()) {
    for (int k = 1; k <= options.turns; ++k)
      for (const int side : {1, -1}) candidates.search_from(turned(guess, side * k * options.turn));
  }
  if (axis.is_there()) {
    const Pose from = candidates.best();
    for (int k = 1; k <= options.slides; ++k)
      for (const int side : {1, -1})
        candidates.refine(Eigen::Translation3d(side * k * options.slide * axis.direction) * from);
  }
  return candidates.best();
}

/// As many points of `list` as wanted, or all.
std::vector<Eigen::Vector3d> at_most(int wanted, const std::vector<Eigen::Vector3d>& list,
                                     Sampling sampling, std::uint64_t seed) {
  const double ratio = static_cast<double>(wanted) / static_cast<double>(list.size());
  return sampled_points(list, {.ratio = std::min(1.0, ratio), .sampling = sampling, .seed = seed});
}

void run_robust(const PointCloud& target, const PointCloud& source, const RobustOptions& options,
                RegistrationResult& result) {
  Stopwatch watch;
  // Spread evenly where there are more than enough, so that the wall at the scanner does not have
  // them all. Of these any, though: spread once more, the few points far off, which the other scan
  // may not have seen, would decide (docs/robust.md).
  const std::vector<Eigen::Vector3d> samples =
      at_most(options.points, source.points, Sampling::spatial, options.seed);
  const PackedPoints points(samples);
  const PackedPoints coarse_points(
      at_most(options.coarse_points, samples, Sampling::uniform, options.seed));
  Searches searches{.length = rms_distance(samples)};
  result.used_points = samples.size();
  result.time.source = watch.lap();

  const SummedCells small = sum_cells(target.points, Lattice(options.cell_size));
  const Levels levels(small, twice_as_large(small), options);
  result.target_bytes = levels.bytes();
  result.time.target = watch.lap();
  if (levels.empty()) {
    result.status = Status::no_overlap;
    return;
  }

  const Pose coarse = coarse_pose(levels, coarse_points, searches, result.T_target_source, options);
  const Found middle = searches.run(levels.middle, points, coarse, with_all_points);
  const Found fine = searches.run(levels.fine, points, middle.pose, at_the_end);
  const NdtInformation information = ndt_information(levels.middle, fine.pose, points);

  result.T_target_source = fine.pose;
  result.iterations = searches.iterations;
  result.evaluations = searches.evaluations;
  result.score = fine.score.value;
  result.empty_points = samples.size() - fine.score.met;
  result.directions = directions_of(information.surface, searches.length);
  const auto used = static_cast<double>(samples.size());
  if (fine.score.met < 6 || information.weights < options.min_overlap * used) {
    result.status = Status::no_overlap;
  } else if (!(result.directions.front().hold >= options.min_rank)) {
    result.status = Status::degenerate;
  } else {
    result.status = fine.converged ? Status::converged : Status::max_iterations;
    result.covariance = pose_covariance(information);
  }
  result.time.align = watch.lap();
}

}  // namespace

RegistrationResult register_robust(const PointCloud& target, const PointCloud& source,
                                   const Pose& T_guess, const RobustOptions& options) {
  return registered(target, source, T_guess, options, run_robust);
}

}  // namespace minescan
