// SPDX-License-Identifier: MIT
// The way a vehicle drives, seen from above: along the centre lines of drifts, around corners in
// arcs. Lengths and distances along a line or a way are measured in plan, metres.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace minescan {

/// One line that follows several: from each of `lines` it changes over to the next, and for a
/// `closed` way from the last to the first.
///
/// - Where two lines cross, at the crossing; of several, at the first one met along the line that
///   is left, other than where that line was entered.
/// - Where they run side by side for a while, as two drifts whose crews met with an offset (an end
///   of each has a foot on the other), it leaves one where the other begins beside it and enters
///   that where the first ends: it crosses over within the overlap, at a slant.
/// - Where one of them merely stops near the other, from nearest point to nearest point.
///
/// Which way each line is followed comes from where it is entered and left. An open way begins at
/// that end of the first line which is farther from where it is left (halfway: at its first point),
/// and ends likewise (at the last point); a single line is taken as it is. A closed way begins
/// where the last line changes over to the first, and does not repeat that point.
///
/// lines    centre lines at floor level in the order they are driven, each of two points or more,
///          metres, world frame; two or more of them for a closed way
/// reach    metres, in plan and in height: lines farther apart do not meet. The default is assumed:
///          half the width of a drift
/// throws   std::invalid_argument for two lines that do not meet, naming both by their index, for
///          a closed way that does not go round anything, and for a line with fewer points, one
///          that is not finite, or one that lies on or above the one before
std::vector<Eigen::Vector3d> joined_lines(const std::vector<std::vector<Eigen::Vector3d>>& lines,
                                          bool closed, double reach = 5);

/// A place on a route.
struct RoutePlace {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // on the line, world frame
  double heading = 0;  // radians from x towards y; counted on, so that it never jumps
};

/// A line whose corners are rounded by arcs.
class Route {
 public:
  /// A route through `points` (metres, world frame); a closed one goes from the last to the first
  /// again, and begins where it leaves the first point's corner. Corners have `turn_radius`,
  /// metres, or less where the legs beside them are too short for it. Throws std::invalid_argument
  /// for fewer than two points (three if closed), a point that is not finite or lies on or above
  /// the one before, a corner of more than 175 degrees, or a radius that is not above 0.
  Route(const std::vector<Eigen::Vector3d>& points, bool closed, double turn_radius);

  /// Metres; of a closed route, once round.
  double length() const;
  bool closed() const { return closed_; }

  /// The place `along` metres from the start; heights go evenly from one end of a leg or an arc to
  /// the other. A closed route goes round and round, backwards too. Throws std::invalid_argument
  /// before the start and after the end of an open one, and for what is not finite.
  RoutePlace at(double along) const;

 private:
  // A straight piece or an arc.
  struct Piece {
    double start = 0;  // metres along the route
    double length = 0;
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    double heading = 0;
    double curvature = 0;  // to the left, 1/m
    double slope = 0;
  };
  void add(double length, double curvature, double to_height, const Eigen::Vector3d& from);

  bool closed_;
  std::vector<Piece> pieces_;
  double next_heading_ = 0;  // at the end of the last piece
};

/// Where a vehicle halts: `count` distances along the route, the first 0, each farther than the one
/// before by a step drawn evenly from [step_min, step_max] metres. Step k, to stop k, draws from
/// Random(derived_seed(seed, "stops"), k). On a closed route they may go round more than once.
/// Throws std::invalid_argument for steps that are not 0 < step_min <= step_max, and if an open
/// route is too short.
std::vector<double> stops(const Route& route, double step_min, double step_max, std::size_t count,
                          std::uint64_t seed);

}  // namespace minescan
