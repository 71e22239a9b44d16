// SPDX-License-Identifier: MIT
#include "registration/planar_ndt.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

// Where (tx, ty, phi) are among the six unknowns.
constexpr std::array<Eigen::Index, 3> in_plan = {0, 1, 5};

Vector6d in_space(const Eigen::Vector3d& v) {
  Vector6d six = Vector6d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) six[in_plan[static_cast<std::size_t>(i)]] = v[i];
  return six;
}

Matrix6d in_space(const Eigen::Matrix3d& M) {
  Matrix6d six = Matrix6d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      six(in_plan[static_cast<std::size_t>(i)], in_plan[static_cast<std::size_t>(j)]) = M(i, j);
  return six;
}

/// Of the symmetric M with phi as a length, ascending.
Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> scaled_eigen(const Eigen::Matrix3d& M,
                                                            double length) {
  const Eigen::Vector3d scale(1, 1, 1 / length);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scale.asDiagonal() * M *
                                                        scale.asDiagonal());
}

/// One source point in one cell.
struct Seen {
  Eigen::Vector2d turned;  // R x
  Eigen::Vector2d Lx;      // C^-1 (R x + t - mean)
  double squared;          // x'^T C^-1 x'

  Seen(const PlanarCell& cell, const Eigen::Isometry2d& T, const Eigen::Vector2d& point)
      : turned(T.linear() * point) {
    const Eigen::Vector2d x = turned + T.translation() - cell.mean;
    Lx = cell.information * x;
    squared = x.dot(Lx);
  }
  bool counts() const { return squared <= 240; }  // e^-120 and more
  double density() const { return std::exp(-squared / 2); }
  /// Of the moved point (eq. 10), at phi = 0 of a further turn.
  Eigen::Matrix<double, 2, 3> jacobian() const {
    Eigen::Matrix<double, 2, 3> J;
    J << 1, 0, -turned.y(), 0, 1, turned.x();
    return J;
  }
};

void add_term(const PlanarCell& cell, const Seen& seen, Curvature curvature, PlanarScore& sum) {
  const double w = seen.density();
  const Eigen::Matrix<double, 2, 3> J = seen.jacobian();
  const Eigen::Vector3d h = J.transpose() * seen.Lx;
  sum.value -= w;         // eq. 6
  sum.gradient += w * h;  // eq. 8
  Eigen::Matrix3d H = J.transpose() * cell.information * J;
  if (curvature == Curvature::full) {
    H -= h * h.transpose();               // eq. 9
    H(2, 2) -= seen.Lx.dot(seen.turned);  // eq. 11: the second derivative by phi is -R x
  }
  sum.hessian += w * H;
}

/// Calls visit(cell, seen) for every cell that a point lies in and that counts; returns how many
/// points have any.
template <class Visit>
std::size_t visit_terms(const std::vector<PlanarGrid>& grids, const Eigen::Isometry2d& T,
                        const std::vector<Eigen::Vector3d>& points, Visit&& visit) {
  std::size_t met = 0;
  for (const Eigen::Vector3d& p : points) {
    Eigen::Vector3d moved = p;
    moved.head<2>() = T * Eigen::Vector2d(p.head<2>());
    bool any = false;
    for (const PlanarGrid& grid : grids) {
      const PlanarCell* cell = grid.find(moved);
      if (!cell) continue;
      const Seen seen(*cell, T, p.head<2>());
      if (!seen.counts()) continue;
      visit(*cell, seen);
      any = true;
    }
    met += any;
  }
  return met;
}

double planar_value(const std::vector<PlanarGrid>& grids, const Eigen::Isometry2d& T,
                    const std::vector<Eigen::Vector3d>& points) {
  double value = 0;
  visit_terms(grids, T, points,
              [&](const PlanarCell&, const Seen& seen) { value -= seen.density(); });
  return value;
}

/// The motion in plan of a pose without roll and pitch.
Eigen::Isometry2d plan_of(const Pose& pose) {
  Eigen::Isometry2d T = Eigen::Isometry2d::Identity();
  T.linear() = pose.linear().topLeftCorner<2, 2>();
  T.translation() = pose.translation().head<2>();
  return T;
}

/// Six unknowns of which three are sought. The others have no gradient, and the curvature of the
/// firmest of the three, so that a Hessian that needs repair needs the same one.
Score embedded(const PlanarScore& planar, double length) {
  Score score{.value = planar.value,
              .gradient = in_space(planar.gradient),
              .hessian = in_space(planar.hessian),
              .met = planar.met};
  const double largest = scaled_eigen(planar.hessian, length).eigenvalues().cwiseAbs().maxCoeff();
  score.hessian(2, 2) = largest;
  score.hessian(3, 3) = score.hessian(4, 4) = largest * length * length;
  return score;
}

/// How heights in the frame at hand become layers of a cubic lattice.
struct Heights {
  const PlanarNdtOptions& options;
  double lift = 0;  // metres; a height in the target's own frame is z + lift

  bool used(double z) const {
    return options.band_height == 0 ||
           std::abs(z + lift - options.band_middle) <= options.band_height / 2;
  }
  /// The middle of a cell in the layer of a slice.
  double layer(double z) const {
    if (options.slice_height == 0) return options.cell_size / 2;
    const double h = options.slice_height;
    // Heights of slices repeat, and small numbers keep more digits.
    const double above = z + std::remainder(lift, h) - options.lattice_origin.z();
    return (std::floor(above / h) + 0.5) * options.cell_size;
  }
};

/// The points in the band after a motion, (x, y, layer).
std::vector<Eigen::Vector3d> layered(const std::vector<Eigen::Vector3d>& points, const Pose& T,
                                     double z_offset, const Heights& heights) {
  std::vector<Eigen::Vector3d> list;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d q = T * p;
    const double z = q.z() + z_offset;
    if (heights.used(z)) list.emplace_back(q.x(), q.y(), heights.layer(z));
  }
  return list;
}

/// Throws std::invalid_argument if a layer is beyond the reach of a lattice because of its slice.
void check_slices(const std::vector<Eigen::Vector3d>& points, const PlanarNdtOptions& options) {
  for (const Eigen::Vector3d& p : points)
    if (!(std::abs(p.z()) < options.cell_size * Lattice::index_limit))
      throw std::invalid_argument(fmt::format(
          "slice-height = {}: a point of the target is more than {} slices from lattice-z",
          options.slice_height, Lattice::index_limit));
}

/// The three directions in plan, the one held least first, with its hold relative to the best.
std::vector<Direction> planar_directions(const Eigen::Matrix3d& information, double length) {
  const auto solver = scaled_eigen(information, length);
  const double largest = solver.eigenvalues()[2];
  std::vector<Direction> list;
  for (Eigen::Index i = 0; i < 3; ++i)
    list.push_back({.step = in_space(Eigen::Vector3d(solver.eigenvectors().col(i))),
                    .hold = largest > 0 ? std::max(0.0, solver.eigenvalues()[i] / largest) : 0});
  return list;
}

/// How the points fix the pose, as NdtInformation does.
struct PlanarInformation {
  Eigen::Matrix3d gauss_newton = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d surface = Eigen::Matrix3d::Zero();
  double weights = 0;
  double squares = 0;
};

PlanarInformation information_of(const std::vector<PlanarGrid>& grids, const Eigen::Isometry2d& T,
                                 const std::vector<Eigen::Vector3d>& points) {
  PlanarInformation sum;
  visit_terms(grids, T, points, [&](const PlanarCell& cell, const Seen& seen) {
    const double w = seen.density();
    const Eigen::Matrix<double, 2, 3> J = seen.jacobian();
    const Eigen::Vector3d across = J.transpose() * cell.normal;
    sum.gauss_newton += w * (J.transpose() * cell.information * J);
    sum.surface += w * cell.wall * across * across.transpose();
    sum.weights += w;
    sum.squares += w * seen.squared;
  });
  return sum;
}

/// What a search has found, and what it says about the pose.
void conclude(const std::vector<PlanarGrid>& grids, const Found& found,
              const std::vector<Eigen::Vector3d>& points, double length,
              const PlanarNdtOptions& options, RegistrationResult& result) {
  const Eigen::Isometry2d T = plan_of(found.pose);
  const PlanarInformation information = information_of(grids, T, points);
  result.directions = planar_directions(information.surface, length);
  result.score = found.score.value;

  Eigen::AlignedBox3d box;
  for (const PlanarGrid& grid : grids) box.extend(grid.box());
  const auto inside = static_cast<std::size_t>(
      std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
        const Eigen::Vector2d moved = T * Eigen::Vector2d(p.head<2>());
        return box.contains(Eigen::Vector3d(moved.x(), moved.y(), p.z()));
      }));
  const std::size_t met = found.score.met;
  result.outside_points = points.size() - std::max(inside, met);
  result.empty_points = points.size() - result.outside_points - met;
  result.status = status_of(result, met, needed_points(points.size(), options.min_overlap),
                            options.min_rank, found.converged);
  if (result.status == Status::converged || result.status == Status::max_iterations) {
    // Of points as the cells say, weighted by their densities, the mean of the squares is 1. A
    // point counts once, in however many grids it is seen.
    const double scale =
        information.squares / information.weights * static_cast<double>(grids.size());
    result.covariance = in_space(Eigen::Matrix3d(scale * information.gauss_newton.inverse()));
  }
}

void run_planar_ndt(const PointCloud& target, const PointCloud& source, double lift,
                    const PlanarNdtOptions& options, RegistrationResult& result) {
  Stopwatch watch;
  const Pose T_guess = result.T_target_source;
  const Heights heights{.options = options, .lift = lift};
  Pose turn = Pose::Identity();
  turn.linear() = normalized(T_guess).linear();
  const std::vector<Eigen::Vector3d> points = layered(used_source(source, options.sampling)->points,
                                                      turn, T_guess.translation().z(), heights);
  std::vector<Eigen::Vector3d> in_plan_only = points;
  for (Eigen::Vector3d& p : in_plan_only) p.z() = 0;
  const double length = rms_distance(in_plan_only);
  result.used_points = points.size();
  result.time.source = watch.lap();

  const std::vector<Eigen::Vector3d> target_points =
      layered(used_target(target, options.sampling)->points, Pose::Identity(), 0, heights);
  check_slices(target_points, options);
  const std::vector<PlanarGrid> grids = planar_grids(target_points, options);
  for (const PlanarGrid& grid : grids) result.target_bytes += grid.bytes();
  result.time.target = watch.lap();

  const Objective objective{
      .score =
          [&](const Pose& pose, Curvature curvature) {
            return embedded(planar_score(grids, plan_of(pose), points, curvature), length);
          },
      .value = [&](const Pose& pose) { return planar_value(grids, plan_of(pose), points); },
      .length = length};
  Pose start = Pose::Identity();
  start.translation() = T_guess.translation();
  const Found found = minimise(objective, start, options.search);
  result.iterations = found.iterations;
  result.evaluations = found.evaluations;
  conclude(grids, found, points, length, options, result);

  const Eigen::Matrix3d R = found.pose.linear();
  const Eigen::AngleAxisd about_vertical(std::atan2(R(1, 0), R(0, 0)), Eigen::Vector3d::UnitZ());
  result.T_target_source.linear() = about_vertical * turn.linear();
  result.T_target_source.translation().head<2>() = found.pose.translation().head<2>();
  result.time.align = watch.lap();
}

}  // namespace

double wall_likeness(double thickness, double count) {
  const double V = 2 * std::sqrt(thickness) / (1 + thickness);
  if (std::pow(V, count - 2) > 1e-3) return 0;
  return std::max(0.0, 1 - 10 * thickness);
}

std::optional<PlanarCell> fit_planar_cell(const CellSums& sums, const Eigen::Vector3d& corner,
                                          const PlanarNdtOptions& options) {
  const double n = sums.count;
  if (!(n >= options.min_cell_points)) return {};

  const Eigen::Vector2d q = Eigen::Vector2d(sums.sum.data()) / n;  // eq. 2
  Eigen::Matrix2d C;                                               // eq. 3
  C << sums.products[0], sums.products[1], sums.products[1], sums.products[3];
  C = (C - n * q * q.transpose()) / (n - 1);

  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(C);
  const double largest = solver.eigenvalues()[1];
  const double rounding = 1e-6 * options.cell_size;  // as in fit_cell
  if (!(largest > rounding * rounding)) return {};

  const Eigen::Vector2d inverse =
      solver.eigenvalues().cwiseMax(largest / options.eigenvalue_ratio).cwiseInverse();
  const Eigen::Matrix2d& V = solver.eigenvectors();
  return PlanarCell{.mean = corner.head<2>() + q,
                    .information = V * inverse.asDiagonal() * V.transpose(),
                    .normal = V.col(0),
                    .wall = wall_likeness(std::max(0.0, solver.eigenvalues()[0]) / largest, n)};
}

PlanarGrid::PlanarGrid(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice,
                       const PlanarNdtOptions& options)
    : lattice_(lattice) {
  const SummedCells sums = sum_cells(points, lattice);
  for (std::size_t c = 0; c < sums.keys.size(); ++c) {
    const Eigen::Vector3d corner = lattice.corner(sums.keys[c]);
    if (const std::optional<PlanarCell> cell = fit_planar_cell(sums.sums[c], corner, options)) {
      table_.insert(sums.keys[c]);
      cells_.push_back(*cell);
      box_.extend(corner);
      box_.extend(Eigen::Vector3d(corner.array() + lattice.side()));
    }
  }
}

std::vector<PlanarGrid> planar_grids(const std::vector<Eigen::Vector3d>& points,
                                     const PlanarNdtOptions& options) {
  const double half = options.cell_size / 2;
  std::vector<PlanarGrid> grids;
  for (const auto& [x, y] : {std::array{0.0, 0.0}, {half, 0.0}, {0.0, half}, {half, half}}) {
    const Eigen::Vector3d origin(options.lattice_origin.x() + x, options.lattice_origin.y() + y, 0);
    grids.emplace_back(points, Lattice(options.cell_size, origin), options);
    if (!options.overlap) break;
  }
  return grids;
}

PlanarScore planar_score(const PlanarCell& cell, const Eigen::Isometry2d& T_target_source,
                         const Eigen::Vector2d& point, Curvature curvature) {
  PlanarScore score;
  const Seen seen(cell, T_target_source, point);
  if (!seen.counts()) return score;
  add_term(cell, seen, curvature, score);
  score.met = 1;
  return score;
}

PlanarScore planar_score(const std::vector<PlanarGrid>& grids,
                         const Eigen::Isometry2d& T_target_source,
                         const std::vector<Eigen::Vector3d>& points, Curvature curvature) {
  PlanarScore sum;
  sum.met = visit_terms(
      grids, T_target_source, points,
      [&](const PlanarCell& cell, const Seen& seen) { add_term(cell, seen, curvature, sum); });
  return sum;
}

RegistrationResult register_planar_ndt(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const PlanarNdtOptions& options) {
  check_options(options);
  return registered(target, source, T_guess,
                    [&](const PointCloud& near_target, const PointCloud& near_source,
                        RegistrationResult& result) {
                      // A whole number of metres; the difference has the rounding of the
                      // coordinates.
                      const double lift =
                          std::round(target.points.front().z() - near_target.points.front().z());
                      run_planar_ndt(near_target, near_source, lift, options, result);
                    });
}

}  // namespace minescan
