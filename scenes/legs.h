// SPDX-License-Identifier: MIT
// The drifts of a mine cut into straight legs, and which legs are near a place.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "scenes/mine.h"

namespace minescan {

/// Points of a leg's frame: `along` metres from its start, `lateral` metres from its axis (beyond a
/// bend: from the bend).
struct LegPlace {
  double along = 0;
  double lateral = 0;
  double side = 0;   // signed, to the left of the axis
  double floor = 0;  // z
};

/// A straight piece of a drift.
struct Leg {
  std::string drift = {};
  std::size_t number = 0;  // of the drift
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  // unit
  double length = 1;
  double chainage = 0;     // of its start, along the drift
  double floor = 0;        // z at its start
  double slope = 0;        // of the floor, rising along it
  double cross_slope = 0;  // rising to the left
  double width = 10;
  double height = 6;
  double arch = 0;
  bool bend_from = false;  // the drift goes on there
  bool bend_to = false;
  End start = End::rock;  // where it does not
  End end = End::rock;

  LegPlace place_of(const Eigen::Vector3d& p) const;
  /// From the axis between both ends.
  double distance_in_plan(const Eigen::Vector3d& p) const;
};

/// All legs, drift by drift. Throws as surface_of.
std::vector<Leg> legs_of(const Mine& mine);

/// Finds legs by place.
class LegIndex {
 public:
  /// `margin`: how far beyond its outline a leg may reach.
  LegIndex(std::vector<Leg> legs, double margin);

  const std::vector<Leg>& legs() const { return legs_; }
  /// Those that may come within `radius` (at most `reach`) of `p` in plan, in order.
  std::span<const std::uint32_t> near(const Eigen::Vector3d& p, double radius) const;
  /// All others are farther from `p` than this.
  static constexpr double reach = 4;  // metres

 private:
  std::vector<Leg> legs_;
  std::vector<std::uint32_t> all_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  std::int64_t columns_ = 0;
  std::int64_t rows_ = 0;
  std::vector<std::vector<std::uint32_t>> cells_;
};

}  // namespace minescan
