// SPDX-License-Identifier: MIT
// Registration with quadratic approximations of the squared distance from the target's surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/kdtree.h"
#include "registration/lattice.h"
#include "registration/normals.h"
#include "registration/quadratic_pairs.h"
#include "registration/result.h"
#include "registration/sampling.h"
#include "registration/search.h"

namespace minescan {

/// Where the quadratic functions come from.
enum class Approximant {
  on_demand,  // from normal and curvatures of the surface at the nearest target point
  octree,     // from cells about the surface, each with one fitted to squared distances beforehand
};
constexpr auto names_of(Approximant) {
  return std::to_array<std::string_view>({"on_demand", "octree"});
}

struct DistanceOctreeOptions {
  double cell_size = 0.5;     // metres, of the smallest cells; assumed
  int depth = 2;              // how often cells may be merged, eight to one
  double merge_error = 0.01;  // m^2, RMS error of the squared distances in a merged cell; assumed
};

template <class Visitor>
void fields(DistanceOctreeOptions& o, Visitor&& field) {
  field("cell-size", o.cell_size, between(0.001, 1000), "m", "octree: side of the smallest cells");
  field("depth", o.depth, between(0, 4), "", "octree: how often eight cells may become one");
  field("merge-error", o.merge_error, between(0, 1e6), "m^2",
        "octree: RMS error of the squared distance up to which they do");
}

struct DistanceQuadricsOptions {
  SamplingOptions sampling = {};
  Approximant approximant = Approximant::on_demand;
  double max_distance = 1.0;  // metres; as IcpOptions::max_distance
  int neighbours = 30;        // from which normal and curvatures are found; assumed
  DistanceOctreeOptions octree = {};
  // Of one pairing after the other: every iteration is one step with new functions.
  SearchOptions search = {.optimiser = Optimiser::gauss_newton, .max_step = 0.5};
  double min_overlap = 0.05;  // assumed
  double min_rank = 5e-4;     // as NdtOptions::min_rank
};

template <class Visitor>
void fields(DistanceQuadricsOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("approximant", o.approximant, "where the approximations of the squared distance come from");
  field("max-distance", o.max_distance, above_up_to(0, 1000), "m",
        "points further from the target are left out; octree: cells up to there (at most 16)");
  field("neighbours", o.neighbours, between(6, 1000), "",
        "points from which normal and curvatures are found");
  fields(o.octree, field);
  fields(o.search, field);
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must be near the target, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "smallest / largest eigenvalue of what the surfaces hold, below which it is degenerate");
}

/// Registers `source` to `target` by making the squared distances of the points from the target's
/// surface small, of which every iteration uses quadratic approximations. A step gives the points
/// velocities; they are moved on along the screw motion that begins so, which is shortened until
/// the sum falls as Armijo asks.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite.
///                 Normals of the clouds are not used: they come with the curvatures
/// T_guess         start pose T_target_source
/// returns         status converged when a step is below stop_step or nothing lower is found along
///                 it; no_overlap when fewer than 6 or min_overlap of the used points are near the
///                 target; degenerate when the surfaces met leave a direction free (min_rank).
///                 score: mean of the functions, m^2. covariance: as register_icp, and as
///                 optimistic; zero where the score is not positive. directions: of the sum of
///                 J^T n n^T J, n being the normals at the nearest target points.
///                 outside_points: further than max_distance from the target's bounding box.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite, an
///                 option out of range, or, with the octree, a point more than 2^18 of its cells
///                 from the origin or a max_distance of more than 16 of them
/// cost            on demand O(N log N + iterations * M log N) time, O(N) memory; the octree takes
///                 O(cells log N) to build and O(M) for an iteration, O(N + cells) memory
/// source          Mitra, Gelfand, Pottmann, Guibas 2004; paper, section 2.3
RegistrationResult register_distance_quadrics(const PointCloud& target, const PointCloud& source,
                                              const Pose& T_guess,
                                              const DistanceQuadricsOptions& options = {});

/// A surface about one of its points, to second order.
struct SurfacePatch {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // zero: there is no surface
  /// Columns: the principal directions, unit vectors across each other and the normal.
  Eigen::Matrix<double, 3, 2> directions = Eigen::Matrix<double, 3, 2>::Zero();
  /// 1/m, positive where the surface bends towards the normal.
  Eigen::Vector2d curvatures = Eigen::Vector2d::Zero();
};

/// The patch of the quadric z = f + d x + e y + a x^2 + b x y + c y^2 through `neighbours` (by
/// least squares) about `point`, z being along `rough_normal`. A plane with that normal where they
/// are fewer than six or do not fix a quadric.
SurfacePatch fit_patch(const Eigen::Vector3d& point, const Eigen::Vector3d& rough_normal,
                       const std::vector<Neighbour>& neighbours,
                       const std::vector<Eigen::Vector3d>& points);

/// The squared distance from the surface to second order about `x`:
/// F = x3^2 + delta_1 x1^2 + delta_2 x2^2 in the coordinates of the patch, with
/// delta = d kappa / (d kappa - 1), d being x's distance along the normal. Between the surface and
/// its focal point delta would be negative: it is kept in [0, 1].
Quadric distance_quadric(const SurfacePatch& patch, const Eigen::Vector3d& x);

/// Cells in a band about the points, also empty ones, with quadrics fitted to squared distances.
///
/// Squared distances from the nearest point are sampled at the corners, the middles of edges and
/// faces and the centre of the smallest cells. Eight cells that make up one of twice the side
/// become one while the RMS error of its quadric at all samples in it is at most merge_error.
class DistanceOctree {
 public:
  /// `tree` is of `points`. Covers all places up to `band` metres from a point.
  DistanceOctree(const std::vector<Eigen::Vector3d>& points, const KdTree& tree, double band,
                 const DistanceOctreeOptions& options);

  /// The quadric of the cell that holds `x`, or null outside the cells.
  const Quadric* find(const Eigen::Vector3d& x) const;

  struct Cell {
    Quadric quadric = {};  // about the cell's centre
    double side = 0;       // metres
    double error = 0;      // RMS at the samples, m^2
  };
  const std::vector<Cell>& cells() const { return cells_; }
  std::size_t bytes() const;

 private:
  Lattice lattice_;  // of the smallest cells
  KeyTable table_;
  std::vector<std::uint32_t> cell_of_;  // of a smallest cell, the one that it is in now
  std::vector<Cell> cells_;
};

}  // namespace minescan
