// SPDX-License-Identifier: MIT
// The two algorithms as the Point Cloud Library has them, to compare with. Only in builds with
// MINESCAN_PCL.
//
// PCL calculates with float coordinates. Its defaults are not used: with them its NDT compares the
// square of a step of at most 0.1 m with 0.1 (and its tutorial with 0.01) and so stops after one
// iteration, its ICP has no limit on the distance of pairs and stops after 10 iterations. Here both
// run until they stand still, with the sampling, cells and limits of our own.
#pragma once

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"
#include "registration/sampling.h"

namespace minescan {

struct PclNdtOptions {
  SamplingOptions sampling = {};
  double cell_size = 1.0;       // metres
  int min_cell_points = 6;      // PCL's own
  double step_size = 0.1;       // metres and radians: PCL's own limit of a line search
  double outlier_ratio = 0.55;  // PCL's own
  double epsilon = 1e-8;        // squared metres: a step of 1e-4 m
  int max_iterations = 200;
};

template <class Visitor>
void fields(PclNdtOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("cell-size", o.cell_size, between(0.001, 1000), "m", "side of a cell");
  field("min-cell-points", o.min_cell_points, between(3, 1e6), "", "points that a cell needs");
  field("step-size", o.step_size, above_up_to(0, 10), "",
        "longest step of a line search, m and rad");
  field("outlier-ratio", o.outlier_ratio, above_up_to(0, 0.99), "", "weight of the uniform part");
  field("epsilon", o.epsilon, above_up_to(0, 1), "m^2",
        "a squared step below this ends the search");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations");
}

struct PclIcpOptions {
  SamplingOptions sampling = {};
  double max_distance = 1.0;  // metres; pairs further apart are rejected
  double epsilon = 1e-8;      // squared metres, and 1 - cos of the rotation, of the last step
  int max_iterations = 200;
};

template <class Visitor>
void fields(PclIcpOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("max-distance", o.max_distance, above_up_to(0, 1000), "m",
        "pairs of points further apart are rejected");
  field("epsilon", o.epsilon, above_up_to(0, 1), "m^2",
        "a squared step below this ends the search");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations");
}

struct PclNormalOptions {
  PclIcpOptions icp = {};
  int neighbours = 20;  // from which normals are found: PCL's own for its GICP
};

template <class Visitor>
void fields(PclNormalOptions& o, Visitor&& field) {
  fields(o.icp, field);
  field("neighbours", o.neighbours, between(4, 1000), "", "points from which a normal is found");
}

/// Assumed, in proportion to each other as PCL's tutorials have them; not tuned.
struct PclGlobalOptions {
  double leaf = 0.5;           // metres; both clouds are thinned to one point per cube of this side
  double normal_radius = 1.0;  // metres
  double feature_radius = 2.5;    // metres
  double inlier_distance = 0.75;  // metres
  double inlier_part = 0.25;      // of the points
  double similarity = 0.9;        // of edge lengths
  int max_iterations = 20000;
};

template <class Visitor>
void fields(PclGlobalOptions& o, Visitor&& field) {
  field("leaf", o.leaf, above_up_to(0, 100), "m",
        "both clouds are thinned to a point per this side");
  field("normal-radius", o.normal_radius, above_up_to(0, 100), "m", "points that a normal is from");
  field("feature-radius", o.feature_radius, above_up_to(0, 100), "m",
        "points that a feature is from");
  field("inlier-distance", o.inlier_distance, above_up_to(0, 100), "m",
        "a point this close to a target point supports a pose");
  field("inlier-part", o.inlier_part, ratio, "", "part of the points that has to support it");
  field("similarity", o.similarity, between(0, 0.999), "",
        "of the edges of two triangles, below which they are no pair");
  field("max-iterations", o.max_iterations, between(1, 10000000), "", "triangles tried");
}

/// pcl::NormalDistributionsTransform. Status no_overlap if the target has no cell or no used point
/// meets one; score is minus PCL's likelihood, summed over the used points. No covariance; bytes
/// are not known.
RegistrationResult register_pcl_ndt(const PointCloud& target, const PointCloud& source,
                                    const Pose& T_guess, const PclNdtOptions& options = {});

/// pcl::IterativeClosestPoint. Status no_overlap if it finds too few pairs; score is the mean
/// squared distance of the last pairs, m^2. No covariance; bytes are not known.
RegistrationResult register_pcl_icp(const PointCloud& target, const PointCloud& source,
                                    const Pose& T_guess, const PclIcpOptions& options = {});

/// pcl::IterativeClosestPoint with TransformationEstimationPointToPlaneLLS: the distance from the
/// tangent plane. Normals by pcl::NormalEstimation, from all target points. Status, score and the
/// rest as register_pcl_icp.
RegistrationResult register_pcl_icp_plane(const PointCloud& target, const PointCloud& source,
                                          const Pose& T_guess,
                                          const PclNormalOptions& options = {});

/// pcl::GeneralizedIterativeClosestPoint. Status no_overlap if it finds too few pairs; score is the
/// mean squared distance to the nearest points, m^2. No covariance; bytes are not known.
RegistrationResult register_pcl_gicp(const PointCloud& target, const PointCloud& source,
                                     const Pose& T_guess, const PclNormalOptions& options = {});

/// Global: FPFH features (Rusu et al. 2009) and pcl::SampleConsensusPrerejective (Buch et al.
/// 2013). T_guess has no part in it, but is what is returned with the status no_overlap, where no
/// pose has support enough. Otherwise the status is converged and the score minus the part of the
/// points that supports it: good for a start, not for a measurement. iterations are max_iterations,
/// since PCL keeps to itself how many it took. PCL draws triangles from the C
/// library's generator, which is set to the same state each time; one search runs at a time.
RegistrationResult register_pcl_global(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const PclGlobalOptions& options = {});

}  // namespace minescan
