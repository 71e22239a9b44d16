// SPDX-License-Identifier: MIT
// ICP as Open3D has it, to compare with. Only in builds with MINESCAN_OPEN3D that find Open3D.
//
// Its search ends when neither the number of pairs nor their distances change by more than a
// millionth part, or after 30 iterations; here the iterations are as many as it takes. On one
// thread: on several, Open3D's sums depend on which is first.
#pragma once

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"
#include "registration/sampling.h"

namespace minescan {

struct Open3dIcpOptions {
  SamplingOptions sampling = {};
  double max_distance = 1.0;  // metres; pairs further apart are rejected
  double epsilon = 1e-6;      // Open3D's own
  int max_iterations = 200;
};

template <class Visitor>
void fields(Open3dIcpOptions& o, Visitor&& field) {
  fields(o.sampling, field);
  field("max-distance", o.max_distance, above_up_to(0, 1000), "m",
        "pairs of points further apart are rejected");
  field("epsilon", o.epsilon, above_up_to(0, 1), "",
        "relative change of the pairs' number and distance, below which the search ends");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations");
}

struct Open3dNormalOptions {
  Open3dIcpOptions icp = {};
  int neighbours = 20;  // from which normals are found; as those of PCL here
};

template <class Visitor>
void fields(Open3dNormalOptions& o, Visitor&& field) {
  fields(o.icp, field);
  field("neighbours", o.neighbours, between(4, 1000), "", "points from which a normal is found");
}

/// open3d::pipelines::registration::RegistrationICP with the distance between points. Status
/// no_overlap if it finds no pairs; score is the mean squared distance of the last pairs, m^2. No
/// covariance; bytes are not known.
RegistrationResult register_open3d_icp(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const Open3dIcpOptions& options = {});

/// The same with the distance from the tangent plane, of all target points. Status degenerate where
/// the normals leave its linear system without a solution.
RegistrationResult register_open3d_icp_plane(const PointCloud& target, const PointCloud& source,
                                             const Pose& T_guess,
                                             const Open3dNormalOptions& options = {});

/// RegistrationGeneralizedICP, with flat covariances along the normals of all target points and of
/// the used source points.
RegistrationResult register_open3d_gicp(const PointCloud& target, const PointCloud& source,
                                        const Pose& T_guess,
                                        const Open3dNormalOptions& options = {});

}  // namespace minescan
