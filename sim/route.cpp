// SPDX-License-Identifier: MIT
#include "sim/route.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/random.h"

namespace minescan {
namespace {

using Line = std::vector<Eigen::Vector3d>;

// Points nearer than this in plan are one. Assumed: far above rounding in a mine of kilometres.
constexpr double same_place = 1e-6;  // metres

double distance_in_plan(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return (a - b).head<2>().norm();
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

std::string place_text(const Eigen::Vector3d& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x(), p.y(), p.z());
}

void check_line(const Line& line, const std::string& name, std::size_t least) {
  if (line.size() < least)
    throw std::invalid_argument(
        fmt::format("{}: expected {} points or more, found {}", name, least, line.size()));
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (!line[i].allFinite())
      throw std::invalid_argument(
          fmt::format("{}: point {} = {}: expected finite numbers", name, i, place_text(line[i])));
    if (i > 0 && !(distance_in_plan(line[i], line[i - 1]) > same_place))
      throw std::invalid_argument(
          fmt::format("{}: point {} = {}: expected one beside the point before, as seen from above",
                      name, i, place_text(line[i])));
  }
}

// A place on a line.
struct Spot {
  double along = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
};

double length_of(const Line& line) {
  double length = 0;
  for (std::size_t i = 1; i < line.size(); ++i) length += distance_in_plan(line[i], line[i - 1]);
  return length;
}

// The spot of `line` nearest to `p` in plan.
Spot nearest_spot(const Line& line, const Eigen::Vector3d& p) {
  Spot best;
  double best_distance = std::numeric_limits<double>::infinity();
  double start = 0;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Eigen::Vector3d leg = line[i] - line[i - 1];
    const double length = leg.head<2>().norm();
    const double part =
        std::clamp((p - line[i - 1]).head<2>().dot(leg.head<2>()) / (length * length), 0.0, 1.0);
    const Eigen::Vector3d foot = line[i - 1] + part * leg;
    const double distance = distance_in_plan(p, foot);
    if (distance < best_distance) {
      best_distance = distance;
      best = {start + part * length, foot};
    }
    start += length;
  }
  return best;
}

// From one line to the next.
struct Change {
  Spot leave = {};
  Spot enter = {};
  bool from_front = true;  // an open way that begins with this change comes from the line's front
  bool to_back = true;     // and one that ends with it goes to the back of the next
};

// Of a line that is left or entered at `spot`, a way takes the longer part, and in doubt `even`.
bool front_is_far(const Line& line, const Spot& spot, bool even) {
  const double beyond_half = spot.along - length_of(line) / 2;
  return std::abs(beyond_half) <= same_place ? even : beyond_half > 0;
}

Change change_at(const Line& a, const Line& b, const Spot& leave, const Spot& enter) {
  return {.leave = leave,
          .enter = enter,
          .from_front = front_is_far(a, leave, true),
          .to_back = !front_is_far(b, enter, false)};
}

bool within(double reach, const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  return distance_in_plan(p, q) <= reach && std::abs(p.z() - q.z()) <= reach;
}

// In order along `a`.
std::vector<Change> crossings(const Line& a, const Line& b) {
  std::vector<Change> found;
  double start_a = 0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    const Eigen::Vector3d leg_a = a[i] - a[i - 1];
    double start_b = 0;
    for (std::size_t k = 1; k < b.size(); ++k) {
      const Eigen::Vector3d leg_b = b[k] - b[k - 1];
      const Eigen::Vector2d between = (b[k - 1] - a[i - 1]).head<2>();
      const double area = cross(leg_a.head<2>(), leg_b.head<2>());
      // Infinite or NaN for parallel legs, which do not cross.
      const double u = cross(between, leg_b.head<2>()) / area;
      const double v = cross(between, leg_a.head<2>()) / area;
      if (0 <= u && u <= 1 && 0 <= v && v <= 1)
        found.push_back(change_at(a, b,
                                  {start_a + u * leg_a.head<2>().norm(), a[i - 1] + u * leg_a},
                                  {start_b + v * leg_b.head<2>().norm(), b[k - 1] + v * leg_b}));
      start_b += leg_b.head<2>().norm();
    }
    start_a += leg_a.head<2>().norm();
  }
  std::sort(found.begin(), found.end(),
            [](const Change& x, const Change& y) { return x.leave.along < y.leave.along; });
  return found;
}

// Where both lines run side by side: an end of each has its foot between the ends of the other.
std::optional<Change> overlap(const Line& a, const Line& b, double reach) {
  const auto foot = [&](const Eigen::Vector3d& end, const Line& line) -> std::optional<Spot> {
    const Spot spot = nearest_spot(line, end);
    const bool between_ends = spot.along > same_place && spot.along < length_of(line) - same_place;
    if (between_ends && within(reach, end, spot.point)) return spot;
    return {};
  };
  // Each is followed towards the end that lies beside the other, or from there.
  for (const bool from_front : {true, false})
    for (const bool to_back : {true, false}) {
      const std::optional<Spot> enter = foot(from_front ? a.back() : a.front(), b);
      const std::optional<Spot> leave = foot(to_back ? b.front() : b.back(), a);
      if (enter && leave) return Change{*leave, *enter, from_front, to_back};
    }
  return {};
}

Change nearest_points(const Line& a, const Line& b) {
  Spot leave, enter;
  double best_distance = std::numeric_limits<double>::infinity();
  // Of lines that do not cross, one of the two nearest points is a corner or an end.
  const auto offer = [&](const Eigen::Vector3d& p) {
    const Spot on_a = nearest_spot(a, p);
    const Spot on_b = nearest_spot(b, p);
    const double distance = distance_in_plan(on_a.point, on_b.point);
    if (!(distance < best_distance)) return;
    best_distance = distance;
    leave = on_a;
    enter = on_b;
  };
  for (const Eigen::Vector3d& p : a) offer(p);
  for (const Eigen::Vector3d& p : b) offer(p);
  return change_at(a, b, leave, enter);
}

// From line i to line k; `entered` is where line i was entered, if that is known.
Change change_over(const std::vector<Line>& lines, std::size_t i, std::size_t k,
                   std::optional<double> entered, double reach) {
  const Line& a = lines[i];
  const Line& b = lines[k];
  std::optional<Change> chosen;
  const auto distance = [&](const Change& c) {
    const double from_entry = entered ? std::abs(c.leave.along - *entered) : c.leave.along;
    // Leaving where it was entered is the last choice.
    return entered && from_entry < same_place ? std::numeric_limits<double>::infinity()
                                              : from_entry;
  };
  const std::vector<Change> found = crossings(a, b);
  for (const Change& crossing : found)
    if (within(reach, crossing.leave.point, crossing.enter.point) &&
        (!chosen || distance(crossing) < distance(*chosen)))
      chosen = crossing;
  if (!chosen) chosen = overlap(a, b, reach);
  if (chosen) return *chosen;
  const Change nearest = nearest_points(a, b);
  if (within(reach, nearest.leave.point, nearest.enter.point)) return nearest;
  // Lines that cross too far above each other are told by their crossing.
  const Change& far = found.empty() ? nearest : found[0];
  throw std::invalid_argument(fmt::format(
      "route: lines {} and {} do not meet: from {} to {} are {:.3g} m in plan and {:.3g} m in "
      "height, expected {:.3g} m or less",
      i, k, place_text(far.leave.point), place_text(far.enter.point),
      distance_in_plan(far.leave.point, far.enter.point),
      std::abs(far.leave.point.z() - far.enter.point.z()), reach));
}

// Where two points are one in plan, at a crossing, the path is at the mean of both heights.
void append(Line& path, const Eigen::Vector3d& point) {
  if (!path.empty() && distance_in_plan(path.back(), point) <= same_place)
    path.back().z() = (path.back().z() + point.z()) / 2;
  else
    path.push_back(point);
}

// Appends what lies on the line between two spots, in either direction.
void follow(Line& path, const Line& line, const Spot& from, const Spot& to) {
  std::vector<Spot> between;
  double along = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) along += distance_in_plan(line[i], line[i - 1]);
    if (along > std::min(from.along, to.along) + same_place &&
        along < std::max(from.along, to.along) - same_place)
      between.push_back({along, line[i]});
  }
  if (to.along < from.along) std::reverse(between.begin(), between.end());
  append(path, from.point);
  for (const Spot& spot : between) append(path, spot.point);
  append(path, to.point);
}

}  // namespace

std::vector<Eigen::Vector3d> joined_lines(const std::vector<std::vector<Eigen::Vector3d>>& lines,
                                          bool closed, double reach) {
  const std::size_t count = lines.size();
  if (count < (closed ? 2u : 1u))
    throw std::invalid_argument(fmt::format("route: expected {} or more, found {}",
                                            closed ? "two lines" : "one line", count));
  for (std::size_t i = 0; i < count; ++i) check_line(lines[i], fmt::format("route: line {}", i), 2);
  if (count == 1) return lines[0];

  // changes[i] leads from line i to the next.
  std::vector<Change> changes(closed ? count : count - 1);
  if (closed) changes[count - 1] = change_over(lines, count - 1, 0, {}, reach);
  for (std::size_t i = 0; i + 1 < count; ++i) {
    std::optional<double> entered;
    if (i > 0) entered = changes[i - 1].enter.along;
    if (i == 0 && closed) entered = changes[count - 1].enter.along;
    changes[i] = change_over(lines, i, i + 1, entered, reach);
  }

  Line path;
  for (std::size_t i = 0; i < count; ++i) {
    const Spot front = {0, lines[i].front()};
    const Spot back = {length_of(lines[i]), lines[i].back()};
    const Spot from = i > 0 || closed         ? changes[(i + count - 1) % count].enter
                      : changes[0].from_front ? front
                                              : back;
    const Spot to = i + 1 < count || closed  ? changes[i].leave
                    : changes[i - 1].to_back ? back
                                             : front;
    follow(path, lines[i], from, to);
  }
  if (closed && path.size() > 1 && distance_in_plan(path.front(), path.back()) <= same_place) {
    path.front().z() = (path.front().z() + path.back().z()) / 2;
    path.pop_back();
  }
  if (path.size() < (closed ? 3u : 2u))
    throw std::invalid_argument(
        fmt::format("route: lines 0 to {} meet in one place and lead nowhere from it", count - 1));
  return path;
}

Route::Route(const std::vector<Eigen::Vector3d>& points, bool closed, double turn_radius)
    : closed_(closed) {
  check_line(points, "route", closed ? 3 : 2);
  if (closed) check_line({points.back(), points.front()}, "route from its last point", 2);
  if (!(turn_radius > 0 && std::isfinite(turn_radius)))
    throw std::invalid_argument(
        fmt::format("route: turn radius = {} m: expected a number > 0", turn_radius));

  // Leg i goes from point i to the next; corner i is at point i, between legs i - 1 and i.
  const std::size_t count = points.size();
  const std::size_t legs = closed ? count : count - 1;
  std::vector<Eigen::Vector3d> leg(legs);
  std::vector<double> leg_length(legs);
  for (std::size_t i = 0; i < legs; ++i) {
    leg[i] = points[(i + 1) % count] - points[i];
    leg_length[i] = leg[i].head<2>().norm();
  }
  std::vector<double> turn(count, 0.0);     // radians to the left
  std::vector<double> tangent(count, 0.0);  // metres from the corner to where its arc begins
  for (std::size_t i = closed ? 0 : 1; i < legs; ++i) {
    const Eigen::Vector2d before = leg[(i + legs - 1) % legs].head<2>();
    const Eigen::Vector2d after = leg[i].head<2>();
    turn[i] = std::atan2(cross(before, after), before.dot(after));
    const double degree = std::numbers::pi / 180;
    if (std::abs(turn[i]) > 175 * degree)  // assumed: the arc would be a turn on the spot
      throw std::invalid_argument(
          fmt::format("route: turns back at {}: expected corners of 175 degrees or less",
                      place_text(points[i])));
    tangent[i] = turn_radius * std::tan(std::abs(turn[i]) / 2);
  }
  // Two corners share the leg between them in proportion to what they want of it.
  std::vector<double> share(count, 1.0);
  for (std::size_t i = 0; i < legs; ++i) {
    const std::size_t next = (i + 1) % count;
    const double wanted = tangent[i] + tangent[next];
    if (wanted <= leg_length[i]) continue;
    share[i] = std::min(share[i], leg_length[i] / wanted);
    share[next] = std::min(share[next], leg_length[i] / wanted);
  }
  for (std::size_t i = 0; i < count; ++i) tangent[i] *= share[i];

  next_heading_ = std::atan2(leg[0].y(), leg[0].x());
  for (std::size_t i = 0; i < legs; ++i) {
    const std::size_t next = (i + 1) % count;
    const auto on_leg = [&](std::size_t k, double along) -> Eigen::Vector3d {
      return points[k] + along / leg_length[k] * leg[k];
    };
    const Eigen::Vector3d to = on_leg(i, leg_length[i] - tangent[next]);
    add(leg_length[i] - tangent[i] - tangent[next], 0, to.z(), on_leg(i, tangent[i]));
    if (turn[next] == 0) continue;
    const double radius = tangent[next] / std::tan(std::abs(turn[next]) / 2);
    add(radius * std::abs(turn[next]), std::copysign(1 / radius, turn[next]),
        on_leg(next, tangent[next]).z(), to);
  }
}

// Corners that use up a leg leave nothing of it, give or take a rounding.
void Route::add(double length, double curvature, double to_height, const Eigen::Vector3d& from) {
  if (!(length > 0)) return;
  pieces_.push_back({.start = pieces_.empty() ? 0 : this->length(),
                     .length = length,
                     .from = from,
                     .heading = next_heading_,
                     .curvature = curvature,
                     .slope = (to_height - from.z()) / length});
  next_heading_ += curvature * length;
}

double Route::length() const { return pieces_.back().start + pieces_.back().length; }

RoutePlace Route::at(double along) const {
  if (!std::isfinite(along))
    throw std::invalid_argument(
        fmt::format("route: {} m along it: expected a finite number", along));
  if (!closed_ && !(0 <= along && along <= length()))
    throw std::invalid_argument(
        fmt::format("route: {} m along it: expected one from 0 m to {} m", along, length()));
  const double rounds = closed_ ? std::floor(along / length()) : 0;
  const double on_this_round = along - rounds * length();
  const auto later =
      std::upper_bound(pieces_.begin() + 1, pieces_.end(), on_this_round,
                       [](double value, const Piece& piece) { return value < piece.start; });
  const Piece& piece = *(later - 1);
  const double s = on_this_round - piece.start;
  const double turned = piece.curvature * s;
  // A chord: it leaves by half the angle of its arc, and sin(x) / x is exact for small angles.
  const double middle = piece.heading + turned / 2;
  const double chord = turned == 0 ? s : s * std::sin(turned / 2) / (turned / 2);
  const Eigen::Vector3d step(chord * std::cos(middle), chord * std::sin(middle), s * piece.slope);
  const double round_turn = next_heading_ - pieces_.front().heading;
  return {.position = piece.from + step, .heading = piece.heading + turned + rounds * round_turn};
}

std::vector<double> stops(const Route& route, double step_min, double step_max, std::size_t count,
                          std::uint64_t seed) {
  if (!(0 < step_min && step_min <= step_max && std::isfinite(step_max)))
    throw std::invalid_argument(fmt::format(
        "stops: steps from {} m to {} m: expected 0 < smallest <= largest", step_min, step_max));
  std::vector<double> list;
  double along = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (k > 0) {
      Random random(derived_seed(seed, "stops"), k);
      along += step_min + (step_max - step_min) * random.uniform();
    }
    if (!route.closed() && !(along <= route.length()))
      throw std::invalid_argument(
          fmt::format("stops: stop {} of {} would be at {:.4g} m: expected a route longer than its "
                      "{:.4g} m",
                      k, count, along, route.length()));
    list.push_back(along);
  }
  return list;
}

}  // namespace minescan
