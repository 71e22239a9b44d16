// SPDX-License-Identifier: MIT
#include "scenes/legs.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include "core/table.h"
#include "core/text.h"

namespace minescan {
namespace {

constexpr double cell_size = 8;  // metres

// A drift that turns by more than 120 degrees at one point goes back into itself.
constexpr double sharpest_turn = -0.5;  // cosine

// Floors that differ by more than this where drifts meet are a mistake in the sheet (assumed).
constexpr double level_tolerance = 0.25;
// Rock between a drift and one that passes above it (assumed): relief must not eat it up.
constexpr double rock_between = 2;

// How far a drift that leaves another reaches into it: beyond the relief of that one's wall.
constexpr double overlap_with_parent = 1.5;

// Chords of a spline.
constexpr double chord = 1;  // metres, about

[[noreturn]] void refuse(const std::string& drift, const std::string& what) {
  throw std::invalid_argument("drift '" + drift + "': " + what);
}

std::string point_text(const Eigen::Vector3d& p) {
  std::string text = "(";
  text.append(number_text(p.x())).append(", ").append(number_text(p.y()));
  return text.append(", ").append(number_text(p.z())).append(")");
}

/// Between points[i] and points[i + 1] of a centripetal Catmull-Rom spline (Barry and Goldman 1988;
/// Yuksel et al. 2011); t in [0, 1]. Beyond the ends the line goes on straight.
Eigen::Vector3d on_spline(const std::vector<Eigen::Vector3d>& points, std::size_t i, double t) {
  const Eigen::Vector3d b = points[i], c = points[i + 1];
  const Eigen::Vector3d a = i > 0 ? points[i - 1] : Eigen::Vector3d(2 * b - c);
  const Eigen::Vector3d d = i + 2 < points.size() ? points[i + 2] : Eigen::Vector3d(2 * c - b);
  const double t0 = 0;
  const double t1 = t0 + std::sqrt((b - a).norm());
  const double t2 = t1 + std::sqrt((c - b).norm());
  const double t3 = t2 + std::sqrt((d - c).norm());
  const double s = t1 + t * (t2 - t1);
  const auto mix = [s](const Eigen::Vector3d& p, const Eigen::Vector3d& q, double from, double to) {
    return Eigen::Vector3d((to - s) / (to - from) * p + (s - from) / (to - from) * q);
  };
  const Eigen::Vector3d ab = mix(a, b, t0, t1), bc = mix(b, c, t1, t2), cd = mix(c, d, t2, t3);
  return mix(mix(ab, bc, t0, t2), mix(bc, cd, t1, t3), t1, t2);
}

std::vector<Eigen::Vector3d> flattened(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> line = {points.front()};
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const int pieces = std::max(4, static_cast<int>((points[i + 1] - points[i]).norm() / chord));
    for (int k = 1; k < pieces; ++k) line.push_back(on_spline(points, i, double(k) / pieces));
    line.push_back(points[i + 1]);
  }
  return line;
}

void check_numbers(const std::string& name, const Drift& d) {
  if (!(d.width > 0 && d.height > 0 && std::isfinite(d.width * d.height)))
    refuse(name, "expected a width and a height > 0 m, found " + number_text(d.width) + " and " +
                     number_text(d.height));
  if (!(std::abs(d.cross_slope) <= 0.5))
    refuse(name, "expected a cross-slope of at most 1 in 2, found " + number_text(d.cross_slope));
  if (!(d.arch >= 0 && d.arch < d.height))
    refuse(name, "expected an arch from 0 to less than the height, " + number_text(d.height) +
                     " m, found " + number_text(d.arch));
}

void check_line(const std::string& name, const std::vector<Eigen::Vector3d>& line) {
  for (const Eigen::Vector3d& p : line)
    if (!p.allFinite()) refuse(name, "expected finite coordinates, found " + point_text(p));
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector3d leg = line[i + 1] - line[i];
    const double run = leg.head<2>().norm();
    if (!(run >= 0.1))
      refuse(name, "expected points at least 0.1 m apart in plan, found " + point_text(line[i]) +
                       " and " + point_text(line[i + 1]));
    if (!(std::abs(leg.z()) <= 0.5 * run))
      refuse(name, "expected floors that rise by at most 1 in 2, found " + point_text(line[i]) +
                       " to " + point_text(line[i + 1]));
    if (i == 0) continue;
    const Eigen::Vector2d before = (line[i] - line[i - 1]).head<2>().normalized();
    if (!(before.dot(leg.head<2>() / run) >= sharpest_turn))
      refuse(name, "turns back on itself at " + point_text(line[i]) +
                       "; expected turns of at most 120 degrees");
  }
}

/// Works out the lines of drifts, those that leave others after these.
class Lines {
 public:
  explicit Lines(const Mine& mine) : mine_(mine) {}

  const CentreLine& of(const std::string& name) {
    const auto known = lines_.find(name);
    if (known != lines_.end()) return known->second;
    const Drift& drift = mine_.drifts.at(name);
    if (!open_.insert(name).second)
      refuse(name, "leaves itself, by way of 'off: " + drift.off + "'");
    check_numbers(name, drift);
    CentreLine line{.drift = name, .width = drift.width, .height = drift.height};
    line.points = drift.off.empty() ? own_points(name, drift) : branch_points(name, drift);
    check_line(name, line.points);
    open_.erase(name);
    return lines_.emplace(name, std::move(line)).first->second;
  }

 private:
  static std::vector<Eigen::Vector3d> own_points(const std::string& name, const Drift& drift) {
    if (drift.line.size() < 2)
      refuse(name, "expected a line of 2 points or more, or off: the drift it leaves; found " +
                       std::to_string(drift.line.size()) + " points");
    if (drift.course == Course::straight) return drift.line;
    check_line(name, drift.line);
    return flattened(drift.line);
  }

  std::vector<Eigen::Vector3d> branch_points(const std::string& name, const Drift& drift) {
    if (!drift.line.empty()) refuse(name, "expected a line or off, found both");
    if (!mine_.drifts.contains(drift.off)) {
      std::vector<std::string> names;
      for (const auto& [other, unused] : mine_.drifts) names.push_back(other);
      refuse(name, unknown_name("drift", drift.off, names));
    }
    const CentreLine& parent = of(drift.off);
    const double longest = length_of(parent);
    if (!(drift.at <= longest))
      refuse(name, "expected at: 0 to " + number_text(longest) + " m along '" + drift.off +
                       "', found " + number_text(drift.at));
    const Eigen::Isometry3d frame = frame_on(parent, drift.at);
    const double sign = drift.side == Side::left ? 1 : -1;
    const double begin = std::max(0.0, parent.width / 2 - overlap_with_parent);
    const double end = parent.width / 2 + drift.length;
    return {frame * Eigen::Vector3d(0, sign * begin, 0), frame * Eigen::Vector3d(0, sign * end, 0)};
  }

  const Mine& mine_;
  std::map<std::string, CentreLine> lines_;
  std::set<std::string> open_;
};

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The nearest points of two legs' axes in plan, as distances along each.
std::pair<double, double> nearest(const Leg& a, const Leg& b) {
  const auto foot = [](const Leg& leg, const Eigen::Vector2d& p) {
    return std::clamp((p - leg.from).dot(leg.direction), 0.0, leg.length);
  };
  const auto at = [](const Leg& leg, double s) {
    return Eigen::Vector2d(leg.from + s * leg.direction);
  };
  if (const double turn = cross(a.direction, b.direction); std::abs(turn) > 1e-9) {
    const double s = cross(b.from - a.from, b.direction) / turn;
    const double t = cross(b.from - a.from, a.direction) / turn;
    if (s >= 0 && s <= a.length && t >= 0 && t <= b.length) return {s, t};
  }
  std::pair<double, double> best;
  double least = std::numeric_limits<double>::infinity();
  const auto offer = [&](double s, double t) {
    const double distance = (at(a, s) - at(b, t)).norm();
    if (distance < least) best = {s, t};
    least = std::min(least, distance);
  };
  for (const double s : {0.0, a.length}) offer(s, foot(b, at(a, s)));
  for (const double t : {0.0, b.length}) offer(foot(a, at(b, t)), t);
  return best;
}

void check_levels(const Leg& a, const Leg& b) {
  const auto [s, t] = nearest(a, b);
  const Eigen::Vector2d place = a.from + s * a.direction;
  const double distance = (place - (b.from + t * b.direction)).norm();
  if (!(distance < (a.width + b.width) / 2)) return;
  const double floor_a = a.floor + s * a.slope, floor_b = b.floor + t * b.slope;
  const double tolerance =
      level_tolerance + distance * std::max(std::abs(a.slope), std::abs(b.slope));
  if (std::abs(floor_a - floor_b) <= tolerance) return;
  if (floor_a + a.height + rock_between <= floor_b || floor_b + b.height + rock_between <= floor_a)
    return;  // one passes above the other
  refuse(a.drift, "meets '" + b.drift + "' near (" + number_text(place.x()) + ", " +
                      number_text(place.y()) + ") on another level: floors at " +
                      number_text(floor_a) + " and " + number_text(floor_b) +
                      " m; expected the same floor, or " + number_text(rock_between) +
                      " m of rock between");
}

std::int64_t cell_of(double x) { return static_cast<std::int64_t>(std::floor(x / cell_size)); }

/// The legs whose outlines may overlap that of `leg`, itself among them: those near a grid of
/// places on it, no place of its outline being farther from the grid than the index's reach.
std::set<std::uint32_t> others_over(const Leg& leg, const LegIndex& index) {
  constexpr double step = LegIndex::reach;
  std::set<std::uint32_t> others;
  const Eigen::Vector2d left(-leg.direction.y(), leg.direction.x());
  for (double s = 0; s < leg.length + step; s += step)
    for (double v = -leg.width / 2; v < leg.width / 2 + step; v += step) {
      const Eigen::Vector2d p =
          leg.from + std::min(s, leg.length) * leg.direction + std::min(v, leg.width / 2) * left;
      for (const std::uint32_t other : index.near({p.x(), p.y(), 0}, 0)) others.insert(other);
    }
  return others;
}

}  // namespace

LegPlace Leg::place_of(const Eigen::Vector3d& p) const {
  const double dx = p.x() - from.x();
  const double dy = p.y() - from.y();
  LegPlace place;
  place.along = dx * direction.x() + dy * direction.y();
  place.side = dy * direction.x() - dx * direction.y();
  const double beyond = bend_from && place.along < 0      ? -place.along
                        : bend_to && place.along > length ? place.along - length
                                                          : 0;
  place.lateral =
      beyond > 0 ? std::sqrt(beyond * beyond + place.side * place.side) : std::abs(place.side);
  place.floor = floor + slope * std::clamp(place.along, 0.0, length) +
                cross_slope * std::clamp(place.side, -width / 2, width / 2);
  return place;
}

double Leg::distance_in_plan(const Eigen::Vector3d& p) const {
  const double dx = p.x() - from.x();
  const double dy = p.y() - from.y();
  const double along = dx * direction.x() + dy * direction.y();
  const double side = dy * direction.x() - dx * direction.y();
  const double beyond = along - std::clamp(along, 0.0, length);
  return std::sqrt(beyond * beyond + side * side);
}

std::vector<CentreLine> centre_lines(const Mine& mine) {
  if (mine.drifts.empty())
    throw std::invalid_argument("mine: expected at least one drift (drifts.NAME.line)");
  Lines lines(mine);
  std::vector<CentreLine> list;
  for (const auto& [name, drift] : mine.drifts) list.push_back(lines.of(name));
  return list;
}

std::vector<Leg> legs_of(const Mine& mine) {
  std::vector<Leg> legs;
  std::size_t number = 0;
  for (const CentreLine& line : centre_lines(mine)) {
    const Drift& drift = mine.drifts.at(line.drift);
    double chainage = 0;
    ++number;
    for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
      const Eigen::Vector3d step = line.points[i + 1] - line.points[i];
      Leg leg{.drift = line.drift,
              .number = number,
              .from = line.points[i].head<2>(),
              .chainage = chainage,
              .floor = line.points[i].z(),
              .cross_slope = drift.cross_slope,
              .width = drift.width,
              .height = drift.height,
              .arch = drift.arch,
              .bend_from = i > 0,
              .bend_to = i + 2 < line.points.size(),
              .start = drift.start,
              .end = drift.end};
      leg.length = step.head<2>().norm();
      leg.direction = step.head<2>() / leg.length;
      leg.slope = step.z() / leg.length;
      chainage += leg.length;
      legs.push_back(leg);
    }
  }
  const LegIndex index(legs, 0);
  for (std::uint32_t i = 0; i < legs.size(); ++i)
    for (const std::uint32_t other : others_over(legs[i], index)) {
      const bool neighbours = legs[i].drift == legs[other].drift && other == i + 1;
      if (other > i && !neighbours) check_levels(legs[i], legs[other]);
    }
  return legs;
}

LegIndex::LegIndex(std::vector<Leg> legs, double margin) : legs_(std::move(legs)) {
  all_.resize(legs_.size());
  std::iota(all_.begin(), all_.end(), 0U);
  const auto extent = [&](const Leg& leg) {
    const Eigen::Vector2d to = leg.from + leg.length * leg.direction;
    // Half a width to all sides covers the outline for any heading.
    const Eigen::Vector2d wide = Eigen::Vector2d::Constant(leg.width / 2 + margin + reach);
    return std::pair<Eigen::Vector2d, Eigen::Vector2d>(leg.from.cwiseMin(to) - wide,
                                                       leg.from.cwiseMax(to) + wide);
  };
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
  low_ = -high;
  for (const Leg& leg : legs_) {
    low_ = low_.cwiseMin(extent(leg).first);
    high = high.cwiseMax(extent(leg).second);
  }
  columns_ = cell_of(high.x() - low_.x()) + 1;
  rows_ = cell_of(high.y() - low_.y()) + 1;
  cells_.resize(static_cast<std::size_t>(columns_ * rows_));
  for (std::uint32_t i = 0; i < legs_.size(); ++i) {
    const auto& [from, to] = extent(legs_[i]);
    const double half = legs_[i].width / 2 + margin + reach;
    for (std::int64_t y = cell_of(from.y() - low_.y()); y <= cell_of(to.y() - low_.y()); ++y)
      for (std::int64_t x = cell_of(from.x() - low_.x()); x <= cell_of(to.x() - low_.x()); ++x) {
        // Slanted legs do not meet all cells of their box.
        const Eigen::Vector2d middle =
            low_ + cell_size * Eigen::Vector2d(double(x) + 0.5, double(y) + 0.5);
        const double along =
            std::clamp((middle - legs_[i].from).dot(legs_[i].direction), 0.0, legs_[i].length);
        const Eigen::Vector2d axis = legs_[i].from + along * legs_[i].direction;
        // Square ends reach as far as their corners.
        if ((middle - axis).norm() <= 1.4143 * half + cell_size * 0.7072)
          cells_[static_cast<std::size_t>(y * columns_ + x)].push_back(i);
      }
  }
}

std::span<const std::uint32_t> LegIndex::near(const Eigen::Vector3d& p, double radius) const {
  if (!(radius <= reach)) return all_;
  const std::int64_t x = cell_of(p.x() - low_.x()), y = cell_of(p.y() - low_.y());
  if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return {};
  return cells_[static_cast<std::size_t>(y * columns_ + x)];
}

}  // namespace minescan
