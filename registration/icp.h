// SPDX-License-Identifier: MIT
// Registration with the iterative closest point algorithm and its variants.
#pragma once

#include <array>
#include <string_view>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/kdtree.h"
#include "registration/result.h"
#include "registration/sampling.h"

namespace minescan {

/// Which distance of the pairs is made small.
enum class IcpMetric {
  point,      // between the two points (Besl and McKay 1992), in closed form
  plane,      // from the target point's tangent plane (Chen and Medioni 1992)
  symmetric,  // along the sum of both normals (Rusinkiewicz 2019)
  // Between two flat distributions, one about each point (generalized ICP, Segal et al. 2009): a
  // standard deviation of 1 along the surface, of `flatness` across it.
  generalized,
};
constexpr auto names_of(IcpMetric) {
  return std::to_array<std::string_view>({"point", "plane", "symmetric", "generalized"});
}

/// How the metric `point` is solved; the same to rounding.
enum class ClosedForm { svd, quaternion };
constexpr auto names_of(ClosedForm) {
  return std::to_array<std::string_view>({"svd", "quaternion"});
}

/// What a source point is paired with.
enum class IcpMatcher {
  nearest,          // the target point nearest to it
  normal_shooting,  // where the line along its normal meets the target (Chen and Medioni 1992)
};
constexpr auto names_of(IcpMatcher) {
  return std::to_array<std::string_view>({"nearest", "normal_shooting"});
}

/// What a pair counts (Rusinkiewicz and Levoy 2001).
enum class PairWeights {
  constant,  // 1 (the paper's choice)
  distance,  // 1 - d / the largest d of all pairs (paper, eq. 1), 1 if all d are 0
  normals,   // the cosine of the angle between the normals, at least 0
};
constexpr auto names_of(PairWeights) {
  return std::to_array<std::string_view>({"constant", "distance", "normals"});
}

/// The defaults are the paper's baseline (section 5).
struct IcpOptions {
  SamplingOptions sampling = {};
  // Of sampling stable: chosen anew in every iteration among all source points with a partner, so
  // that it is what both scans have seen that holds the pose (Gelfand et al. 2003, section 4).
  bool resample = false;
  IcpMetric metric = IcpMetric::point;
  ClosedForm closed_form = ClosedForm::svd;
  IcpMatcher matcher = IcpMatcher::nearest;
  PairWeights weights = PairWeights::constant;
  double max_distance = 1.0;  // metres; pairs further apart are rejected
  // Decreasing threshold (section 5.2.2, its schedule is not given): the limit goes from
  // max_distance to final_distance in equal steps over the first `decrease_iterations` iterations,
  // and the search does not end before. 0: the limit stays at max_distance.
  int decrease_iterations = 0;
  double final_distance = 0.1;
  double kept_pairs = 1;    // the rest, those furthest apart, are rejected (trimmed ICP)
  double max_angle = 3.15;  // radians between the normals; pairs beyond are rejected
  int leaf_size = 10;       // points per leaf of the search tree
  // Neighbours are followed from one iteration to the next, which finds the nearest in less time
  // than `search` finds one that may be further; the paper's search with false.
  bool tracked = true;
  TreeSearch search = TreeSearch::additive;
  double tree_error = 0.01;   // bound of the search: metres if additive, a ratio if relative
  int neighbours = 10;        // from which normals are found; assumed
  double flatness = 1e-3;     // of `generalized`: a ratio of variances (Segal et al. 2009)
  double stop_step = 1e-4;    // norm of (metres, radians)
  int max_iterations = 500;   // assumed, the paper has no limit
  double min_overlap = 0.05;  // assumed
  double min_rank = 5e-4;     // of all metrics but `point`; as NdtOptions::min_rank
};

template <class Visitor>
void fields(IcpOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("resample", o.resample,
        "sampling stable of the source: the points are chosen anew in every iteration, among those "
        "with a partner");
  field("metric", o.metric, "which distance of the pairs is made small");
  field("closed-form", o.closed_form, "how metric point is solved");
  field("matcher", o.matcher, "what a source point is paired with");
  field("weights", o.weights, "what a pair counts");
  field("max-distance", o.max_distance, above_up_to(0, 1000), "m",
        "pairs of points further apart are rejected");
  field("decrease-iterations", o.decrease_iterations, between(0, 100000), "",
        "iterations over which that limit falls to final-distance; 0: it does not");
  field("final-distance", o.final_distance, above_up_to(0, 1000), "m", "where it falls to");
  field("kept-pairs", o.kept_pairs, ratio, "",
        "part of the pairs that is kept, those closest together");
  field("max-angle", o.max_angle, above_up_to(0, 3.15), "rad",
        "pairs with a larger angle between their normals are rejected");
  field("leaf-size", o.leaf_size, between(1, 10000), "", "points per leaf of the search tree");
  field(
      "tracked", o.tracked,
      "follow neighbours from one iteration to the next: always the nearest, whatever search says");
  field("search", o.search, "what the search promises of the point that it finds");
  field("tree-error", o.tree_error, between(0, 1000), "m",
        "bound of the search: how much further than the nearest point the one found may be, in "
        "metres if additive, as a ratio if relative; 0: exact");
  field("neighbours", o.neighbours, between(3, 1000), "",
        "points from which a normal is found, where the cloud has none; up to four times as many "
        "where they lie on one scan line");
  field("flatness", o.flatness, above_up_to(0, 1), "",
        "metric generalized: variance across a surface / along it");
  field("stop-step", o.stop_step, above_up_to(0, 1), "",
        "a change of the pose below this norm ends the search, m and rad");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations");
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the used points that must find a partner, else no_overlap");
  field(
      "min-rank", o.min_rank, between(0, 1), "",
      "metrics other than point: smallest / largest eigenvalue of what the pairs hold, below which "
      "it is degenerate");
}

/// Registers `source` to `target` with ICP: every used source point is paired with a place of the
/// target close by, and the pose that best maps the pairs onto each other is found, again and
/// again.
///
/// Normals, where options ask for them, are the clouds' own or those of the planes through
/// `neighbours` points (class Normals): of the target among all its points, of the source among the
/// used ones.
///
/// With `resample` all points are matched and count as used; those chosen of them move the pose.
///
/// target, source  N and M points in metres, each cloud in its own frame; N, M >= 1, all finite
/// T_guess         start pose T_target_source
/// returns         status converged when the pose changes by less than stop_step: the norm of
///                 (change of the translation, angle of the rotation between the two poses);
///                 no_overlap when fewer than 6 or min_overlap of the used points find a partner;
///                 degenerate when the paired points lie on one line (metric point, for which a
///                 plane can not be told from other shapes: the pattern of points on it holds the
///                 pose), or when the normals leave a direction free (min_rank).
///                 score: mean squared distance of the last pairs, m^2, as the metric measures it.
///                 covariance: s^2 (J^T J)^-1, s^2 being the pairs' variance per coordinate. It
///                 takes pairs for independent and rightly paired, and so is far too small (scale
///                 it by what trials show); its shape tells weak directions. directions: of J^T J.
///                 outside_points: further than max_distance from the target's bounding box.
/// throws          std::invalid_argument for an empty cloud, a coordinate that is not finite or an
///                 option out of range
/// cost            O(N log N + iterations * M log N) time, O(N) memory
/// source          Magnusson et al. 2007, sections 2.1 and 5; Rusinkiewicz and Levoy 2001
RegistrationResult register_icp(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const IcpOptions& options = {});

}  // namespace minescan
