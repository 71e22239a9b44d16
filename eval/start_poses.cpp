// SPDX-License-Identifier: MIT
#include "eval/start_poses.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "core/random.h"

namespace minescan {
namespace {

void check_index(int index, int count) {
  if (index < 0 || index >= count)
    throw std::invalid_argument("start " + std::to_string(index) + " of " + std::to_string(count) +
                                ": expected 0 ... count - 1");
}

Eigen::Vector4d random_normals(Random& random) {
  Eigen::Vector4d v;
  for (double& x : v) x = random.normal();
  return v;
}

}  // namespace

Eigen::Vector3d lattice_direction(int index, int count) {
  check_index(index, count);
  const double z = 1 - (2.0 * index + 1) / count;
  const double radius = std::sqrt(1 - z * z);
  const double azimuth = index * std::numbers::pi * (3 - std::sqrt(5.0));
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), z};
}

StartDirections start_directions(int index, int count, std::uint64_t seed) {
  Random turn(derived_seed(seed, "start lattice"), 0);
  Random axis(derived_seed(seed, "start axes"), static_cast<std::uint64_t>(index));
  // A normalised Gaussian vector has no preferred direction: of 4 numbers it is a uniform rotation
  // (as a quaternion), of 3 a uniform axis.
  const Eigen::Quaterniond lattice(random_normals(turn).normalized());
  return {.offset = (lattice * lattice_direction(index, count)).normalized(),
          .axis = random_normals(axis).head<3>().normalized()};
}

Pose start_pose(const Pose& truth, int index, int count, std::uint64_t seed, double translation,
                double rotation) {
  const StartDirections directions = start_directions(index, count, seed);
  return displaced(truth, translation * directions.offset, directions.axis, rotation);
}

}  // namespace minescan
