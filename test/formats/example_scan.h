// SPDX-License-Identifier: MIT
// A small scan with every attribute.
#pragma once

#include "core/cloud.h"
#include "core/random.h"

namespace minescan {

/// Beams on a grid of 5 planes of 4 beams, of which some do not come back. Points, distances and
/// poses are random; numbers are such that no two columns agree. With `two_returns` each second
/// beam that comes back does so twice.
inline Scan example_scan(bool two_returns) {
  Random random(11, two_returns ? 1 : 0);
  Scan scan{.scene = "box", .scanner = "example", .rings = 4, .columns = 5, .beams = 20};
  scan.T_world_scanner = Eigen::Translation3d(120.25, -40.5, 2) *
                         Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.1, -0.2, 1).normalized());
  for (std::uint32_t column = 0; column < scan.columns; ++column)
    for (std::uint32_t ring = 0; ring < scan.rings; ++ring) {
      if ((column + 2 * ring) % 5 == 0) continue;
      const int returns = two_returns && ring % 2 == 1 ? 2 : 1;
      for (int echo = 1; echo <= returns; ++echo) {
        const auto normal = [&] { return static_cast<float>(random.normal()); };
        const auto i = static_cast<std::uint32_t>(scan.cloud.points.size());
        // Floats, as the measured points of scanners are.
        scan.cloud.points.emplace_back(20 * normal(), 20 * normal(), 3 * normal());
        scan.intensity.push_back(static_cast<float>(random.uniform()));
        scan.time.push_back(0.001 * column + 1e-5 * ring);
        scan.ring.push_back(ring);
        scan.column.push_back(column);
        scan.range.push_back(30 * random.uniform());
        scan.true_range.push_back(30 * random.uniform());
        scan.true_point.emplace_back(20 * normal(), 20 * normal(), 3 * normal());
        scan.incidence.push_back(static_cast<float>(random.uniform()));
        scan.true_normal.push_back(Eigen::Vector3f(normal(), normal(), normal()).normalized());
        scan.triangle.push_back(100 + i);
        scan.material.push_back(static_cast<std::uint8_t>(i % 3));
        scan.flags.push_back(i % 4 == 0 ? flag_mixed_pixel : flag_none);
        scan.echo.push_back(static_cast<std::uint8_t>(echo));
      }
    }
  return scan;
}

}  // namespace minescan
