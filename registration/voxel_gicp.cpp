// SPDX-License-Identifier: MIT
#include "registration/voxel_gicp.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>

#include "registration/bounds.h"
#include "registration/normals.h"
#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

/// Variances of 1 along the surface, `flatness` across it; 1 all around without a normal.
Eigen::Matrix3d flat_covariance(const Eigen::Vector3d& normal, double flatness) {
  return Eigen::Matrix3d::Identity() - (1 - flatness) * normal * normal.transpose();
}

/// (I, -[y]x): how a point moves with (tau, omega), y being the rotated point.
Eigen::Matrix<double, 3, 6> motion_of(const Eigen::Vector3d& y) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(y);
  return J;
}

std::vector<Eigen::Vector3d> normals_of(const PointCloud& cloud, int neighbours) {
  return cloud.normals.empty() ? found_normals(cloud.points, neighbours) : cloud.normals;
}

/// What the last pairs say of the pose.
void conclude(const std::vector<VoxelPair>& pairs, double length, const VoxelGicpOptions& options,
              RegistrationResult& result) {
  const Pose& T = result.T_target_source;
  Matrix6d held = Matrix6d::Zero();
  double weights = 0;
  for (const VoxelPair& pair : pairs) {
    const Vector6d along = motion_of(T.linear() * pair.point).transpose() * pair.voxel->normal;
    held += pair.weight * along * along.transpose();
    weights += pair.weight;
  }
  result.directions = directions_of(held, length);
  if (!(result.directions.front().hold >= options.min_rank)) {
    result.status = Status::degenerate;
    return;
  }
  const Score score = voxel_score(pairs, T, Curvature::gauss_newton);
  result.score = 2 * score.value / weights;
  const double mean_weight = weights / static_cast<double>(pairs.size());
  result.covariance = result.score / 3 * mean_weight * score.hessian.inverse();
}

void run_voxel_gicp(const PointCloud& target, const PointCloud& source,
                    const VoxelGicpOptions& options, RegistrationResult& result) {
  Stopwatch watch;
  PointCloud used = *used_source(source, options.sampling);
  used.normals = normals_of(used, options.neighbours);
  const double length = rms_distance(used.points);
  result.used_points = used.points.size();
  result.time.source = watch.lap();

  const UsedCloud built_from = used_target(target, options.sampling);
  const VoxelMap map(built_from->points, normals_of(*built_from, options.neighbours),
                     options.cell_size, options.flatness);
  const Bounds box = bounds_of(built_from->points);
  result.target_bytes = map.bytes();
  result.time.target = watch.lap();

  const double needed =
      std::max(6.0, options.min_overlap * static_cast<double>(used.points.size()));
  std::vector<VoxelPair> pairs;
  pairs.reserve(used.points.size());
  std::size_t met = 0;
  Pose& T = result.T_target_source;
  const auto find = [&] {
    ++result.evaluations;
    met = pair_voxels(map, used, T, options, pairs);
    if (static_cast<double>(met) < needed) result.status = Status::no_overlap;
  };
  const Objective objective{
      .score = [&](const Pose& pose,
                   Curvature curvature) { return voxel_score(pairs, pose, curvature); },
      .value =
          [&](const Pose& pose) { return voxel_score(pairs, pose, Curvature::gauss_newton).value; },
      .length = length};
  SearchOptions step = options.search;
  step.max_iterations = 1;
  find();
  while (result.status == Status::max_iterations &&
         result.iterations < options.search.max_iterations) {
    ++result.iterations;
    const Found found = minimise(objective, T, step);
    result.evaluations += found.evaluations;
    T = found.pose;
    find();
    if (found.converged && result.status == Status::max_iterations)
      result.status = Status::converged;
  }
  if (result.status != Status::no_overlap) conclude(pairs, length, options, result);
  for (const Eigen::Vector3d& p : used.points) {
    const Eigen::Vector3d moved = T * p;
    if ((moved.array() < box.low.array()).any() || (moved.array() > box.high.array()).any())
      ++result.outside_points;
  }
  result.outside_points = std::min(result.outside_points, used.points.size() - met);
  result.empty_points = used.points.size() - met - result.outside_points;
  result.time.align = watch.lap();
}

}  // namespace

VoxelMap::VoxelMap(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<Eigen::Vector3d>& normals, double cell_size, double flatness)
    : lattice_(cell_size) {
  const NumberedCells numbered = number_cells(points, lattice_, "cell-size");
  for (const std::uint64_t key : numbered.keys) table_.insert(key);
  voxels_.resize(numbered.keys.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t number = numbered.cell_of[i];
    Voxel& voxel = voxels_[number];
    voxel.count += 1;
    // From the corner: coordinates far from the origin would lose digits.
    voxel.mean += points[i] - lattice_.corner(numbered.keys[number]);
    voxel.covariance += flat_covariance(normals[i], flatness);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  for (std::size_t v = 0; v < voxels_.size(); ++v) {
    Voxel& voxel = voxels_[v];
    voxel.mean = voxel.mean / voxel.count + lattice_.corner(numbered.keys[v]);
    voxel.covariance /= voxel.count;
    solver.compute(voxel.covariance);
    voxel.normal = solver.eigenvectors().col(0);
  }
}

const Voxel* VoxelMap::find(const std::array<int, 3>& cell) const {
  for (const int index : cell)
    if (index < -Lattice::index_limit || index >= Lattice::index_limit) return nullptr;
  const std::uint32_t number = table_.find(Lattice::key(cell));
  return number == KeyTable::not_found ? nullptr : &voxels_[number];
}

std::size_t pair_voxels(const VoxelMap& map, const PointCloud& used, const Pose& T_target_source,
                        const VoxelGicpOptions& options, std::vector<VoxelPair>& pairs) {
  pairs.clear();
  std::size_t met = 0;
  for (std::size_t i = 0; i < used.points.size(); ++i) {
    const std::uint64_t key = map.lattice().key(T_target_source * used.points[i]);
    if (key == Lattice::no_key) continue;
    const std::array<int, 3> own = Lattice::indices(key);
    const Eigen::Matrix3d C =
        flat_covariance(T_target_source.linear() * used.normals[i], options.flatness);
    const std::size_t before = pairs.size();
    const auto pair_with = [&](const std::array<int, 3>& cell) {
      const Voxel* voxel = map.find(cell);
      if (!voxel) return;
      pairs.push_back({.point = used.points[i],
                       .voxel = voxel,
                       .information = (voxel->covariance + C).inverse(),
                       .weight = options.count_weight ? voxel->count : 1});
    };
    pair_with(own);
    if (options.neighbourhood == VoxelNeighbourhood::faces) {
      for (const std::size_t axis : {0u, 1u, 2u}) {
        for (const int side : {-1, 1}) {
          std::array<int, 3> cell = own;
          cell[axis] += side;
          pair_with(cell);
        }
      }
    }
    met += pairs.size() > before;
  }
  return met;
}

Score voxel_score(const std::vector<VoxelPair>& pairs, const Pose& T_target_source,
                  Curvature curvature) {
  Score sum{.met = pairs.size()};
  for (const VoxelPair& pair : pairs) {
    const Eigen::Vector3d y = T_target_source.linear() * pair.point;
    const Eigen::Vector3d d = y + T_target_source.translation() - pair.voxel->mean;
    const Eigen::Matrix3d M = pair.weight * pair.information;
    const Eigen::Vector3d v = M * d;
    const Eigen::Matrix<double, 3, 6> J = motion_of(y);
    sum.value += d.dot(v) / 2;
    sum.gradient += J.transpose() * v;
    sum.hessian += J.transpose() * (M * J);
    if (curvature == Curvature::gauss_newton) continue;
    sum.hessian.bottomRightCorner<3, 3>() += (v * y.transpose() + y * v.transpose()) / 2;
    sum.hessian.bottomRightCorner<3, 3>().diagonal().array() -= v.dot(y);
  }
  return sum;
}

RegistrationResult register_voxel_gicp(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const VoxelGicpOptions& options) {
  return registered(target, source, T_guess, options, run_voxel_gicp);
}

}  // namespace minescan
