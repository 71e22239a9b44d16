// SPDX-License-Identifier: MIT
// What every registration method returns.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "core/pose.h"

namespace minescan {

/// (tau, omega): t <- t + tau, R <- Exp(omega) R; metres and radians, in the target frame. The
/// translation is that of the source's origin and the source turns about it.
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

enum class Status {
  not_run,         // the default, so that a forgotten result cannot pass for a good one
  converged,       // the last step was below the convergence limit
  max_iterations,  // the pose is the last one reached
  no_overlap,      // too few source points met the target; the pose is the guess
  degenerate,      // the problem does not fix all six degrees of freedom; the pose is the guess
};
constexpr auto names_of(Status) {
  return std::to_array<std::string_view>(
      {"not_run", "converged", "max_iterations", "no_overlap", "degenerate"});
}

/// Wall time of the stages of one registration, seconds.
struct StageTimes {
  double target = 0;  // preparing the target: search tree or cells
  double source = 0;  // preparing the source: sampling
  double align = 0;   // iterating
};

/// A small motion, and how firmly the surfaces that the scans share hold the pose against it.
struct Direction {
  Vector6d step = Vector6d::Zero();  // of unit norm, rotations as lengths (see directions_of)
  double hold = 0;                   // relative to the direction held best, in [0, 1]
};

struct RegistrationResult {
  Pose T_target_source = Pose::Identity();
  Status status = Status::not_run;
  int iterations = 0;
  int evaluations = 0;             // how often the used points were gone through
  double score = 0;                // the method's own objective at the end; lower is better
  std::size_t target_points = 0;   // of the cloud, before sampling
  std::size_t source_points = 0;   // the same
  std::size_t used_points = 0;     // source points after sampling (SamplingOptions::of)
  std::size_t empty_points = 0;    // of those, at the end: without a partner or a filled cell
  std::size_t outside_points = 0;  // and outside the target altogether; not counted as empty
  StageTimes time = {};
  double cpu = 0;                // processor time of all of it, seconds; see Stopwatch::cpu
  std::size_t target_bytes = 0;  // memory of the prepared target
  /// Of the error (translation, rotation vector), left perturbation in the target frame: m^2, m
  /// rad, rad^2. Zero where the method gives none, and for what it leaves as guessed.
  Matrix6d covariance = Matrix6d::Zero();
  /// Six, the one held least first, orthogonal to each other; three of a motion in plan; none where
  /// the method gives none.
  std::vector<Direction> directions = {};
};

}  // namespace minescan
