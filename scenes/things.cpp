// SPDX-License-Identifier: MIT
#include "scenes/things.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "core/parallel.h"
#include "core/table.h"
#include "core/text.h"
#include "scenes/materials.h"
#include "scenes/shapes.h"

namespace minescan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// All assumed.
constexpr double search_beyond = 2;  // how far behind the drift's own section rock is looked for, m
constexpr double farthest_moved = 1;  // how far from the first rock met a thing may end up, m
constexpr double move_step = 0.02;    // by which a thing moves away from rock that it touches, m
constexpr double slack = 0.01;        // between a thing's clearance and rock, beyond rounding, m
constexpr double end_margin = 1;      // of long things at the line's ends, where rock may be, m

// ---- Where the rock is

/// Step along a ray where balls cannot show that it is open, metres.
constexpr double ray_step = 0.04;

/// How far, about, the first rock found reaches into a box of half sides `half`; 0 or less if the
/// box is free of it. It is looked for by balls around the box's parts, and where they do not tell,
/// by samples in cells of half sides up to `cell`, each of which is to be as far from rock as the
/// cell's sides are. Rock may be nearer to the corners of a cell, by 0.73 `cell`.
double rock_in(const ImplicitSurface& rock, const Frame& frame, const Eigen::Vector3d& centre,
               const Eigen::Vector3d& half, double cell) {
  int axis = 0;
  const double longest = half.maxCoeff(&axis);
  const Eigen::Vector3d place = frame * centre;
  if (longest <= cell) return rock.at(place).value + longest;
  if (rock.range(place, half.norm()).high < 0) return 0;
  Eigen::Vector3d part = half;
  part[axis] /= 2;
  const Eigen::Vector3d shift = part[axis] * Eigen::Vector3d::Unit(axis);
  const double depth = rock_in(rock, frame, centre + shift, part, cell);
  return depth > 0 ? depth : rock_in(rock, frame, centre - shift, part, cell);
}

/// The same for a box of `size` about a place in a frame, and all within `clearance` of it. What is
/// free of rock by that is at the least half the clearance away from it.
double too_near(const ImplicitSurface& rock, const Frame& frame, const Eigen::Vector3d& centre,
                const Eigen::Vector3d& size, double clearance) {
  // 0.73 * 0.66 < 1/2. Below 1 cm samples would be too many.
  const double cell = std::clamp(0.66 * clearance, 0.01, 0.05);
  return rock_in(rock, frame, centre, size / 2 + Eigen::Vector3d::Constant(clearance), cell);
}

/// By how much a thing moves that is too near: rock that is not square to its way needs more than
/// that, but whatever is too much is a gap.
double move_from(double depth) { return std::max(move_step, depth / 2); }

/// Distance to the first rock along a ray (`direction` of unit length), to about a millimetre; none
/// if it begins in rock or meets none within `reach`.
std::optional<double> distance_to_rock(const ImplicitSurface& rock, const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction, double reach) {
  if (!(rock.at(origin).value < 0)) return std::nullopt;
  double open = 0;
  double radius = reach / 4;
  while (open < reach) {
    if (2 * radius > ray_step) {
      // A ball without rock is a step without samples.
      if (rock.range(origin + (open + radius) * direction, radius).high < 0) {
        open += 2 * radius;
      } else {
        radius /= 2;
      }
      continue;
    }
    if (rock.at(origin + (open + ray_step) * direction).value < 0) {
      open += ray_step;
      radius = ray_step;
      continue;
    }
    double closed = open + ray_step;
    while (closed - open > 0.001) {
      const double middle = (open + closed) / 2;
      (rock.at(origin + middle * direction).value < 0 ? open : closed) = middle;
    }
    return open;
  }
  return std::nullopt;
}

// ---- Where the drift is

/// A straight part of a centre line.
struct Leg {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::UnitX();
  double start = 0;  // distance along the line
  double length = 1;
  // Tangents of half the angles in plan to the legs before and behind, positive to the left: a
  // place `v` to the left of this leg is on the plane that halves the bend at v * turn behind the
  // beginning, or before the end. 0 at the ends of the line.
  double turn_before = 0;
  double turn_behind = 0;

  Eigen::Vector3d along() const {
    const Eigen::Vector3d d = to - from;
    return Eigen::Vector3d(d.x(), d.y(), 0).normalized();
  }
  /// Metres in plan per metre along the line.
  double flatness() const { return (to - from).head<2>().norm() / length; }
  /// `u` metres from the beginning, held within the leg.
  Eigen::Vector3d at(double u) const {
    return from + std::clamp(u / length, 0.0, 1.0) * (to - from);
  }
  Frame frame(double u) const {
    Frame frame = Frame::Identity();
    const Eigen::Vector3d x = along();
    frame.linear() << x, Eigen::Vector3d::UnitZ().cross(x), Eigen::Vector3d::UnitZ();
    frame.translation() = at(u);
    return frame;
  }
};

void check_line(const CentreLine& line) {
  const std::string what = "centre line of drift '" + line.drift + "'";
  if (line.points.size() < 2)
    throw std::invalid_argument(what + ": expected 2 points or more, found " +
                                std::to_string(line.points.size()));
  for (const double size : {line.width, line.height})
    if (!(size > 0 && std::isfinite(size)))
      throw std::invalid_argument(what + ": expected width and height > 0 (m), found " +
                                  number_text(size));
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    if (!line.points[i].allFinite())
      throw std::invalid_argument(what + ", point " + std::to_string(i) +
                                  ": expected finite coordinates");
    if (i > 0 && !((line.points[i] - line.points[i - 1]).head<2>().norm() > 0))
      throw std::invalid_argument(what + ", point " + std::to_string(i) +
                                  ": expected a place beside the one before, found one above, "
                                  "below or equal to it");
  }
}

std::vector<Leg> legs_of(const CentreLine& line) {
  check_line(line);
  std::vector<Leg> legs;
  double start = 0;
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    Leg leg{.from = line.points[i - 1], .to = line.points[i], .start = start};
    leg.length = (leg.to - leg.from).norm();
    start += leg.length;
    if (!legs.empty()) {
      const Eigen::Vector3d a = legs.back().along(), b = leg.along();
      leg.turn_before = a.cross(b).z() / (1 + a.dot(b));
      legs.back().turn_behind = leg.turn_before;
    }
    legs.push_back(leg);
  }
  return legs;
}

double end_of(const std::vector<Leg>& legs) { return legs.back().start + legs.back().length; }

/// At a bend the leg that begins there.
const Leg& leg_at(const std::vector<Leg>& legs, double at) {
  const auto behind = std::upper_bound(legs.begin(), legs.end(), at,
                                       [](double d, const Leg& leg) { return d < leg.start; });
  return behind == legs.begin() ? legs.front() : *(behind - 1);
}

/// One place along a line: the frame of the centre line, and the leg that it is on.
struct Place {
  Leg leg;
  Frame frame;

  Place(const CentreLine& line, double at) {
    if (std::isnan(at))
      throw std::invalid_argument("drift '" + line.drift + "': expected a distance, found nan");
    leg = leg_at(legs_of(line), at);
    frame = leg.frame(at - leg.start);
  }

  /// The frame moved within itself.
  Frame moved(double u, double v, double z) const { return frame * Eigen::Translation3d(u, v, z); }

  /// Whether a rectangle about (0, v) of the frame stays on the leg's side of the planes that halve
  /// the bends at its ends, so that things on both legs cannot meet.
  bool keeps_to_leg(double v, const Eigen::Vector3d& size) const {
    const Eigen::Vector3d x = leg.along();
    const double behind_begin = (frame.translation() - leg.from).dot(x);
    const double before_end = (leg.to - frame.translation()).dot(x);
    for (const double dv : {-size.y() / 2, size.y() / 2}) {
      const double reach = size.x() / 2;
      if (leg.turn_before != 0 && !(behind_begin - reach > (v + dv) * leg.turn_before + slack))
        return false;
      if (leg.turn_behind != 0 && !(before_end - reach > (v + dv) * leg.turn_behind + slack))
        return false;
    }
    return true;
  }
};

double lateral(const ThingRun& run, double metres) {
  return run.side == Side::left ? metres : -metres;
}

double or_usual(double value, double usual) { return value > 0 ? value : usual; }

// ---- Things at one place

/// Where a box of `size` comes to lie if it is moved from `start` along one of its axes, upwards or
/// downwards on it, against the rock: `clearance` away from it. `reach` is how far the rock may be.
std::optional<Frame> placed_against(const ImplicitSurface& rock, const Frame& start, int axis,
                                    double sign, double reach, const Eigen::Vector3d& size,
                                    double clearance) {
  const Eigen::Vector3d step = sign * Eigen::Vector3d::Unit(axis);
  const std::optional<double> found =
      distance_to_rock(rock, start.translation(), start.linear() * step, reach);
  if (!found) return std::nullopt;
  const double first = *found - size[axis] / 2 - clearance - slack;
  for (double moved = 0; moved <= farthest_moved;) {
    const Eigen::Vector3d place = (first - moved) * step;
    const double depth = too_near(rock, start, place, size, clearance);
    if (depth <= 0) return start * Eigen::Translation3d(place);
    moved += move_from(depth);
  }
  return std::nullopt;
}

std::optional<Frame> hung(const ImplicitSurface& rock, const CentreLine& line, const Place& place,
                          double v, const Eigen::Vector3d& size, double clearance) {
  if (!place.keeps_to_leg(v, size)) return std::nullopt;
  const double up = line.height / 2;
  return placed_against(rock, place.moved(0, v, up), 2, 1, up + search_beyond, size, clearance);
}

void add_light(TriangleMesh& mesh, const CentreLine& line, double at, const ThingRun& run,
               const ImplicitSurface& rock, double clearance) {
  const Eigen::Vector3d size(1.5, 0.3, 0.3);
  const Place place(line, at);
  const auto found = hung(rock, line, place, lateral(run, run.offset), size, clearance);
  if (found) add_box(mesh, *found, size, fixture);
}

/// Plates of 15 cm, 2 cm thick with their bulge, below which 8 cm of a rod of 3 cm stick out. Every
/// 1.5 m across, none within half a metre of the walls and none on the centre line, where lights
/// are. All assumed.
void add_bolts(TriangleMesh& mesh, const CentreLine& line, double at, const ThingRun&,
               const ImplicitSurface& rock, double clearance) {
  constexpr double spacing = 1.5, plate = 0.15, thickness = 0.02, rod = 0.03, length = 0.1;
  const std::array<Eigen::Vector2d, 4> profile = {{{-length / 2, rod / 2},
                                                   {length / 2 - thickness, rod / 2},
                                                   {length / 2 - thickness, plate / 2},
                                                   {length / 2, plate / 2}}};
  constexpr int sides = 6;
  Frame upright = Frame::Identity();
  upright.linear() = Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitY()).matrix();
  const Place place(line, at);
  for (double v = spacing / 2; v <= line.width / 2 - 0.5; v += spacing)
    for (const double side : {1.0, -1.0}) {
      const auto found = hung(rock, line, place, side * v, {plate, plate, length}, clearance);
      if (found) add_revolved(mesh, *found * upright, profile, sides, steel);
    }
}

/// 0.6 x 0.4 m, across the drift or on a wall; assumed.
void add_sign(TriangleMesh& mesh, const CentreLine& line, double at, const ThingRun& run,
              const ImplicitSurface& rock, double clearance) {
  constexpr double width = 0.6, height = 0.4, thickness = 0.02;
  const Place place(line, at);
  if (run.height > 0) {
    const Eigen::Vector3d size(width, thickness, height);
    // Its place across is that of the wall.
    if (!place.keeps_to_leg(lateral(run, line.width / 2), size)) return;
    const auto found = placed_against(rock, place.moved(0, 0, run.height), 1, lateral(run, 1),
                                      line.width / 2 + search_beyond, size, clearance);
    if (found) add_box(mesh, *found, size, paint);
  } else {
    const Eigen::Vector3d size(thickness, width, height);
    const auto found = hung(rock, line, place, lateral(run, run.offset), size, clearance);
    if (found) add_box(mesh, *found, size, paint);
  }
}

/// A load-haul-dump vehicle of 8 x 2.5 x 2.4 m, bucket ahead; parts and sizes assumed, with gaps
/// between all parts.
struct VehiclePart {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  // from the ground below its middle
  Eigen::Vector3d high = Eigen::Vector3d::Ones();
  std::uint8_t material = steel;
  bool wheel = false;  // a cylinder across that fills the box

  Eigen::Vector3d centre() const { return (low + high) / 2; }
  Eigen::Vector3d size() const { return high - low; }
};

const std::vector<VehiclePart>& vehicle_parts() {
  static const std::vector<VehiclePart> parts = {
      {{-2.45, 0.65, 0}, {-0.95, 1.25, 1.5}, rubber, true},
      {{-2.45, -1.25, 0}, {-0.95, -0.65, 1.5}, rubber, true},
      {{0.95, 0.65, 0}, {2.45, 1.25, 1.5}, rubber, true},
      {{0.95, -1.25, 0}, {2.45, -0.65, 1.5}, rubber, true},
      {{-4, -0.6, 0.35}, {-0.1, 0.6, 1.52}, paint},     // rear frame
      {{0.1, -0.6, 0.35}, {2.6, 0.6, 1.52}, paint},     // front frame
      {{-4, -1.15, 1.55}, {-0.85, 1.15, 2.1}, paint},   // engine
      {{-0.75, -0.5, 1.55}, {0.75, 1.15, 2.4}, steel},  // cabin
      {{2.75, -1.25, 0.2}, {4, 1.25, 1.5}, steel},      // bucket
  };
  return parts;
}

void add_vehicle(TriangleMesh& mesh, const CentreLine& line, double at, const ThingRun& run,
                 const ImplicitSurface& rock, double clearance) {
  Eigen::AlignedBox3d whole;
  for (const VehiclePart& part : vehicle_parts()) whole.extend(part.low).extend(part.high);
  const Place place(line, at);
  const double v = lateral(run, run.offset);
  if (!place.keeps_to_leg(v, whole.sizes())) return;
  const double up = line.height / 2;
  const std::optional<double> depth_of_floor = distance_to_rock(
      rock, place.moved(0, v, up).translation(), -Eigen::Vector3d::UnitZ(), up + search_beyond);
  if (!depth_of_floor) return;

  const auto deepest = [&](const Frame& ground) {
    double depth = 0;
    for (const VehiclePart& part : vehicle_parts()) {
      depth = too_near(rock, ground, part.centre(), part.size(), clearance);
      if (depth > 0) break;
    }
    return depth;
  };
  for (double moved = 0; moved <= farthest_moved;) {
    const Frame ground = place.moved(0, v, up - *depth_of_floor + clearance + slack + moved);
    const double depth = deepest(ground);
    if (depth > 0) {
      moved += move_from(depth);
      continue;
    }
    for (const VehiclePart& part : vehicle_parts()) {
      Frame frame = ground * Eigen::Translation3d(part.centre());
      const Eigen::Vector3d size = part.size();
      if (part.wheel) {
        // The axle lies across, and one of the corners is lowest.
        frame.rotate(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
        const std::array<Eigen::Vector2d, 2> profile = {
            {{-size.y() / 2, size.z() / 2}, {size.y() / 2, size.z() / 2}}};
        add_revolved(mesh, frame, profile, 16, part.material);
      } else {
        add_box(mesh, frame, size, part.material);
      }
    }
    return;
  }
}

// ---- Long things

/// A tube along the rock, in lengths.
struct LongThing {
  double radius = 0.1;
  int sides = 8;
  double spacing = 1.5;   // of its points, at most
  double sag = 0;         // of its middle, as part of its length
  double end_gap = 0.02;  // at each end
  bool on_ceiling = false;
  std::uint8_t material = steel;
};

/// A part of a long thing beside one leg, from `low` to `high` metres behind the leg's beginning.
/// Where it goes around a bend it may be beyond the leg's ends.
struct Portion {
  Leg leg = {};
  double low = 0;
  double high = 0;
};

/// The portions of a tube `v` to the left of a line, from `begin` to `end` metres along it. Around
/// bends they meet on the planes that halve them. Empty if no `shortest` length is left.
std::vector<Portion> portions_of(const std::vector<Leg>& legs, double begin, double end, double v,
                                 double radius, double end_gap, double shortest) {
  while (begin < end) {
    std::vector<Portion> portions;
    for (const Leg& leg : legs) {
      const double leg_end = leg.start + leg.length;
      if (!(leg.start < end && leg_end > begin)) continue;
      const double per_plan = 1 / leg.flatness();
      // An end near a bend keeps off the other leg's thing by its own radius.
      const auto mitre = [&](double turn, bool goes_around) {
        return goes_around ? v * turn * per_plan
                           : std::max(0.0, v * turn + radius * std::abs(turn)) * per_plan;
      };
      const bool comes = begin<leg.start, goes = end> leg_end;
      Portion portion{.leg = leg};
      portion.low = mitre(leg.turn_before, comes);
      if (!comes) portion.low = std::max(portion.low, begin - leg.start) + end_gap;
      portion.high = leg.length - mitre(leg.turn_behind, goes);
      if (!goes) portion.high = std::min(portion.high, end - leg.start) - end_gap;
      portions.push_back(portion);
    }
    const auto too_short = [&](const Portion& p) { return !(p.high - p.low >= shortest); };
    if (portions.empty()) return {};
    // Ends that are too short are left out; the bend then is an end.
    const Portion first = portions.front(), last = portions.back();
    if (portions.size() > 1 && too_short(first)) {
      begin = first.leg.start + first.leg.length;
    } else if (portions.size() > 1 && too_short(last)) {
      end = last.leg.start;
    } else if (std::ranges::any_of(portions, too_short)) {
      return {};
    } else {
      return portions;
    }
  }
  return {};
}

/// A point of a long thing: it lies on the way from `from` to the place of the drift's own wall or
/// ceiling at from + `toward`, so that equal shares of two ways are parallel to the drift.
struct Station {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d toward = Eigen::Vector3d::UnitX();
  double share = 0;

  Eigen::Vector3d place() const { return from + share * toward; }
};

std::vector<Station> stations_of(const std::vector<Portion>& portions, const LongThing& thing,
                                 const CentreLine& line, double v, double height) {
  double length = 0;
  for (const Portion& portion : portions) length += portion.high - portion.low;
  std::vector<Station> stations;
  double behind = 0;
  for (const Portion& portion : portions) {
    const double part = portion.high - portion.low;
    const int pieces = std::max(2, static_cast<int>(std::ceil(part / thing.spacing)));
    // The first of a further portion is the last of the one before.
    for (int i = stations.empty() ? 0 : 1; i <= pieces; ++i) {
      const double u = portion.low + part * i / pieces;
      const double s = (behind + part * i / pieces) / length;
      const Leg& leg = portion.leg;
      // On a bend's plane the way comes from the bend itself: square to a leg it would graze the
      // other leg's wall.
      const bool on_bend = i == pieces && &portion != &portions.back();
      const double nearest = on_bend ? leg.length : std::clamp(u, 0.0, leg.length);
      const double beyond = (u - nearest) * leg.flatness();
      const Frame frame = leg.frame(nearest);
      Station station;
      if (thing.on_ceiling) {
        station.from = frame * Eigen::Vector3d(beyond, v, line.height / 2);
        station.toward = line.height / 2 * Eigen::Vector3d::UnitZ();
      } else {
        const double z = height - 4 * thing.sag * length * s * (1 - s);
        station.from = frame * Eigen::Vector3d(0, 0, z);
        station.toward = frame.linear() * Eigen::Vector3d(beyond, v, 0);
      }
      stations.push_back(station);
    }
    behind += part;
  }
  return stations;
}

double too_near(const ImplicitSurface& rock, const Station& a, const Station& b, double radius,
                double clearance) {
  const Eigen::Vector3d from = a.place(), to = b.place();
  const Eigen::Vector3d x = (to - from).normalized();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitZ().cross(x).normalized();
  Frame frame = Frame::Identity();
  frame.linear() << x, y, x.cross(y);
  frame.translation() = (from + to) / 2;
  return too_near(rock, frame, Eigen::Vector3d::Zero(),
                  {(to - from).norm(), 2 * radius, 2 * radius}, clearance);
}

/// Moves stations of a tube towards the rock, clear of it everywhere between them too. The pieces
/// at both ends stay parallel to the drift, so that the gap to the next length stays one.
/// `nominal` is the distance of the drift's own wall or ceiling. False if there is no place.
bool move_to_rock(std::vector<Station>& stations, const ImplicitSurface& rock, double nominal,
                  double radius, double clearance) {
  for (Station& station : stations) {
    const double way = station.toward.norm();
    const std::optional<double> found =
        distance_to_rock(rock, station.from, station.toward / way, way + search_beyond);
    if (!found) return false;
    station.share = (*found - radius - clearance - slack) / way;
  }
  double lowest = 1;
  for (const Station& station : stations) lowest = std::min(lowest, station.share);
  lowest = std::max(0.0, lowest - farthest_moved / nominal);

  const auto level = [](Station& a, Station& b) { a.share = b.share = std::min(a.share, b.share); };
  std::vector<std::array<double, 2>> clear_at(stations.size() - 1, {infinity, infinity});
  for (bool moved = true; moved;) {
    const std::size_t last = stations.size() - 1;
    level(stations[0], stations[1]);
    level(stations[last], stations[last - 1]);
    level(stations[0], stations[1]);  // again, for the two ends may share their middle
    moved = false;
    for (std::size_t i = 1; i < stations.size(); ++i) {
      Station &a = stations[i - 1], &b = stations[i];
      // Known to be clear if both are where they were.
      std::array<double, 2>& clear = clear_at[i - 1];
      if (clear == std::array{a.share, b.share}) continue;
      while (a.share > lowest && b.share > lowest) {
        const double depth = too_near(rock, a, b, radius, clearance);
        if (depth <= 0) break;
        a.share -= move_from(depth) / nominal;
        b.share -= move_from(depth) / nominal;
        moved = true;
      }
      if (!(a.share > lowest && b.share > lowest)) return false;
      clear = {a.share, b.share};
    }
  }
  return true;
}

void add_long(TriangleMesh& mesh, const LongThing& thing, const CentreLine& line, double at,
              double every, double height, const ThingRun& run, const ImplicitSurface& rock,
              double clearance) {
  const std::vector<Leg> legs = legs_of(line);
  const double last = end_of(legs) - end_margin;
  const double end = std::min(at + every, run.to > 0 ? std::min(run.to, last) : last);
  const double v = lateral(run, thing.on_ceiling ? run.offset : line.width / 2);
  // Pieces must be longer than mitres, for bends up to right angles.
  const double shortest = std::max(0.5, 4 * thing.radius);
  const std::vector<Portion> portions =
      portions_of(legs, std::max(at, end_margin), end, v, thing.radius, thing.end_gap, shortest);
  if (portions.empty()) return;
  std::vector<Station> stations = stations_of(portions, thing, line, v, height);
  const double nominal = thing.on_ceiling ? line.height / 2 : line.width / 2;
  if (!move_to_rock(stations, rock, nominal, thing.radius, clearance)) return;
  std::vector<Eigen::Vector3d> points;
  for (const Station& station : stations) points.push_back(station.place());
  if (tube_fits(points, thing.radius))
    add_tube(mesh, points, thing.radius, thing.sides, thing.material);
}

ThingKind long_kind(const std::string& name, const std::string& description, double every,
                    double height, const LongThing& thing) {
  return {.name = name,
          .description = description,
          .every = every,
          .height = height,
          .least = 1,
          .add = [=](TriangleMesh& mesh, const CentreLine& line, double at, const ThingRun& run,
                     const ImplicitSurface& rock, double clearance) {
            add_long(mesh, thing, line, at, or_usual(run.every, every),
                     or_usual(run.height, height), run, rock, clearance);
          }};
}

// ---- Runs

struct Item {
  std::size_t run = 0;
  double at = 0;
};

[[noreturn]] void refuse(const std::string& name, double value, const std::string& expected) {
  throw std::invalid_argument(name + " = " + number_text(value) + " m: expected " + expected);
}

/// A run with its zeros replaced. Throws std::invalid_argument if it does not fit its line.
ThingRun checked(ThingRun run, const ThingKind& kind, const CentreLine& line) {
  fields(run, FieldVisitor{[]<class T>(const char* name, const T& v, const Range& range,
                                       const char*, const char*) {
           if constexpr (std::is_same_v<T, double>) {
             if (!(v >= range.low && v <= range.high && std::isfinite(v)))
               refuse(name, v, expected_number(range, false));
           }
         }});
  // What adding up the legs may have lost; places are held within the line.
  constexpr double rounding = 1e-6;
  const double length = length_of(line);
  const std::string at_most_length = "at most the drift's length, " + number_text(length);
  if (!(run.from <= length + rounding)) refuse("from", run.from, at_most_length);
  if (!(run.to <= length + rounding)) refuse("to", run.to, at_most_length);
  if (run.to == 0) run.to = length;
  if (!(run.to >= run.from)) refuse("to", run.to, "at least from = " + number_text(run.from));
  run.every = or_usual(run.every, kind.every);
  if (!(run.every >= kind.least))
    refuse("every", run.every, "at least " + number_text(kind.least) + " for this kind");
  if (!(run.offset < line.width / 2))
    refuse("offset", run.offset,
           "less than half the drift's width, " + number_text(line.width / 2));
  run.height = or_usual(run.height, kind.height);
  if (!(run.height < line.height))
    refuse("height", run.height, "less than the drift's height, " + number_text(line.height));
  return run;
}

const CentreLine& find_line(const std::vector<CentreLine>& lines, const std::string& drift) {
  std::vector<std::string> known;
  for (const CentreLine& line : lines) {
    if (line.drift == drift) return line;
    known.push_back(line.drift);
  }
  throw std::invalid_argument(unknown_name("drift", drift, known));
}

}  // namespace

double length_of(const CentreLine& line) { return end_of(legs_of(line)); }

Eigen::Isometry3d frame_on(const CentreLine& line, double at) { return Place(line, at).frame; }

const std::vector<ThingKind>& thing_kinds() {
  static const std::vector<ThingKind> list = {
      {.name = "light",
       .description = "fixture of 1.5 x 0.3 x 0.3 m below the ceiling",
       .every = 6,
       .least = 1.6,
       .add = add_light},
      {.name = "bolts",
       .description = "row of rock bolts across the ceiling, 1.5 m apart",
       .every = 1.5,
       .least = 0.2,
       .add = add_bolts},
      long_kind("cable", "cable of 6 cm on a wall, sagging between hooks", 3, 2.2,
                {.radius = 0.03, .sides = 6, .spacing = 0.5, .sag = 0.05, .material = rubber}),
      long_kind("pipe", "steel pipe of 16 cm on a wall, in lengths", 6, 1.2,
                {.radius = 0.08, .sides = 12, .spacing = 2, .material = steel}),
      long_kind("duct", "canvas ventilation duct of 80 cm below the ceiling, in lengths", 10, 0,
                {.radius = 0.4, .sides = 24, .spacing = 2, .on_ceiling = true, .material = canvas}),
      {.name = "sign",
       .description = "board of 0.6 x 0.4 m, across the drift below its ceiling or on a wall",
       .every = 30,
       .least = 0.7,
       .add = add_sign},
      {.name = "vehicle",
       .description = "parked load-haul-dump vehicle of 8 x 2.5 x 2.4 m",
       .every = 60,
       .least = 8.5,
       .add = add_vehicle},
  };
  return list;
}

const ThingKind& find_thing_kind(const std::string& name) {
  return find_row(thing_kinds(), "thing", name);
}

TriangleMesh things_in(const std::vector<ThingRun>& runs, const std::vector<CentreLine>& lines,
                       const ImplicitSurface& rock, double clearance,
                       const Eigen::AlignedBox2d& region) {
  if (!(clearance >= 0 && std::isfinite(clearance)))
    refuse("clearance", clearance, expected_number(not_negative, false));

  struct Known {
    ThingRun run;
    const ThingKind* kind;
    const CentreLine* line;
  };
  std::vector<Known> known;
  std::vector<Item> items;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::string place =
        "run " + std::to_string(r) + " (" + runs[r].kind + " in '" + runs[r].drift + "'): ";
    try {
      const ThingKind& kind = find_thing_kind(runs[r].kind);
      const CentreLine& line = find_line(lines, runs[r].drift);
      known.push_back({checked(runs[r], kind, line), &kind, &line});
    } catch (const std::invalid_argument& e) {
      throw std::invalid_argument(place + e.what());
    }
    const ThingRun& run = known.back().run;
    const std::vector<Leg> legs = legs_of(*known.back().line);
    // 0.3 / 0.1 is 2.999...: the last place is not to be lost to rounding.
    const auto steps = static_cast<std::size_t>((run.to - run.from) / run.every + 1e-9);
    for (std::size_t i = 0; i <= steps; ++i) {
      const double at = run.from + static_cast<double>(i) * run.every;
      const Leg& leg = leg_at(legs, at);
      const Eigen::Vector2d anchor = leg.at(at - leg.start).head<2>();
      if ((anchor.array() >= region.min().array()).all() &&
          (anchor.array() < region.max().array()).all())
        items.push_back({r, at});
    }
  }

  std::vector<TriangleMesh> pieces(items.size());
  parallel_for(items.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Known& k = known[items[i].run];
      k.kind->add(pieces[i], *k.line, items[i].at, k.run, rock, clearance);
    }
  });
  TriangleMesh mesh;
  mesh.materials = mine_materials();
  for (const TriangleMesh& piece : pieces) append(mesh, piece);
  return mesh;
}

}  // namespace minescan
