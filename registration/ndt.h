// SPDX-License-Identifier: MIT
// Registration with the three-dimensional normal distributions transform.
#pragma once

#include "core/cloud.h"
#include "registration/ndt_grid.h"
#include "registration/result.h"
#include "registration/sampling.h"

namespace minescan {

/// The defaults are the paper's baseline (section 5).
struct NdtOptions {
  NdtGridOptions grid = {};
  SamplingOptions sampling = {};
  // Coarse to fine ("iterative subdivision", section 4.3.4): one registration after the other, the
  // first with cells of cell_size * level_ratio^(levels - 1), the last with cell_size.
  int levels = 1;
  double level_ratio = 2;
  double max_step = 0.05;     // norm of (metres, radians)
  double stop_step = 1e-4;    // norm of (metres, radians)
  int max_iterations = 200;   // per level; assumed, the paper has no limit
  double min_overlap = 0.05;  // assumed
  double min_rank = 1e-4;     // measured: see register_ndt
};

template <class Visitor>
void fields(NdtOptions& o, Visitor&& field) {
  fields(o.grid, field);
  fields(o.sampling, field);
  field("levels", o.levels, between(1, 10), "", "registrations with ever smaller cells");
  field("level-ratio", o.level_ratio, between(1, 10), "", "cell size of a level / of the next");
  field("max-step", o.max_step, above_up_to(0, 10), "", "norm of the longest step, m and rad");
  field("stop-step", o.stop_step, above_up_to(0, 1), "",
        "a step below this norm ends the search, m and rad");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations of one level");
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must lie in a cell, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "smallest / largest eigenvalue of what fixes the pose, below which it is degenerate");
}

/// Registers `source` to `target` with 3D-NDT.
RegistrationResult register_ndt(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const NdtOptions& options = {});

}  // namespace minescan
