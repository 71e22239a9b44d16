// SPDX-License-Identifier: MIT
// Registration in plan: the normal distributions transform of two dimensions, of all heights at
// once or slice by slice, for scans that are level already.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "core/cloud.h"
#include "registration/lattice.h"
#include "registration/ndt_grid.h"
#include "registration/result.h"
#include "registration/sampling.h"
#include "registration/search.h"

namespace minescan {

/// The defaults are those of Biber and Strasser (2003) where they say something.
struct PlanarNdtOptions {
  double cell_size = 1.0;   // metres; Biber and Strasser
  int min_cell_points = 3;  // Biber and Strasser
  // A cell's smaller eigenvalue is raised to the larger / this ratio (Biber and Strasser).
  double eigenvalue_ratio = 1000;
  // Four lattices, three of them shifted by half a cell along x, y and both (Biber and Strasser).
  bool overlap = true;
  // Corner of the first lattice and, along z, a border between slices; metres, target frame.
  Eigen::Vector3d lattice_origin = Eigen::Vector3d::Zero();
  double slice_height = 0;  // metres; 0: one slice
  // Only points whose heights in the target frame are at most band_height / 2 from band_middle are
  // used, m; of the source, heights under the guess. 0: all.
  double band_height = 0;
  double band_middle = 0;
  SamplingOptions sampling = {};  // of the whole cloud: what of it lies in the band is used
  SearchOptions search = {};
  double min_overlap = 0.05;  // assumed, as in 3D-NDT
  // Measured in cells of 1 m: straight corridors with up to 5 cm of noise give up to 2e-3, a tunnel
  // with 10 cm of relief 0.03 and more.
  double min_rank = 3e-3;
};

template <class Visitor>
void fields(PlanarNdtOptions& o, Visitor&& field) {
  field("cell-size", o.cell_size, between(0.001, 1000), "m", "side of a cell, in plan");
  field("min-cell-points", o.min_cell_points, between(3, 1e6), "", "points that a cell needs");
  field("eigenvalue-ratio", o.eigenvalue_ratio, between(1, 1e9), "",
        "largest ratio of the eigenvalues of a cell's covariance; small ones are raised to it");
  field("overlap", o.overlap, "four lattices, shifted by half a cell; else one");
  field("lattice-x", o.lattice_origin.x(), between(-1000, 1000), "m", "a corner of the lattice");
  field("lattice-y", o.lattice_origin.y(), between(-1000, 1000), "m", "a corner of the lattice");
  field("lattice-z", o.lattice_origin.z(), between(-1000, 1000), "m", "a border between slices");
  field("slice-height", o.slice_height, between(0, 1000), "m", "height of a slice; 0: only one");
  field("band-height", o.band_height, between(0, 1e6), "m",
        "only points of these heights in the target frame are used; 0: all");
  field("band-middle", o.band_middle, between(-1e6, 1e6), "m", "middle of the band");
  fields(o.sampling, field);
  fields(o.search, field);
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must lie in a cell, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "smallest / largest eigenvalue of what walls hold in plan, below which it is degenerate");
}

/// The normal distribution of the points in one cell, seen from above, scaled to 1 at its mean.
struct PlanarCell {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  // inverse covariance, 1/m^2
  Eigen::Vector2d normal = Eigen::Vector2d::UnitY();      // unit vector along which it is thinnest
  /// How clearly the points lie along a line, as those of a wall do, in [0, 1]: see wall_likeness.
  double wall = 0;
};

/// 1 for points along a line, 0 for points all over a cell, as those of a floor: 1 - 10 thickness,
/// at least 0 (assumed), and 0 if `count` points of one round normal distribution would be as thin
/// with a probability above 0.001 (Mauchly 1940; of two dimensions V^(count - 2), V being the
/// geometric / the arithmetic mean of the eigenvalues).
///
/// thickness  smaller / larger eigenvalue of the covariance, in [0, 1]
double wall_likeness(double thickness, double count);

/// From the x and y of the sums. None if there are fewer than min_cell_points or if all lie above
/// each other.
std::optional<PlanarCell> fit_planar_cell(const CellSums& sums, const Eigen::Vector3d& corner,
                                          const PlanarNdtOptions& options);

/// All cells of a cloud in one lattice. Points are (x, y) in metres and, for z, the middle of a
/// cell for each slice, so that the slices are the layers of a cubic lattice.
class PlanarGrid {
 public:
  /// throws  std::invalid_argument for a point more than 2^20 cells from the lattice's origin
  PlanarGrid(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice,
             const PlanarNdtOptions& options);

  /// The cell that holds `p`, or null where there is no distribution.
  const PlanarCell* find(const Eigen::Vector3d& p) const {
    const std::uint32_t number = table_.find(lattice_.key(p));
    return number == KeyTable::not_found ? nullptr : &cells_[number];
  }
  const std::vector<PlanarCell>& cells() const { return cells_; }
  /// Around the cells that have a distribution; empty if none has.
  const Eigen::AlignedBox3d& box() const { return box_; }
  std::size_t bytes() const { return cells_.size() * sizeof(PlanarCell) + table_.bytes(); }

 private:
  Lattice lattice_;
  KeyTable table_;
  std::vector<PlanarCell> cells_;
  Eigen::AlignedBox3d box_;
};

/// One grid, or four with `overlap`.
std::vector<PlanarGrid> planar_grids(const std::vector<Eigen::Vector3d>& points,
                                     const PlanarNdtOptions& options);

/// A score with its derivatives for (tx, ty, phi): t <- t + (tx, ty), R <- R(phi) R.
struct PlanarScore {
  double value = 0;  // lower is better
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  std::size_t met = 0;  // points that contribute
};

/// The term of one source point and one cell (paper, eqs 6 to 11). The derivatives are exact;
/// the Hessian is as `curvature` says.
PlanarScore planar_score(const PlanarCell& cell, const Eigen::Isometry2d& T_target_source,
                         const Eigen::Vector2d& point, Curvature curvature = Curvature::full);

/// The sum of the terms over all points and grids, each point with the cells that it lies in; their
/// z is not moved. Terms below e^-120 are left out of the value and the derivatives alike.
PlanarScore planar_score(const std::vector<PlanarGrid>& grids,
                         const Eigen::Isometry2d& T_target_source,
                         const std::vector<Eigen::Vector3d>& points,
                         Curvature curvature = Curvature::full);

/// Registers `source` to `target` in plan: finds x, y and the turn about the vertical under which
/// the used source points, seen from above, are most likely, if the points in each cell of the
/// target are normally distributed. Height, roll and pitch stay as in the guess, which is first
/// applied to the source. With slices, points meet only cells of their own slice, and the scores of
/// the slices are summed. The search is that of register_ndt, for three unknowns.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite; z
///                 of the target is up. Heights are those of the target's own frame, also where it
///                 is far from its origin.
/// T_guess         start pose T_target_source. Slices need it level: an error alpha of roll or
///                 pitch moves points at range r by r * alpha in height; from half a slice height
///                 on, about half of them come to lie in another slice.
/// returns         status, score and points as register_ndt; degenerate when walls leave a free
///                 direction in plan, where a cell holds only across its line, by its
///                 wall_likeness.
///                 used_points: those of the sample that lie in the band.
///                 covariance: of x, y and the turn, scaled as that of register_ndt; zero for the
///                 rest, which is not estimated. directions: the three in plan.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite or
///                 more than 2^20 cells or slices from the lattice's origin, or an option out of
///                 range
/// cost            O(N + M + iterations * used points) time; O(N + occupied cells) memory
/// source          Biber and Strasser, "The normal distributions transform: a new approach to laser
///                 scan matching", IROS 2003; slices: Ripperda and Brenner, "Marker-free
///                 registration of terrestrial laser scans using the normal distribution
///                 transform", 2005; the paper's section 3 for both
RegistrationResult register_planar_ndt(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const PlanarNdtOptions& options = {});

}  // namespace minescan
