// SPDX-License-Identifier: MIT
// The numbers that a search varies to move a pose, and how the pose changes with them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>

#include "core/fields.h"
#include "core/pose.h"

namespace minescan {

/// Up to seven parameters, without memory of their own.
using Parameters = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 7, 1>;
using ParameterMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 7, 7>;

/// What the parameters of T_target_source = (R, t) are. The first three are taken anew about every
/// pose, where they are zero; the others are kept and added to.
enum class PoseForm {
  local,            // (tau, omega): t + tau, Exp(omega) R
  twist,            // (rho, omega) of SE(3), from the left: Exp(rho, omega) T
  right,            // (tau, omega): t + tau, R Exp(omega)
  rotation_vector,  // (t, theta): R = Exp(theta), |theta| <= pi between steps
  axis_angle,       // (t, r, phi): the paper's seven, eqs 13 and 15; R is a rotation if |r| = 1
  quaternion,  // (t, w, x, y, z), made a unit quaternion after every step; steps of half angles
  euler,       // (t, a, b, c): R = Rx(a) Ry(b) Rz(c); b = +-pi/2 leaves one turn free
  planar,      // (x, y, yaw): z, roll and pitch are those of the start pose
};
constexpr auto names_of(PoseForm) {
  return std::to_array<std::string_view>({"local", "twist", "right", "rotation_vector",
                                          "axis_angle", "quaternion", "euler", "planar"});
}

/// What is compared with stop_step: the norm of the step, or the change of the norm of all
/// parameters, as the paper words it (section 5). The latter is small, too, for a step that leads
/// around the origin of the parameters.
enum class StopRule { step, norm_change };
constexpr auto names_of(StopRule) {
  return std::to_array<std::string_view>({"step", "norm_change"});
}

struct PoseOptions {
  PoseForm form = PoseForm::local;
  // axis_angle: r is made a unit vector after every step, and derivatives are those of r / |r|. The
  // paper does neither, and so deforms the source while it searches.
  bool renormalise = true;
  // axis_angle: r where the start pose does not turn (below 1e-12 rad); the paper gives none.
  Eigen::Vector3d start_axis = Eigen::Vector3d::UnitZ();
  // norm_change: of forms whose parameters are kept from pose to pose.
  StopRule stop_rule = StopRule::step;

  /// Whether all parameters move the source without deforming it.
  bool is_rigid() const { return form != PoseForm::axis_angle || renormalise; }
};

template <class Visitor>
void fields(PoseOptions& o, Visitor&& field) {
  field("pose", o.form, "parameters of the pose that steps are taken in");
  field("renormalise", o.renormalise,
        "pose axis_angle: the axis is made a unit vector after every step; if not, the source is "
        "deformed on the way, as in the paper; with undivided single cells only");
  field("start-axis", o.start_axis, between(-1000, 1000), "",
        "pose axis_angle: the axis where the start pose has no rotation");
  field("stop-rule", o.stop_rule,
        "what stop-step is compared with: the norm of a step, or by how much a step changes the "
        "norm of the parameters (pose rotation_vector, axis_angle, quaternion, euler or planar)");
}

/// Derivatives of the 3 x 4 matrix (R, t) for the parameters.
struct PoseDerivatives {
  using Matrix = Eigen::Matrix<double, 3, 4>;
  Matrix at = Matrix::Zero();
  std::array<Matrix, 7> first = {};
  std::array<std::array<Matrix, 7>, 7> second = {};
};

/// The parameters of one pose.
class PoseParameters {
 public:
  /// Throws std::invalid_argument for a start axis of no length, or for a stop rule that asks for
  /// the norm of parameters that are taken anew about every pose.
  PoseParameters(const Pose& start, const PoseOptions& options);

  int size() const;
  const Parameters& values() const { return values_; }
  /// (R, t) as the parameters say: not a rotation if the axis of axis_angle is no unit vector.
  Pose pose() const;
  /// The same with a unit axis.
  Pose rigid_pose() const;
  /// After a step.
  PoseParameters moved(const Parameters& step) const;
  PoseDerivatives derivatives() const;

 private:
  Eigen::Vector3d unit_axis() const;

  PoseOptions options_;
  Pose base_;  // about which parameters are taken; planar: the start pose
  Parameters values_;
};

}  // namespace minescan
