// SPDX-License-Identifier: MIT
// Registration with the iterative closest point algorithm, point to point.
#pragma once

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"
#include "registration/sampling.h"

namespace minescan {

/// The defaults are the paper's baseline (section 5).
struct IcpOptions {
  SamplingOptions sampling = {};
  double max_distance = 1.0;  // metres; pairs further apart are rejected
  // Decreasing threshold (section 5.2.2, its schedule is not given): the limit goes from
  // max_distance to final_distance in equal steps over the first `decrease_iterations` iterations,
  // and the search does not end before. 0: the limit stays at max_distance.
  int decrease_iterations = 0;
  double final_distance = 0.1;
  int leaf_size = 10;         // points per leaf of the search tree
  double tree_error = 0.01;   // metres by which a neighbour may be further than the nearest
  double stop_step = 1e-4;    // norm of (metres, radians)
  int max_iterations = 500;   // assumed, the paper has no limit
  double min_overlap = 0.05;  // assumed
};

template <class Visitor>
void fields(IcpOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("max-distance", o.max_distance, above_up_to(0, 1000), "m",
        "pairs of points further apart are rejected");
  field("decrease-iterations", o.decrease_iterations, between(0, 100000), "",
        "iterations over which that limit falls to final-distance; 0: it does not");
  field("final-distance", o.final_distance, above_up_to(0, 1000), "m", "where it falls to");
  field("leaf-size", o.leaf_size, between(1, 10000), "", "points per leaf of the search tree");
  field("tree-error", o.tree_error, between(0, 1000), "m",
        "how much further than the nearest point the one found may be; 0: exact");
  field("stop-step", o.stop_step, above_up_to(0, 1), "",
        "a change of the pose below this norm ends the search, m and rad");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations");
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must find a partner, else no_overlap");
}

/// Registers `source` to `target` with point-to-point ICP (Besl and McKay 1992): every used source
/// point is paired with a target point close by, and the pose that best maps the pairs onto each
/// other is found in closed form, again and again.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite
/// T_guess         start pose T_target_source
/// returns         status converged when the pose changes by less than stop_step: the norm of
///                 (change of the translation, angle of the rotation between the two poses);
///                 no_overlap when fewer than 6 or min_overlap of the used points find a partner;
///                 degenerate when the paired points lie on one line. A plane can not be told from
///                 other shapes here: the pattern of points on it holds the pose.
///                 score: mean squared distance of the last pairs, m^2.
///                 covariance: s^2 (J^T J)^-1, s^2 being the pairs' variance per coordinate. It
///                 takes pairs for independent and rightly paired, and so is far too small (scale
///                 it by what trials show); its shape tells weak directions.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite or an
///                 option out of range
/// cost            O(N log N + iterations * M log N) time, O(N) memory
/// source          Magnusson et al. 2007, sections 2.1 and 5
RegistrationResult register_icp(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const IcpOptions& options = {});

}  // namespace minescan
