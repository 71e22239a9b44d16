// SPDX-License-Identifier: MIT
// Registration with the three-dimensional normal distributions transform.
#pragma once

#include "core/cloud.h"
#include "registration/ndt_grid.h"
#include "registration/ndt_terms.h"
#include "registration/result.h"
#include "registration/sampling.h"
#include "registration/search.h"

namespace minescan {

/// The defaults are the paper's baseline (section 5).
struct NdtOptions {
  NdtGridOptions grid = {};
  NdtTermOptions terms = {};
  SamplingOptions sampling = {};
  // Coarse to fine ("iterative subdivision", section 4.3.4): one registration after the other, the
  // first with cells of cell_size * level_ratio^(levels - 1), the last with cell_size.
  int levels = 1;
  double level_ratio = 2;
  // The cells of a level are put together from those of the next, so that the points are gone
  // through once (paper, section 4.3.4, which proposes it). Only of undivided cells and with a
  // level_ratio of 2.
  bool merged = false;
  // Near and far (Takeuchi and Tsubouchi 2006): source points this far from their scanner and
  // further, in metres, are scored in cells twice as large until a step is below 0.01 or ten
  // iterations are over. 0: all in the same. The distances and the switch are assumed.
  double far_distance = 0;
  SearchOptions search = {};  // of every level
  PoseOptions pose = {};      // if not is_rigid(): with the baseline's cells only
  double min_overlap = 0.05;  // assumed
  // Measured with 1 m cells: a plane under 1 cm of noise gives up to 1e-4, a straight tunnel with
  // rough walls 7e-3, other scans 0.03 and more.
  double min_rank = 5e-4;
};

template <class Visitor>
void fields(NdtOptions& o, Visitor&& field) {
  fields(o.grid, field);
  fields(o.terms, field);
  fields(o.sampling, field);
  field("levels", o.levels, between(1, 10), "", "registrations with ever smaller cells");
  field("level-ratio", o.level_ratio, between(1, 10), "", "cell size of a level / of the next");
  field("merged", o.merged,
        "cells of a level are put together from the smaller ones of the next, 8 for 1; needs "
        "level-ratio 2 and cells that are neither divided, linked nor several to a point");
  field("far-distance", o.far_distance, between(0, 10000), "m",
        "at first, source points this far from the scanner are scored in cells twice as large; 0: "
        "not");
  fields(o.search, field);
  fields(o.pose, field);
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must lie in a cell, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "smallest / largest eigenvalue of what the surfaces hold, below which it is degenerate");
}

/// Registers `source` to `target` with 3D-NDT: finds the pose under which the used source points
/// are most likely, if the points in each cell of the target are normally distributed. Newton's
/// method (registration/newton.h) with a backtracking line search that looks cells up anew at every
/// trial.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite
/// T_guess         start pose T_target_source
/// returns         status converged when the last step's norm is below stop_step, or when the line
///                 search finds nothing lower within 10 halvings of a step (0.05 / 2^10 by default,
///                 below stop_step, too: the score jumps where points change cells);
///                 no_overlap when fewer than 6 or min_overlap of the used points end in a cell;
///                 degenerate when the surfaces met leave a direction free: min_rank is compared
///                 with the eigenvalues of NdtInformation::surface, rotations as lengths at the RMS
///                 distance of the points. Not of the Hessian: cells hold points along a plane,
///                 too. score: minus the sum of the densities, each 1 at a cell's mean; so not
///                 comparable between cell sizes.
///                 covariance: pose_covariance, scaled by the residuals. It takes points for
///                 independent and is far too small for dense scans (scale it by what trials
///                 show); its shape tells weak directions. directions: of
///                 NdtInformation::surface.
///                 empty_points: in no cell with a distribution; outside_points: outside the box of
///                 cells that have one.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite or
///                 more than 2^20 cells from the lattice's origin, an option out of range, or,
///                 other than with the baseline's cells, a box of more than 2^24 cells
/// cost            O(N + M + iterations * used points) time; memory O(N) while sampling and
///                 O(occupied cells) after
/// source          Magnusson et al. 2007, sections 3 to 5; equation numbers refer to it
RegistrationResult register_ndt(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const NdtOptions& options = {});

}  // namespace minescan
