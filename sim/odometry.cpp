// SPDX-License-Identifier: MIT
#include "sim/odometry.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <numbers>

namespace minescan {
namespace {

struct PlanarPose {
  double x = 0, y = 0, yaw = 0;
};

PlanarPose planar(const Pose& pose) {
  return {pose.translation().x(), pose.translation().y(),
          std::atan2(pose.linear()(1, 0), pose.linear()(0, 0))};
}

// Turn, drive, turn.
struct Step {
  double rot1 = 0, trans = 0, rot2 = 0;
};

// The angle in [-pi, pi].
double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

Step step_between(const PlanarPose& from, const PlanarPose& to) {
  Step step;
  step.trans = std::hypot(to.x - from.x, to.y - from.y);
  if (step.trans > 0) step.rot1 = wrapped(std::atan2(to.y - from.y, to.x - from.x) - from.yaw);
  if (std::abs(step.rot1) > std::numbers::pi / 2) {
    step.trans = -step.trans;
    step.rot1 = wrapped(step.rot1 + std::numbers::pi);
  }
  step.rot2 = wrapped(to.yaw - from.yaw - step.rot1);
  return step;
}

// Letters and form of Probabilistic Robotics, table 5.6, with variances.
Step with_noise(const Step& step, const OdometryOptions& o, Random& random) {
  const bool slip = random.uniform() < o.slip_probability;
  const double times_rotation = slip ? o.slip_rotation : 1;
  const double times_translation = slip ? o.slip_translation : 1;
  // On the spot the direction of the drive means nothing: all of the turn is one. The limit is that
  // of nav2_amcl's DifferentialMotionModel.
  const bool on_the_spot = std::abs(step.trans) < 0.01;
  const double turn1 = on_the_spot ? 0 : step.rot1;
  const double turn2 = on_the_spot ? wrapped(step.rot1 + step.rot2) : step.rot2;
  const double trans2 = step.trans * step.trans;
  const double rot1_2 = turn1 * turn1;
  const double rot2_2 = turn2 * turn2;
  const double noise1 = random.normal(), noise2 = random.normal(), noise3 = random.normal();
  return {.rot1 = step.rot1 + times_rotation * noise1 *
                                  std::sqrt(o.rotation_from_rotation * rot1_2 +
                                            o.rotation_from_translation * trans2),
          .trans = step.trans + times_translation * noise2 *
                                    std::sqrt(o.translation_from_translation * trans2 +
                                              o.translation_from_rotation * (rot1_2 + rot2_2)),
          .rot2 = step.rot2 + times_rotation * noise3 *
                                  std::sqrt(o.rotation_from_rotation * rot2_2 +
                                            o.rotation_from_translation * trans2)};
}

PlanarPose after(const PlanarPose& from, const Step& step) {
  const double direction = from.yaw + step.rot1;
  return {from.x + step.trans * std::cos(direction), from.y + step.trans * std::sin(direction),
          direction + step.rot2};
}

}  // namespace

std::vector<Pose> odometry(const std::vector<Pose>& T_world_scanner, const OdometryOptions& options,
                           std::uint64_t seed) {
  std::vector<Pose> believed;
  PlanarPose here;
  for (std::size_t k = 0; k < T_world_scanner.size(); ++k) {
    if (k == 0) {
      here = planar(T_world_scanner[0]);
    } else {
      Random random(derived_seed(seed, "odometry"), k);
      const Step step = step_between(planar(T_world_scanner[k - 1]), planar(T_world_scanner[k]));
      here = after(here, with_noise(step, options, random));
    }
    believed.push_back(Eigen::Translation3d(here.x, here.y, T_world_scanner[0].translation().z()) *
                       Pose(Eigen::AngleAxisd(here.yaw, Eigen::Vector3d::UnitZ())));
  }
  return believed;
}

std::array<Eigen::Vector3d, 3> total_station_marks(const TotalStationOptions& options) {
  const double radius = options.mark_circle / 2;
  const double half_side = radius * std::sqrt(3.0) / 2;
  return {{{radius, 0, 0}, {-radius / 2, half_side, 0}, {-radius / 2, -half_side, 0}}};
}

Pose total_station_pose(const Pose& T_world_scanner, const TotalStationOptions& options,
                        Random& random) {
  Eigen::Matrix3d marks;
  Eigen::Matrix3d measured;
  int column = 0;
  for (const Eigen::Vector3d& mark : total_station_marks(options)) {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    marks.col(column) = mark;
    measured.col(column) = T_world_scanner * mark + options.mark_noise * Eigen::Vector3d(x, y, z);
    ++column;
  }
  Pose result;
  result.matrix() = Eigen::umeyama(marks, measured, false);
  return normalized(result);
}

}  // namespace minescan
