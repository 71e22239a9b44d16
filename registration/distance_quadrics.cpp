// SPDX-License-Identifier: MIT
#include "registration/distance_quadrics.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

constexpr double anywhere = std::numeric_limits<double>::infinity();

/// Two unit vectors across each other and `normal`.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& normal) {
  Eigen::Matrix<double, 3, 2> both;
  both.col(0) = normal.unitOrthogonal();
  both.col(1) = normal.cross(both.col(0));
  return both;
}

/// The patches of a cloud, each found when it is first asked for.
class Patches {
 public:
  Patches(const PointCloud& cloud, const KdTree& tree, int neighbours)
      : cloud_(cloud),
        tree_(tree),
        normals_(cloud, tree, neighbours),
        neighbours_(static_cast<std::size_t>(neighbours)),
        found_(cloud.points.size()) {}

  const SurfacePatch& of(std::uint32_t index) {
    std::optional<SurfacePatch>& found = found_[index];
    if (!found) {
      const Eigen::Vector3d& point = cloud_.points[index];
      tree_.nearest(point, neighbours_, anywhere, nearest_);
      found = fit_patch(point, normals_.of(index), nearest_, cloud_.points);
    }
    return *found;
  }

 private:
  const PointCloud& cloud_;
  const KdTree& tree_;
  Normals normals_;
  std::size_t neighbours_ = 0;
  std::vector<std::optional<SurfacePatch>> found_;
  std::vector<Neighbour> nearest_;
};

/// 1, x, y, z, xx, xy, xz, yy, yz, zz.
using Monomials = Eigen::Matrix<double, 10, 1>;
Monomials monomials(const Eigen::Vector3d& u) {
  const double x = u.x(), y = u.y(), z = u.z();
  Monomials m;
  m << 1, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z;
  return m;
}

/// Least squares fits of quadrics to values at the same places of every cell of one size: places
/// 0 ... steps along each axis, coordinates from -1 to 1.
class CellFit {
 public:
  explicit CellFit(int steps) {
    const int count = (steps + 1) * (steps + 1) * (steps + 1);
    powers_.resize(count, 10);
    for (int i = 0, row = 0; i <= steps; ++i)
      for (int j = 0; j <= steps; ++j)
        for (int k = 0; k <= steps; ++k, ++row)
          powers_.row(row) =
              monomials(2.0 / steps * Eigen::Vector3d(i, j, k) - Eigen::Vector3d::Ones());
    solution_ = (powers_.transpose() * powers_).ldlt().solve(powers_.transpose());
  }

  DistanceOctree::Cell cell(const Eigen::VectorXd& values, const Eigen::Vector3d& centre,
                            double side) const {
    const Monomials m = solution_ * values;
    const double h = side / 2;
    DistanceOctree::Cell cell{.side = side};
    cell.quadric.centre = centre;
    cell.quadric.c = m[0];
    cell.quadric.b = m.segment<3>(1) / (2 * h);
    cell.quadric.A << m[4], m[5] / 2, m[6] / 2,  //
        m[5] / 2, m[7], m[8] / 2,                //
        m[6] / 2, m[8] / 2, m[9];
    cell.quadric.A /= h * h;
    cell.error = (powers_ * m - values).norm() / std::sqrt(static_cast<double>(values.size()));
    return cell;
  }

 private:
  Eigen::MatrixXd powers_;    // samples x 10
  Eigen::MatrixXd solution_;  // 10 x samples
};

/// Squared distances at the places of a lattice, each looked up once.
class DistanceSamples {
 public:
  DistanceSamples(const KdTree& tree, const Lattice& lattice) : tree_(tree), lattice_(lattice) {}

  /// At the corner of a cell of the lattice.
  double at(const std::array<int, 3>& place) {
    const std::uint32_t number = table_.insert(Lattice::key(place));
    if (number == squared_.size())
      squared_.push_back(tree_.nearest(lattice_.corner(place), anywhere)->squared_distance);
    return squared_[number];
  }

  /// At all places of a cell of `steps` cells of the lattice along each axis, from `first` on.
  void of_cell(const std::array<int, 3>& first, int steps, Eigen::VectorXd& values) {
    values.resize((steps + 1) * (steps + 1) * (steps + 1));
    for (int i = 0, row = 0; i <= steps; ++i)
      for (int j = 0; j <= steps; ++j)
        for (int k = 0; k <= steps; ++k, ++row)
          values[row] = at({first[0] + i, first[1] + j, first[2] + k});
  }

 private:
  const KdTree& tree_;
  const Lattice lattice_;
  KeyTable table_;
  std::vector<double> squared_;
};

/// Keys of the cells that come within `band` of a point.
std::vector<std::uint64_t> cells_about(const std::vector<Eigen::Vector3d>& points,
                                       const KdTree& tree, const Lattice& lattice, double band) {
  const int reach = static_cast<int>(std::ceil(band / lattice.side()));
  const double half = lattice.side() / 2;
  const double limit = band + half * std::sqrt(3.0);  // of centres
  KeyTable seen;
  std::vector<std::uint64_t> keys;
  for (const std::uint64_t own : number_cells(points, lattice, "cell-size").keys) {
    const std::array<int, 3> cell = Lattice::indices(own);
    for (int i = -reach; i <= reach; ++i)
      for (int j = -reach; j <= reach; ++j)
        for (int k = -reach; k <= reach; ++k) {
          const std::uint64_t key =
              Lattice::key(std::array<int, 3>{cell[0] + i, cell[1] + j, cell[2] + k});
          const std::uint32_t before = seen.size();
          seen.insert(key);
          if (seen.size() == before) continue;
          const Eigen::Vector3d centre = lattice.corner(key) + Eigen::Vector3d::Constant(half);
          if (tree.nearest(centre, limit)) keys.push_back(key);
        }
  }
  return keys;
}

int halved(int index) { return index >> 1; }  // rounded down, as C++20 has it

Bounds grown(Bounds box, double by) {
  box.low.array() -= by;
  box.high.array() += by;
  return box;
}

void run_distance_quadrics(const PointCloud& target, const PointCloud& source,
                           const DistanceQuadricsOptions& options, RegistrationResult& result) {
  Stopwatch watch;
  const UsedCloud used = used_source(source, options.sampling);
  const std::vector<Eigen::Vector3d>& points = used->points;
  const double length = rms_distance(points);
  result.used_points = points.size();
  result.time.source = watch.lap();

  // Without normals of its own: they are to fit the curvatures.
  const PointCloud surface{.points = used_target(target, options.sampling)->points};
  const KdTree tree(surface.points);
  Patches patches(surface, tree, options.neighbours);
  std::optional<DistanceOctree> octree;
  if (options.approximant == Approximant::octree)
    octree.emplace(surface.points, tree, options.max_distance, options.octree);
  result.target_bytes = tree.bytes() + (octree ? octree->bytes() : 0);
  result.time.target = watch.lap();

  const auto on_demand = [&](const Pose& T, std::vector<QuadraticPair>& pairs) {
    pairs.clear();
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector3d x = T * point;
      const std::optional<Neighbour> near = tree.nearest(x, options.max_distance);
      if (!near) continue;
      const SurfacePatch& patch = patches.of(near->index);
      if (patch.normal.isZero(0)) continue;
      pairs.push_back(
          {.point = point, .quadric = distance_quadric(patch, x), .normal = patch.normal});
    }
    return pairs.size();
  };
  const auto in_octree = [&](const Pose& T, std::vector<QuadraticPair>& pairs) {
    pairs.clear();
    for (const Eigen::Vector3d& point : points)
      if (const Quadric* quadric = octree->find(T * point))
        pairs.push_back({.point = point, .quadric = *quadric});
    return pairs.size();
  };
  const double needed = needed_points(points.size(), options.min_overlap);
  const PairsAtEnd end =
      octree ? step_and_pair(in_octree, needed, length, Motion::screw, options.search, result)
             : step_and_pair(on_demand, needed, length, Motion::screw, options.search, result);
  if (result.status != Status::no_overlap) {
    std::vector<QuadraticPair> surfaces;
    if (octree) on_demand(result.T_target_source, surfaces);
    const Matrix6d held = held_by(octree ? surfaces : end.pairs, result.T_target_source);
    conclude(end.pairs, held, length, options.min_rank, result);
  }
  count_unmet(points, end.met,
              grown({.low = tree.low(), .high = tree.high()}, options.max_distance), result);
  result.time.align = watch.lap();
}

}  // namespace

SurfacePatch fit_patch(const Eigen::Vector3d& point, const Eigen::Vector3d& rough_normal,
                       const std::vector<Neighbour>& neighbours,
                       const std::vector<Eigen::Vector3d>& points) {
  SurfacePatch patch{.point = point, .normal = rough_normal};
  if (rough_normal.isZero(0)) return patch;
  patch.directions = across(rough_normal);
  const double reach =
      neighbours.empty() ? 0 : std::sqrt(neighbours.back().squared_distance);  // the furthest
  if (neighbours.size() < 6 || !(reach > 0)) return patch;

  // In units of the reach, so that the squares are as large as the rest.
  Eigen::Matrix<double, 6, 6> normal_matrix = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6d right = Vector6d::Zero();
  for (const Neighbour& n : neighbours) {
    const Eigen::Vector3d d = (points[n.index] - point) / reach;
    const Eigen::Vector2d u = patch.directions.transpose() * d;
    Vector6d row;
    row << 1, u.x(), u.y(), u.x() * u.x(), u.x() * u.y(), u.y() * u.y();
    normal_matrix += row * row.transpose();
    right += rough_normal.dot(d) * row;
  }
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 6, 6>> qr(normal_matrix);
  // Of the six, the one that is fixed least: rounding leaves 1e-16 (assumed: 1e-9 is enough).
  if (!(std::abs(qr.matrixR()(5, 5)) > 1e-9 * qr.maxPivot())) return patch;
  const Vector6d fit = qr.solve(right);

  // The two fundamental forms of the graph at the point, in metres again.
  const double d = fit[1], e = fit[2];
  Eigen::Matrix2d first, second;
  first << 1 + d * d, d * e, d * e, 1 + e * e;
  second << 2 * fit[3], fit[4], fit[4], 2 * fit[5];
  second /= reach * std::sqrt(1 + d * d + e * e);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> solver(second, first);
  Eigen::Matrix<double, 3, 2> tangents = patch.directions;
  tangents.col(0) += d * rough_normal;
  tangents.col(1) += e * rough_normal;
  patch.normal =
      (rough_normal - d * patch.directions.col(0) - e * patch.directions.col(1)).normalized();
  patch.directions = tangents * solver.eigenvectors();
  patch.curvatures = solver.eigenvalues();
  return patch;
}

Quadric distance_quadric(const SurfacePatch& patch, const Eigen::Vector3d& x) {
  Quadric quadric{.centre = patch.point, .A = patch.normal * patch.normal.transpose()};
  const double d = patch.normal.dot(x - patch.point);
  for (int j = 0; j < 2; ++j) {
    const double dk = d * patch.curvatures[j];
    const double delta = dk == 1 ? 1 : std::clamp(dk / (dk - 1), 0.0, 1.0);
    quadric.A += delta * patch.directions.col(j) * patch.directions.col(j).transpose();
  }
  return quadric;
}

DistanceOctree::DistanceOctree(const std::vector<Eigen::Vector3d>& points, const KdTree& tree,
                               double band, const DistanceOctreeOptions& options)
    : lattice_(options.cell_size) {
  if (!(band <= 16 * options.cell_size)) {
    throw std::invalid_argument(
        fmt::format("max-distance = {}: expected at most 16 of the octree's cells, cell-size = {}",
                    band, options.cell_size));
  }
  // Room for the band and for samples of half a cell.
  const Lattice quarters(options.cell_size / 4);
  for (const Eigen::Vector3d& p : points) quarters.checked_key(p, "cell-size");

  DistanceSamples samples(tree, Lattice(options.cell_size / 2));
  Eigen::VectorXd values;
  const auto fitted = [&](const CellFit& fit, const std::array<int, 3>& cell, int level) {
    const int width = 1 << level;  // in smallest cells
    const std::array<int, 3> smallest = {cell[0] * width, cell[1] * width, cell[2] * width};
    samples.of_cell({2 * smallest[0], 2 * smallest[1], 2 * smallest[2]}, 2 * width, values);
    const double side = options.cell_size * width;
    return fit.cell(values, lattice_.corner(smallest) + Eigen::Vector3d::Constant(side / 2), side);
  };

  const CellFit smallest_fit(2);
  std::vector<std::array<int, 3>> level_cells;   // of the level being merged
  std::vector<std::uint32_t> level_number = {};  // into `made`
  std::vector<Cell> made;
  std::vector<std::uint32_t> merged_into;  // per cell made; itself if not merged
  for (const std::uint64_t key : cells_about(points, tree, lattice_, band)) {
    cell_of_.push_back(table_.insert(key));
    level_cells.push_back(Lattice::indices(key));
    level_number.push_back(static_cast<std::uint32_t>(made.size()));
    merged_into.push_back(static_cast<std::uint32_t>(made.size()));
    made.push_back(fitted(smallest_fit, level_cells.back(), 0));
  }
  for (int level = 1; level <= options.depth && !level_cells.empty(); ++level) {
    KeyTable parents;
    std::vector<std::vector<std::uint32_t>> children;
    std::vector<std::array<int, 3>> parent_cells;
    for (std::size_t i = 0; i < level_cells.size(); ++i) {
      const std::array<int, 3>& cell = level_cells[i];
      const std::array<int, 3> parent = {halved(cell[0]), halved(cell[1]), halved(cell[2])};
      const std::uint32_t number = parents.insert(Lattice::key(parent));
      if (number == children.size()) {
        children.emplace_back();
        parent_cells.push_back(parent);
      }
      children[number].push_back(level_number[i]);
    }
    const CellFit fit(2 << level);
    level_cells.clear();
    level_number.clear();
    for (std::size_t i = 0; i < children.size(); ++i) {
      if (children[i].size() < 8) continue;
      const Cell cell = fitted(fit, parent_cells[i], level);
      if (!(cell.error <= options.merge_error)) continue;
      const auto number = static_cast<std::uint32_t>(made.size());
      made.push_back(cell);
      merged_into.push_back(number);
      for (const std::uint32_t child : children[i]) merged_into[child] = number;
      level_cells.push_back(parent_cells[i]);
      level_number.push_back(number);
    }
  }
  // Those that are left, numbered anew. Parents come after their children.
  std::vector<std::uint32_t> final_number(made.size());
  for (std::uint32_t i = 0; i < made.size(); ++i) {
    if (merged_into[i] != i) continue;
    final_number[i] = static_cast<std::uint32_t>(cells_.size());
    cells_.push_back(made[i]);
  }
  for (std::size_t i = made.size(); i-- > 0;)
    if (merged_into[i] != i) final_number[i] = final_number[merged_into[i]];
  for (std::uint32_t& cell : cell_of_) cell = final_number[cell];
}

const Quadric* DistanceOctree::find(const Eigen::Vector3d& x) const {
  const std::uint64_t key = lattice_.key(x);
  if (key == Lattice::no_key) return nullptr;
  const std::uint32_t number = table_.find(key);
  return number == KeyTable::not_found ? nullptr : &cells_[cell_of_[number]].quadric;
}

std::size_t DistanceOctree::bytes() const {
  return cells_.size() * sizeof(Cell) + cell_of_.size() * sizeof(cell_of_[0]) + table_.bytes();
}

RegistrationResult register_distance_quadrics(const PointCloud& target, const PointCloud& source,
                                              const Pose& T_guess,
                                              const DistanceQuadricsOptions& options) {
  return registered(target, source, T_guess, options, run_distance_quadrics);
}

}  // namespace minescan
