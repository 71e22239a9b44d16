// SPDX-License-Identifier: MIT
#include "sim/kinematics.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "sim/vector_math.h"

namespace minescan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The middle of step i of `count` equal ones between `first` and `last`.
double middle(double first, double last, int i, int count) {
  return first + (last - first) * (i + 0.5) / count;
}

// Beams run from `start` towards `sideways` as the mirror turns; `across` is the plane's normal.
struct PlaneAxes {
  Vector3d start;
  Vector3d sideways;
  Vector3d across;
};
PlaneAxes plane_axes(Motion motion) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  if (motion == Motion::yaw) return {.start = z, .sideways = x, .across = y};
  return {.start = x, .sideways = y, .across = z};
}

// Turning up is a negative turn about the left axis.
Matrix3d head_rotation(Motion motion, double angle) {
  switch (motion) {
    case Motion::yaw:
      return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix();
    case Motion::pitch:
      return Eigen::AngleAxisd(-angle, Vector3d::UnitY()).toRotationMatrix();
    case Motion::none:
      break;
  }
  return Matrix3d::Identity();
}

Matrix3d rotation(const Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

// A unit vector that enters glass of index `into` from index `from` through a surface with the unit
// normal `n`, which points against it (Snell's law).
Vector3d refracted(const Vector3d& d, const Vector3d& n, double from, double into) {
  const double ratio = from / into;
  const double cosine = -n.dot(d);
  const double inside = 1 - ratio * ratio * (1 - cosine * cosine);
  return ratio * d + (ratio * cosine - std::sqrt(inside)) * n;
}

// Light along x through two wedges: the first has its flat face on the side of the light, the
// second on the side of the scene (assumed). Their slanted faces are turned by `turn_1`, `turn_2`
// about x.
Vector3d through_wedges(const Scanner& s, double turn_1, double turn_2) {
  const Vector3d flat = -Vector3d::UnitX();
  const auto slanted = [](double wedge, double turn) -> Vector3d {
    return {-std::cos(wedge), std::sin(wedge) * std::cos(turn), std::sin(wedge) * std::sin(turn)};
  };
  const double n = s.refraction_index;
  Vector3d d = refracted(Vector3d::UnitX(), flat, 1, n);
  d = refracted(d, slanted(s.wedge_1, turn_1), n, 1);
  d = refracted(d, slanted(-s.wedge_2, turn_2), 1, n);
  return refracted(d, flat, n, 1).normalized();
}

// Of beams that no mirror turns: the footprint lies along the left axis.
Beam beam_along(const Vector3d& direction) {
  return {.origin = Vector3d::Zero(),
          .direction = direction,
          .along = Vector3d::UnitZ().cross(direction).normalized()};
}

}  // namespace

Kinematics::Kinematics(const Scanner& scanner)
    : scanner_(scanner),
      turn_time_(scanner.turn_time > 0 ? scanner.turn_time
                                       : scanner.plane_beams * scanner.beam_time) {
  const Scanner& s = scanner_;
  if (s.pattern != Pattern::mirror) return;
  const PlaneAxes axes = plane_axes(s.motion);
  const Matrix3d mount = rotation(s.mount);
  has_lever_ = s.lever != Vector3d::Zero();
  const double plane_time = turn_time_ * s.interlace;
  rings_.reserve(static_cast<std::size_t>(s.plane_beams));
  for (int r = 0; r < s.plane_beams; ++r) {
    const double nominal =
        s.plane_centre + middle(-s.plane_field / 2, s.plane_field / 2, r, s.plane_beams);
    const double angle = nominal + s.index_error + s.eccentricity * std::sin(nominal);
    const double leaving = s.wobble * std::sin(nominal) + 2 * s.mirror_tilt;
    const double inside = std::cos(leaving);
    // A head that turns on is at start + (end - start) t / duration, which is this much of a step
    // off the plane's middle; turning by theta + delta is turning by delta first.
    const double moved = s.continuous && plane_time > 0 ? time(r, 0) / plane_time - 0.5 : 0;
    const Matrix3d turn =
        head_rotation(s.motion, (s.motion_end - s.motion_start) / s.planes * moved);
    const Matrix3d turn_mount = turn * mount;
    rings_.push_back(
        {.origin = turn * s.lever,
         .nominal =
             turn_mount * (std::cos(nominal) * axes.start + std::sin(nominal) * axes.sideways),
         .beam = turn_mount *
                 (inside * (std::cos(angle) * axes.start + std::sin(angle) * axes.sideways)),
         .turned = turn_mount *
                   (inside * (std::cos(angle) * axes.sideways - std::sin(angle) * axes.start)),
         .fixed = turn_mount * (std::sin(leaving) * axes.across)});
  }
}

double Kinematics::duration() const {
  return static_cast<double>(scanner_.planes) * scanner_.interlace * turn_time_;
}

Kinematics::Plane Kinematics::plane(int column, double jitter) const {
  const Scanner& s = scanner_;
  if (s.pattern != Pattern::mirror) return {.column = column};
  const double angle = middle(s.motion_start, s.motion_end, column, s.planes);
  Plane plane{.column = column, .nominal = head_rotation(s.motion, angle)};
  plane.actual = plane.nominal;
  if (s.motion_jitter > 0) plane.actual = head_rotation(s.motion, angle + s.motion_jitter * jitter);
  if (s.axis_tilt != 0)
    plane.actual =
        rotation(s.axis_tilt * (s.motion == Motion::yaw ? Vector3d::UnitX() : Vector3d::UnitZ())) *
        plane.actual;
  return plane;
}

template <class Of>
void Kinematics::turned(const MatrixLanes& head, const Rings& rings, const Of& of,
                        VectorLanes& result) const {
  VectorLanes before;
  for (std::size_t i = 0; i < lanes; ++i)
    before.set(i, of(rings_[static_cast<std::size_t>(rings[i])], i));
  product(head, before, result);
}

void Kinematics::origins(const MatrixLanes& head, const Rings& rings, VectorLanes& origins) const {
  if (has_lever_)
    turned(
        head, rings, [](const Ring& r, std::size_t) { return r.origin; }, origins);
  else
    origins = {};
}

void Kinematics::nominal(const Heads& heads, const Rings& rings, Beams& beams) const {
  origins(heads.nominal, rings, beams.origin);
  if (scanner_.pattern != Pattern::mirror) {
    for (std::size_t i = 0; i < lanes; ++i)
      beams.direction.set(i, without_mirror(heads.column[i], rings[i]).direction);
    return;
  }
  turned(
      heads.nominal, rings, [](const Ring& r, std::size_t) { return r.nominal; }, beams.direction);
}

void Kinematics::actual(const Heads& heads, const Rings& rings, const Lanes& jitter,
                        Beams& beams) const {
  if (scanner_.pattern != Pattern::mirror) {
    nominal(heads, rings, beams);
    return;
  }
  origins(heads.actual, rings, beams.origin);
  turned(
      heads.actual, rings,
      [&](const Ring& r, std::size_t i) { return direction(r, static_cast<double>(jitter[i])); },
      beams.direction);
}

void Kinematics::along(const Heads& heads, const Rings& rings, VectorLanes& along) const {
  if (scanner_.pattern != Pattern::mirror) {
    for (std::size_t i = 0; i < lanes; ++i)
      along.set(i, without_mirror(heads.column[i], rings[i]).along);
    return;
  }
  turned(
      heads.actual, rings, [](const Ring& r, std::size_t) { return r.turned; }, along);
}

Beam Kinematics::without_mirror(int column, int ring) const {
  const Scanner& s = scanner_;
  switch (s.pattern) {
    case Pattern::mirror:
      break;
    case Pattern::pinhole: {
      // Equal steps on a plane in front of the camera.
      const double y = middle(std::tan(s.motion_start), std::tan(s.motion_end), column, s.planes);
      const double edge = std::tan(s.plane_field / 2);
      return beam_along(Vector3d(1, y, middle(edge, -edge, ring, s.plane_beams)).normalized());
    }
    case Pattern::risley: {
      const double turns = 2 * std::numbers::pi * time(ring, column);
      return beam_along(through_wedges(s, turns * s.rotor_1, turns * s.rotor_2));
    }
  }
  return {};
}

}  // namespace minescan
