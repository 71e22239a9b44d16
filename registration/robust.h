// SPDX-License-Identifier: MIT
// Registration from far away, of scans of any kind, without settings to tune: several searches with
// blurred cells, the most likely end of which is refined with 3D-NDT.
#pragma once

#include <cstdint>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"

namespace minescan {

/// All defaults were found by trials, on scans of mines with 10 to 40 m of reach and two pairs of
/// real scans (docs/robust.md, which also tells what each part buys).
struct RobustOptions {
  double cell_size = 0.5;    // metres, of the last level; of those before twice and 4 times that
  int points = 28000;        // source points of the last two levels, at most
  int coarse_points = 2000;  // of the searches before, at most
  int min_cell_points = 5;
  double eigenvalue_ratio = 100;  // as NdtGridOptions::eigenvalue_ratio
  // Metres: standard deviations by which the coarse cells are blurred, one search after the other.
  std::vector<double> blurs = {2, 1, 0.5, 0.25};
  // 1: cells are taken for bodies as well; 0: for walls only. A number, so that a study can vary
  // it.
  int bodies = 1;
  int turns = 1;       // further starts, turned about the vertical one way and the other
  double turn = 0.5;   // radians between them
  int slides = 6;      // further starts on either side along the axis of a tunnel
  double slide = 0.5;  // metres between them
  // A target is a tunnel if the smallest eigenvalue of the sum of n n^T over its cells' normals is
  // below this part of the largest: 0.04 to 0.2 in tunnels, 0.45 and more in a junction.
  double weak = 0.25;
  std::uint64_t seed = 1;
  double min_overlap = 0.05;  // as NdtOptions::min_overlap, of densities; assumed
  double min_rank = 5e-4;     // as NdtOptions::min_rank
};

template <class Visitor>
void fields(RobustOptions& o, Visitor&& field) {
  field("cell-size", o.cell_size, between(0.001, 250), "m",
        "side of a cell of the last level; those before have twice and 4 times that");
  field("points", o.points, between(6, 1e9), "", "source points used at the end, at most");
  field("coarse-points", o.coarse_points, between(6, 1e9), "", "and before that, at most");
  field("min-cell-points", o.min_cell_points, between(4, 1e6), "", "points that a cell needs");
  field("eigenvalue-ratio", o.eigenvalue_ratio, between(1, 1e9), "",
        "largest ratio of the eigenvalues of a cell's covariance; small ones are raised to it");
  field("blurs", o.blurs, above_up_to(0, 1000), "m",
        "standard deviations that blur the coarse cells, one search after the other");
  field("bodies", o.bodies, between(0, 1), "",
        "1: coarse searches with cells as bodies and as walls; 0: as walls only");
  field("turns", o.turns, between(0, 100), "",
        "further starts turned about the vertical each way, in tunnels and where walls and bodies "
        "do not agree");
  field("turn", o.turn, above_up_to(0, 3.15), "rad", "angle between them");
  field("slides", o.slides, between(0, 1000), "",
        "further starts on either side along the axis, in tunnels");
  field("slide", o.slide, above_up_to(0, 1000), "m", "distance between them");
  field("weak", o.weak, between(0, 1), "",
        "smallest / largest eigenvalue of the walls' normals below which it is a tunnel");
  field("sample-seed", o.seed, not_negative, "", "names the random choice of points");
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "mean density of the used points that is needed, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "hold of a direction below which the result is degenerate");
}

/// Registers `source` to `target` from a start pose that may be metres or half a turn off.
///
/// The target becomes normal distributions in three lattices, each of cells twice as large as the
/// one before. The coarse cells are blurred: first so much that the search sees them from metres
/// away, then less and less. It is done twice, with cells as walls (only the distance from the
/// plane counts) and as bodies (the whole covariance, and every place looks at the cell nearest to
/// it). The ends are refined with 3D-NDT in the middle cells, and the most likely is kept. Where
/// the two do not agree, turned starts follow. In a tunnel, whose walls say little of the position
/// along it, coarse searches are held there by a spring, and starts along it follow. The end is
/// 3D-NDT in the middle and the small cells with many points.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite
/// T_guess         start pose T_target_source
/// returns         status converged when the last level's last step is below 1e-4; no_overlap when
///                 the used points' mean density in the middle cells is below min_overlap or fewer
///                 than 6 meet a cell; degenerate as register_ndt, in the middle cells.
///                 score: of the last level. iterations and evaluations: of all searches.
///                 covariance and directions: as register_ndt, in the middle cells.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite or
///                 more than 2^20 cells from the origin, an option out of range, or a target whose
///                 cells with distributions spread over a box of more than 2^24 cells
/// cost            O(N + M) time for the preparation and a few hundred passes over coarse_points,
///                 some 20 over points; memory O(N + M + cells of the box)
/// source          own, from parts that are known: iterative subdivision, linked cells and infinite
///                 bounds (paper, section 4.3), point-to-plane distances (Chen and Medioni 1992),
///                 graduated non-convexity (Blake and Zisserman 1987) for the blurs
RegistrationResult register_robust(const PointCloud& target, const PointCloud& source,
                                   const Pose& T_guess, const RobustOptions& options = {});

}  // namespace minescan
