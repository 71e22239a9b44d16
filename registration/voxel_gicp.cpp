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

std::vector<Eigen::Vector3d> normals_of(const PointCloud& cloud, int neighbours) {
  return cloud.normals.empty() ? found_normals(cloud.points, neighbours) : cloud.normals;
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

  const double needed = needed_points(used.points.size(), options.min_overlap);
  const auto find = [&](const Pose& T, std::vector<QuadraticPair>& pairs) {
    return pair_voxels(map, used, T, options, pairs);
  };
  const PairsAtEnd end =
      step_and_pair(find, needed, length, Motion::separate, options.search, result);
  if (result.status != Status::no_overlap) {
    const Matrix6d held = held_by(end.pairs, result.T_target_source);
    conclude(end.pairs, held, length, options.min_rank, result);
  }
  count_unmet(used.points, end.met, box, result);
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
                        const VoxelGicpOptions& options, std::vector<QuadraticPair>& pairs) {
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
                       .quadric = {.centre = voxel->mean, .A = (voxel->covariance + C).inverse()},
                       .normal = voxel->normal,
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

RegistrationResult register_voxel_gicp(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const VoxelGicpOptions& options) {
  return registered(target, source, T_guess, options, run_voxel_gicp);
}

}  // namespace minescan
