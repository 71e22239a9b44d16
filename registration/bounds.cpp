// SPDX-License-Identifier: MIT
#include "registration/bounds.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "registration/wide.h"

namespace minescan {
namespace {

// Coordinates x y z x y z ... are worked on in groups of four points, which fill registers of any
// width.
constexpr std::size_t group = 12;

MINESCAN_WIDE void run(const double* xyz, std::size_t coordinates, double* low, double* high,
                       double& zero) {
  double l[group], h[group], z[group] = {};
  for (std::size_t k = 0; k < group; ++k) l[k] = h[k] = xyz[k % 3];
  std::size_t i = 0;
  for (; i + group <= coordinates; i += group) {
    for (std::size_t k = 0; k < group; ++k) {
      const double a = xyz[i + k];
      l[k] = a < l[k] ? a : l[k];
      h[k] = a > h[k] ? a : h[k];
      z[k] += 0 * a;  // not a number if `a` is none or infinite
    }
  }
  for (; i < coordinates; ++i) {
    l[i % 3] = std::min(l[i % 3], xyz[i]);
    h[i % 3] = std::max(h[i % 3], xyz[i]);
    z[0] += 0 * xyz[i];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min({l[k], l[k + 3], l[k + 6], l[k + 9]});
    high[k] = std::max({h[k], h[k + 3], h[k + 6], h[k + 9]});
  }
  zero = 0;
  for (const double x : z) zero += x;
}

}  // namespace

Bounds bounds_of(const std::vector<Eigen::Vector3d>& points) {
  assert(!points.empty());
  Bounds bounds;
  double zero = 0;
  run(points.front().data(), 3 * points.size(), bounds.low.data(), bounds.high.data(), zero);
  bounds.finite = zero == 0;
  return bounds;
}

}  // namespace minescan
