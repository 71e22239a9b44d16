// SPDX-License-Identifier: MIT
// Voxelised generalized ICP: flat distributions about the source points, drawn to the mean
// distributions in cells of the target.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/lattice.h"
#include "registration/quadratic_pairs.h"
#include "registration/result.h"
#include "registration/sampling.h"
#include "registration/search.h"

namespace minescan {

/// Which cells of the target a point is paired with.
enum class VoxelNeighbourhood {
  own,    // the one that it lies in
  faces,  // and the 6 beyond its faces
};
constexpr auto names_of(VoxelNeighbourhood) {
  return std::to_array<std::string_view>({"own", "faces"});
}

struct VoxelGicpOptions {
  SamplingOptions sampling = {};
  double cell_size = 1.0;  // metres; assumed, as for 3D-NDT
  VoxelNeighbourhood neighbourhood = VoxelNeighbourhood::own;
  bool count_weight = true;  // Koide et al. 2021; small_gicp, of the same authors, has none
  int neighbours = 10;       // from which normals are found; as IcpOptions::neighbours
  double flatness = 1e-3;    // a ratio of variances (Segal et al. 2009)
  // Of one pairing after the other: every iteration is one step with new pairs.
  SearchOptions search = {.optimiser = Optimiser::gauss_newton, .max_step = 0.5};
  double min_overlap = 0.05;  // assumed
  double min_rank = 5e-4;     // as NdtOptions::min_rank
};

template <class Visitor>
void fields(VoxelGicpOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("cell-size", o.cell_size, between(0.001, 1000), "m", "side of a cell");
  field("neighbourhood", o.neighbourhood, "which cells a point is paired with");
  field("count-weight", o.count_weight, "a pair counts as often as there are points in its cell");
  field("neighbours", o.neighbours, between(3, 1000), "",
        "points from which a normal is found, where the cloud has none");
  field("flatness", o.flatness, above_up_to(0, 1), "",
        "variance of a distribution across a surface / along it");
  fields(o.search, field);
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must lie in a cell, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "smallest / largest eigenvalue of what the pairs hold, below which it is degenerate");
}

/// Registers `source` to `target` with voxelised generalized ICP. As in generalized ICP every point
/// stands for a flat distribution, with variances of 1 m^2 along the surface and `flatness` across
/// it. A cell of the target keeps the mean of its points and the mean of their covariances, so that
/// a partner is looked up, not searched for. Every iteration pairs the points anew and takes one
/// step of `search` with these pairs.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite.
///                 Normals are the clouds' own, or found: of the target among all its used points,
///                 of the source among the used ones
/// T_guess         start pose T_target_source
/// returns         status converged when a step is below stop_step or nothing lower is found along
///                 it; no_overlap when fewer than 6 or min_overlap of the used points lie in a
///                 cell; degenerate when the surfaces of the cells met leave a direction free
///                 (min_rank). score: mean squared distance of the last pairs, in the metric of
///                 their distributions. covariance: as register_icp, and as optimistic.
///                 directions: of the sum of w J^T n n^T J over the pairs, n being the direction in
///                 which a cell is thinnest. outside_points: outside the target's bounding box.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite or
///                 more than 2^20 cells from the origin, or an option out of range
/// cost            O(N log N + M log M) time for the normals, O(M) for an iteration; memory O(N)
///                 while preparing, O(cells + M) after
/// source          Koide, Yokozuka, Oishi, Banno 2021: Voxelized GICP
RegistrationResult register_voxel_gicp(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const VoxelGicpOptions& options = {});

/// What a cell keeps of its points.
struct Voxel {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // mean of the points' covariances, m^2
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();      // direction of the least variance
  double count = 0;
};

class VoxelMap {
 public:
  /// `normals`: one per point, a unit vector or zero where not known (a round distribution).
  /// Throws as number_cells.
  VoxelMap(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& normals,
           double cell_size, double flatness);

  const Voxel* find(const std::array<int, 3>& cell) const;
  const Lattice& lattice() const { return lattice_; }
  std::size_t bytes() const { return voxels_.size() * sizeof(Voxel) + table_.bytes(); }

 private:
  Lattice lattice_;
  KeyTable table_;
  std::vector<Voxel> voxels_;
};

/// The pairs at a pose, point by point: F = d^T (C_voxel + R C_point R^T)^-1 d, d being the
/// distance from the mean, weighted with the count if options ask for it. Returns how many points
/// have one; `pairs` is overwritten.
std::size_t pair_voxels(const VoxelMap& map, const PointCloud& used, const Pose& T_target_source,
                        const VoxelGicpOptions& options, std::vector<QuadraticPair>& pairs);

}  // namespace minescan
