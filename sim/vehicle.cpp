// SPDX-License-Identifier: MIT
#include "sim/vehicle.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace minescan {
namespace {

// Where the ground is looked for. Assumed: higher than any stone and lower than any roof; and well
// below any relief of a floor.
constexpr double look_above = 1;  // metres
constexpr double look_below = 2;  // metres

// The mean height of 7 points of a patch, its middle and six at its rim.
std::optional<double> patch_height(const Ground& ground, const Eigen::Vector3d& middle,
                                   double radius) {
  constexpr int around = 6;
  double sum = 0;
  for (int i = 0; i <= around; ++i) {
    const double angle = 2 * std::numbers::pi * i / around;
    const double r = i == around ? 0 : radius;
    const Eigen::Vector3d p = middle + Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), 0);
    const std::optional<double> height = ground(p + look_above * Eigen::Vector3d::UnitZ());
    if (!height || !(-look_below <= *height - p.z() && *height - p.z() <= look_above)) return {};
    sum += *height;
  }
  return sum / (around + 1);
}

std::optional<Pose> try_to_stand(const VehicleOptions& o, const Ground& ground,
                                 const Eigen::Vector3d& place, double heading) {
  const Eigen::Vector3d forward(std::cos(heading), std::sin(heading), 0);
  const Eigen::Vector3d left(-forward.y(), forward.x(), 0);
  // On a rectangle the least squares come apart: the mean, and a slope each way.
  double mean = 0;
  double slope_forward = 0;
  double slope_left = 0;
  for (const double f : {-0.5, 0.5})
    for (const double l : {-0.5, 0.5}) {
      const Eigen::Vector3d wheel = place + f * o.wheelbase * forward + l * o.track * left;
      const std::optional<double> height = patch_height(ground, wheel, o.wheel_patch);
      if (!height) return {};
      mean += *height / 4;
      slope_forward += f * *height / o.wheelbase;
      slope_left += l * *height / o.track;
    }
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = (forward + slope_forward * up).normalized();
  const Eigen::Vector3d z = x.cross(left + slope_left * up).normalized();
  Pose T_world_scanner = Pose::Identity();
  T_world_scanner.linear() << x, z.cross(x), z;
  T_world_scanner.translation() =
      Eigen::Vector3d(place.x(), place.y(), mean) + o.scanner_height * z;
  return T_world_scanner;
}

[[noreturn]] void throw_no_ground(const Eigen::Vector3d& place) {
  throw std::runtime_error(fmt::format(
      "vehicle at ({:.4g}, {:.4g}, {:.4g}): no ground for its wheels within {} m above and {} m "
      "below",
      place.x(), place.y(), place.z(), look_above, look_below));
}

}  // namespace

double tilt(const Pose& T_world_body) {
  const Eigen::Vector3d z = T_world_body.linear().col(2);
  return std::atan2(z.head<2>().norm(), z.z());
}

Pose stand(const VehicleOptions& options, const Ground& ground, const Eigen::Vector3d& place,
           double heading) {
  const std::optional<Pose> T_world_scanner = try_to_stand(options, ground, place, heading);
  if (!T_world_scanner) throw_no_ground(place);
  return *T_world_scanner;
}

Pose stand_clear(const VehicleOptions& options, const Ground& ground, const Eigen::Vector3d& place,
                 double heading) {
  constexpr double step = 0.1;  // metres; assumed: a quarter of the track
  const Eigen::Vector3d left(-std::sin(heading), std::cos(heading), 0);
  // Written so that 0.3 m of steps of 0.1 m are three.
  const int steps = static_cast<int>(std::floor(options.sidestep / step + 1e-9));
  std::optional<Pose> flattest;
  for (int k = 0; k <= 2 * steps; ++k) {
    const double aside = (k % 2 == 1 ? step : -step) * ((k + 1) / 2);
    const std::optional<Pose> T_world_scanner =
        try_to_stand(options, ground, place + aside * left, heading);
    if (!T_world_scanner) continue;
    if (tilt(*T_world_scanner) <= options.max_tilt) return *T_world_scanner;
    if (!flattest || tilt(*T_world_scanner) < tilt(*flattest)) flattest = T_world_scanner;
  }
  if (!flattest) throw_no_ground(place);
  return *flattest;
}

Trajectory drive(const VehicleOptions& options, const Ground& ground, const Route& route,
                 double from, double to) {
  constexpr double spacing = 0.1;  // metres; see the header
  if (!(from < to && std::isfinite(from) && std::isfinite(to)))
    throw std::invalid_argument(
        fmt::format("drive from {} m to {} m: expected it to go forwards", from, to));
  if (!(options.speed > 0 && std::isfinite(options.speed)))
    throw std::invalid_argument(
        fmt::format("drive: speed = {} m/s: expected a number > 0", options.speed));
  const double pieces = std::max(1.0, std::round((to - from) / spacing));
  Trajectory trajectory;
  for (double i = 0; i <= pieces; ++i) {
    const double along = std::lerp(from, to, i / pieces);  // exactly `to` at the end
    const RoutePlace place = route.at(along);
    trajectory.times.push_back((along - from) / options.speed);
    trajectory.poses.push_back(stand(options, ground, place.position, place.heading));
  }
  return trajectory;
}

}  // namespace minescan
