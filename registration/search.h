// SPDX-License-Identifier: MIT
// The search for the pose at which a score is lowest, the same for all methods that have a score.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "core/fields.h"
#include "registration/pose_parameters.h"
#include "registration/result.h"

namespace minescan {

/// A score with its derivatives for (tau, omega) at zero: t <- t + tau, R <- Exp(omega) R.
struct Score {
  double value = 0;  // lower is better
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
  std::size_t met = 0;  // points that contribute
};

/// What Score::hessian holds: the second derivatives, or only the part without the curvature of the
/// score itself, the sum of w J^T C^-1 J, which is never indefinite.
enum class Curvature { full, gauss_newton };

/// A score with its derivatives for the twelve numbers of the 3 x 4 matrix (R, t), column by
/// column, whether R is a rotation or not.
struct AffineScore {
  using Vector = Eigen::Matrix<double, 12, 1>;
  using Matrix = Eigen::Matrix<double, 12, 12>;
  double value = 0;
  Vector gradient = Vector::Zero();
  Matrix hessian = Matrix::Zero();
  std::size_t met = 0;
};

/// A score with its derivatives for the parameters of the pose.
struct ParameterScore {
  double value = 0;
  Parameters gradient = {};
  ParameterMatrix hessian = {};
};

/// The same score for other parameters, by the chain rule; exact with Curvature::full, where the
/// second derivatives of the pose count. The first is for parameters that move rigidly.
ParameterScore chained(const Score& score, const PoseDerivatives& pose, int parameters,
                       Curvature curvature);
ParameterScore chained(const AffineScore& score, const PoseDerivatives& pose, int parameters,
                       Curvature curvature);

/// What is minimised. Both functions look up partners or cells anew, so that the value may jump.
struct Objective {
  std::function<Score(const Pose&, Curvature)> score = {};
  std::function<double(const Pose&)> value = {};  // as score(...).value, to the last bit
  /// As `score` for any (R, t); needed where parameters do not move rigidly.
  std::function<AffineScore(const Pose&, Curvature)> affine = {};
  /// Metres by which omega is multiplied so that all six unknowns are lengths.
  double length = 1;
};

enum class Optimiser { newton, gauss_newton, levenberg_marquardt };
constexpr auto names_of(Optimiser) {
  return std::to_array<std::string_view>({"newton", "gauss_newton", "levenberg_marquardt"});
}

/// How a Hessian that is not positive definite is made so: all eigenvalues shifted, or their
/// absolute values taken.
enum class Repair { shift, absolute };
constexpr auto names_of(Repair) { return std::to_array<std::string_view>({"shift", "absolute"}); }

/// The defaults are the paper's baseline (section 5) where it says something.
struct SearchOptions {
  Optimiser optimiser = Optimiser::newton;
  Repair repair = Repair::shift;
  double max_step = 0.05;    // norm of (metres, radians)
  double stop_step = 1e-4;   // norm of (metres, radians)
  int max_iterations = 200;  // assumed, the paper has no limit
};

template <class Visitor>
void fields(SearchOptions& o, Visitor&& field) {
  field("optimiser", o.optimiser, "how steps are found");
  field("repair", o.repair, "newton: what is done with a Hessian that is not positive definite");
  field("max-step", o.max_step, above_up_to(0, 10), "", "norm of the longest step, m and rad");
  field("stop-step", o.stop_step, above_up_to(0, 1), "",
        "a step below this norm ends the search, m and rad");
  field("max-iterations", o.max_iterations, between(1, 100000), "", "iterations of one level");
}

/// Where a search ended.
struct Found {
  Pose pose = Pose::Identity();
  Score score = {};  // at the pose
  int iterations = 0;
  int evaluations = 0;     // calls of the objective
  bool converged = false;  // else max_iterations was reached
};

/// The lowest score near `start`.
///
/// newton, gauss_newton  steps of newton_step, shortened by halves until the value falls as Armijo
///                       asks; a search that finds nothing lower within 10 halvings has converged,
///                       too (it has tried 0.05 / 2^10, below the default stop_step)
/// levenberg_marquardt   (H + lambda I) step = -g in scaled units, lambda by the gain ratio
///                       (Nielsen 1999); a step that leads up is tried again with a larger lambda
/// cost                  mostly one score per iteration
Found minimise(const Objective& objective, const Pose& start, const SearchOptions& options);

/// The same with steps in other parameters of the pose. max_step and stop_step are norms of them,
/// in metres, radians (of quaternion half of them) and, of axis_angle's axis, no unit. One more
/// score at the end, at the pose with a unit axis. Throws std::invalid_argument if the parameters
/// deform and there is no affine score.
Found minimise(const Objective& objective, const Pose& start, const SearchOptions& options,
               const PoseOptions& pose);

/// RMS distance of points from their origin, the lever by which a rotation moves them; 1 if they
/// all lie on it.
double rms_distance(const std::vector<Eigen::Vector3d>& points);

}  // namespace minescan
