// SPDX-License-Identifier: MIT
// A vehicle on four wheels: how it stands on rough ground, and so where its scanner is.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "core/fields.h"
#include "core/pose.h"
#include "sim/route.h"
#include "sim/trajectory.h"

namespace minescan {

/// A robot of the size of a Pioneer 3-AT with the scanner on a mast.
struct VehicleOptions {
  double wheelbase = 0.27;    // m; the Pioneer 3-AT's, on which gravel roads of ISO 8608 class D
                              // and E tilt it by 1.5 and 3.0 degrees
  double track = 0.4;         // m; assumed
  double wheel_patch = 0.05;  // m; assumed: a tyre of 0.22 m that gives way by a centimetre
  double scanner_height = 1;  // m; assumed
  double max_tilt = 0.1;      // rad; assumed: twice what class E does to it
  double speed = 0.5;         // m/s; assumed
  double turn_radius = 3;     // m; assumed: what a drift 10 m wide has room for
  double sidestep = 0.5;      // m; assumed: a small part of a drift's width
};

template <class Visitor>
void fields(VehicleOptions& o, Visitor&& field) {
  field("wheelbase", o.wheelbase, between(0.1, 10), "m", "from the front wheels to the rear ones");
  field("track", o.track, between(0.1, 10), "m", "from the left wheels to the right ones");
  field("wheel-patch", o.wheel_patch, between(0, 1), "m",
        "radius of what a wheel touches; it stands on the mean height of it");
  field("scanner-height", o.scanner_height, between(0, 10), "m",
        "of the scanner above the plane on which the wheels stand");
  field("max-tilt", o.max_tilt, between(0, 1.5), "rad",
        "where it is tilted more, it steps aside before it scans");
  field("speed", o.speed, above_up_to(0, 50), "m/s", "at which it drives");
  field("turn-radius", o.turn_radius, above_up_to(0, 100), "m", "at corners, if there is room");
  field("sidestep", o.sidestep, between(0, 10), "m",
        "how far beside its line it may stand so as to stand more level");
}

/// The height (world z, metres) of the ground straight below a point, or none.
using Ground = std::function<std::optional<double>(const Eigen::Vector3d& from)>;

/// The angle between the z axis of `T_world_body` and the vertical, radians.
double tilt(const Pose& T_world_body);

/// T_world_scanner of a vehicle that stands there. Its four wheels are at the corners of a
/// rectangle around `place` in plan, each at the mean height of its patch; the vehicle stands on
/// the plane through them in the sense of least squares. The scanner is scanner_height above the
/// middle of the wheels along the plane's normal, its z axis is that normal, and its x axis goes
/// along the plane exactly above `heading`.
///
/// ground    asked from 1 m above `place`, 28 times
/// place     on the route, near the ground; metres, world frame
/// heading   radians from x towards y
/// throws    std::runtime_error naming the place if there is no ground within 1 m above and 2 m
///           below it under each wheel
Pose stand(const VehicleOptions& options, const Ground& ground, const Eigen::Vector3d& place,
           double heading);

/// As `stand`, but beside the place, so as not to stand on stones: of the places 0, 0.1 m to the
/// left, to the right, 0.2 m to the left, ... up to `sidestep` the first where it is tilted by
/// max_tilt or less, or else the one where it is tilted least. Throws only if it cannot stand at
/// any.
Pose stand_clear(const VehicleOptions& options, const Ground& ground, const Eigen::Vector3d& place,
                 double heading);

/// T_world_scanner of a vehicle that drives from `from` to `to` (metres along the route, from <
/// to), from time 0 at constant `speed`. There is a pose about every 0.1 m: the wheels' patches,
/// 0.1 m across, even out what is shorter. Throws std::invalid_argument if that is not on the route
/// or from < to does not hold, and std::runtime_error as `stand`.
Trajectory drive(const VehicleOptions& options, const Ground& ground, const Route& route,
                 double from, double to);

}  // namespace minescan
