// SPDX-License-Identifier: MIT
// Registration of two clouds that are both normal distributions.
#pragma once

#include <Eigen/Core>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/ndt_grid.h"
#include "registration/result.h"
#include "registration/sampling.h"
#include "registration/search.h"

namespace minescan {

struct D2dOptions {
  // All points: the cells are what makes them few.
  SamplingOptions sampling = {.ratio = 1};
  NdtGridOptions grid = {.cell_size = 0.5};  // of the last level, in both clouds
  int levels = 3;                            // each with cells twice as large as the next
  // As in the authors' program. Larger ones are more accurate and narrower: good of 20 starts of
  // the study `methods` on junction, loop and tunnel with 0.05: 20, 20, 9; 0.2: 20, 20, 1; 0.5: 20,
  // 20, 0; 1: 19, 15, 18; median errors on junction 1.3, 1.0, 0.8 and 0.6 mm.
  double d2 = 0.05;
  int reach = 1;              // cells on each side of the one that holds a mean; theirs: 2
  SearchOptions search = {};  // of every level
  double min_overlap = 0.05;  // assumed
  // Measured with cells of 0.5 m: a plane under 1 cm of noise, 12 points to a cell, gives 5.5e-4,
  // the scans of the paper's TUNNEL 0.014.
  double min_rank = 2e-3;
};

template <class Visitor>
void fields(D2dOptions& o, Visitor&& field) {
  fields(o.grid, field);
  fields(o.sampling, field);
  field("levels", o.levels, between(1, 10), "",
        "registrations, each with cells half as large as the one before");
  field("d2", o.d2, above_up_to(0, 10), "",
        "by which squared distances between distributions are multiplied");
  field("reach", o.reach, between(0, 5), "",
        "target cells on each side of the one that holds a source cell's mean");
  fields(o.search, field);
  field("min-overlap", o.min_overlap, between(0, 1), "",
        "part of the source's distributions that must meet one of the target, else no_overlap");
  field("min-rank", o.min_rank, between(0, 1), "",
        "smallest / largest eigenvalue of what the surfaces hold, below which it is degenerate");
}

/// A normal distribution.
struct Distribution {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// The term of one source and one target distribution, -exp(-d2 / 2 mu^T B mu) with mu = R m_s + t
/// - m_t and B = (R C_s R^T + C_t)^-1, with its exact derivatives for (tau, omega). gauss_newton:
/// d2 exp(.) J^T B J, with B taken for constant.
Score d2d_score(const Distribution& target, const Distribution& source, const Pose& T_target_source,
                double d2, Curvature curvature = Curvature::full);

/// Registers `source` to `target` with distribution-to-distribution NDT: both clouds become the
/// cells of lattices of their own, and every cell of the source is drawn to the cells of the target
/// around its mean, looked up anew at every trial.
///
/// returns  status converged, no_overlap, degenerate and directions as register_ndt, for
///          distributions instead of points; score: the sum of d2d_score at the last level, not
///          comparable between cell sizes; empty_points: used points in source cells that have no
///          distribution or meet none; outside_points are not told apart and stay 0.
///          covariance: the inverse of the Gauss-Newton Hessian, scaled by the residuals as
///          pose_covariance does.
/// throws   std::invalid_argument for an empty cloud, a coordinate that is not finite or more than
///          2^20 cells from the lattice's origin, or an option out of range
/// cost     O(N + M) time, and iterations * source cells * (2 reach + 1)^3
/// source   Stoyanov, Magnusson, Andreasson, Lilienthal 2012
RegistrationResult register_d2d(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const D2dOptions& options = {});

}  // namespace minescan
