// SPDX-License-Identifier: MIT
// Clouds that the tests of registration share, built from formulas.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/cloud.h"
#include "core/random.h"

namespace minescan {

inline Eigen::Vector3d random_vector(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

inline Pose random_pose(Random& random, double translation, double rotation) {
  const Eigen::Vector3d t = random_vector(random), axis = random_vector(random);
  return Pose(Eigen::Translation3d(translation * t) *
              Eigen::AngleAxisd(rotation * random.uniform(), axis.normalized()));
}

/// Points on the walls of a 24 x 5 x 4 m box tunnel with waves of 10 cm along both directions, a
/// niche in one wall and a tenth of the points on the wall at its end, seen from its middle.
inline PointCloud bumpy_tunnel(std::size_t count, std::uint64_t seed) {
  PointCloud cloud;
  Random random(seed, 0);
  while (cloud.points.size() < count) {
    if (random.uniform() < 0.1) {
      const double y = 5 * (random.uniform() - 0.5), z = 4 * random.uniform() - 1.5;
      cloud.points.push_back({12 + 0.1 * std::sin(2 * y) * std::cos(3 * z), y, z});
      continue;
    }
    const double x = 24 * (random.uniform() - 0.5);
    const double around = 18 * random.uniform();  // along the outline of 5 + 4 + 5 + 4 m
    const double wave = 0.1 * std::sin(1.9 * x) * std::cos(1.3 * around) + 0.06 * std::sin(0.7 * x);
    if (around < 5)
      cloud.points.push_back({x, around - 2.5, -1.5 + wave});
    else if (around < 9)
      cloud.points.push_back({x, 2.5 + wave, around - 5 - 1.5});
    else if (around < 14)
      cloud.points.push_back({x, around - 9 - 2.5, 2.5 + wave});
    else
      cloud.points.push_back({x, -2.5 + wave - (std::abs(x - 3) < 1 ? 0.8 : 0), around - 14 - 1.5});
  }
  return cloud;
}

/// Points all over a horizontal square of `side` metres below the scanner, with noise.
inline PointCloud plane(std::size_t count, double side, double noise, std::uint64_t seed) {
  PointCloud cloud;
  Random random(seed, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = side * (random.uniform() - 0.5), y = side * (random.uniform() - 0.5);
    cloud.points.push_back({x, y, -1.3 + noise * random.normal()});
  }
  return cloud;
}

inline PointCloud transformed(const Pose& T, PointCloud cloud) {
  for (Eigen::Vector3d& p : cloud.points) p = T * p;
  return cloud;
}

}  // namespace minescan
