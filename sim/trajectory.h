// SPDX-License-Identifier: MIT
#pragma once
#include <vector>

#include "core/pose.h"
namespace minescan {
struct Trajectory {
  std::vector<double> times = {};
  std::vector<Pose> poses = {};
};
class SmoothPath {
 public:
  explicit SmoothPath(Trajectory t) : t_(std::move(t)) {}
  Pose at(double) const { return t_.poses.at(0); }

 private:
  Trajectory t_;
};
}  // namespace minescan
