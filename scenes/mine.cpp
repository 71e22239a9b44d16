// SPDX-License-Identifier: MIT
#include "scenes/mine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>

#include "core/gradient_noise.h"
#include "core/random.h"
#include "core/text.h"
#include "scenes/legs.h"
#include "scenes/materials.h"

namespace minescan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Overbreak is where a weakness of unit RMS exceeds one: 17 % of a wall, with a mean excess of 0.46
// for one octave of gradient noise (both found numerically). Deeper than so many times the mean,
// the rock is taken to have held (assumed).
constexpr double overbreak_level = 1;
constexpr double overbreak_mean = 0.46;
constexpr double overbreak_deepest = 2;

// Halves of drill holes are left where the round has loosened no rock beyond them: about every
// second one, over most of the round's length (assumed). Holes are 5 cm wide.
constexpr double half_cast_radius = 0.025;
constexpr double half_cast_share = 0.5;
constexpr double half_cast_part = 0.8;

// How far the break between two rounds strays from its plane, metres RMS, and how long it is, times
// its height (assumed). Steeper ones would leave chips of rock in the air where the relief turns
// over.
constexpr double round_break = 0.3;
constexpr double round_fall = 2;

// Wheel ruts of a loader (assumed), metres.
constexpr double rut_track = 2.0;
constexpr double rut_width = 0.25;        // where its depth has fallen to 1 / e, from the middle
constexpr double rut_steepness = 0.8578;  // largest slope of exp(-x^2): sqrt(2 / e)

// Wet patches: about this large (assumed), metres.
constexpr double wet_patch = 3;

// Water stands on floors flatter than this only (assumed).
constexpr double level_floor = 0.002;

Interval operator-(const Interval& a, const Interval& b) {
  return {a.low - b.high, a.high - b.low};
}
Interval operator+(const Interval& a, const Interval& b) {
  return {a.low + b.low, a.high + b.high};
}

/// Both ends under a function that does not fall.
template <class Function>
Interval through(const Interval& x, Function&& f) {
  return {f(x.low), f(x.high)};
}

/// The surfaces of a drift that meet in rounded edges.
enum Part { wall, ceiling, floor_part, part_count };

template <class T>
using Parts = std::array<T, part_count>;

/// The largest of some distances, rounded with radius r where several faces meet. Not falling in
/// any of them, so that it may be applied to both ends of intervals. Sharp corners between rough
/// faces would leave pockets and bridges of a few cells where the lattice is too coarse for their
/// tips.
double rounded_max(std::span<const double> distances, double r) {
  double squares = 0;
  int near = 0;
  for (const double d : distances) {
    if (d <= -r) continue;
    squares += (d + r) * (d + r);
    ++near;
  }
  if (near > 1) return std::sqrt(squares) - r;
  return *std::max_element(distances.begin(), distances.end());
}

Interval rounded_max(const Interval& a, const Interval& b, double r) {
  return {rounded_max(std::array{a.low, b.low}, r), rounded_max(std::array{a.high, b.high}, r)};
}

/// Distances to the surfaces of one leg before displacement; negative inside.
struct LegDistances {
  LegPlace place = {};
  Parts<double> parts = {};
  double concrete = -infinity;  // to the nearest flat face
};

/// A leg with what is the same at all places worked out.
struct LegShape {
  Leg leg;
  Parts<double> steepness = {1, 1, 1};  // how fast the distances change at most
  double corner_radius = 0;
  std::uint64_t seed = 0;  // of the drift's own

  LegShape(const Leg& l, double radius, std::uint64_t field_seed)
      : leg(l), corner_radius(radius), seed(derived_seed(field_seed, "drift " + l.drift)) {
    const double arch = 4 * leg.arch / leg.width;
    const double across = std::abs(leg.cross_slope);
    steepness[ceiling] = std::hypot(1, leg.slope, across + arch);
    steepness[floor_part] = std::hypot(1, leg.slope, across);
  }

  LegDistances distances(const Eigen::Vector3d& p) const {
    LegDistances d;
    d.place = leg.place_of(p);
    const double half = leg.width / 2;
    const double across = std::min(d.place.lateral / half, 1.0);
    d.parts = {d.place.lateral - half,
               p.z() - d.place.floor - leg.height + leg.arch * across * across,
               d.place.floor - p.z()};
    const auto close = [&](End end, double distance) {
      if (end == End::concrete) {
        d.concrete = std::max(d.concrete, distance);
      } else {
        d.parts[wall] = rounded_max(std::array{d.parts[wall], distance}, corner_radius);
      }
    };
    if (!leg.bend_from) close(leg.start, -d.place.along);
    if (!leg.bend_to) close(leg.end, d.place.along - leg.length);
    return d;
  }
};

/// A pillar with what is the same at all places worked out.
struct PillarShape {
  Eigen::Vector2d centre;
  Eigen::Vector2d along;
  Eigen::Vector2d half;
  double corner_radius;

  PillarShape(const Pillar& p, double radius)
      : centre(p.at.front().head<2>()),
        along(std::cos(p.heading), std::sin(p.heading)),
        half(p.length / 2, p.width / 2),
        corner_radius(std::min(radius, half.minCoeff())) {}

  /// Positive in the pillar, negative outside.
  double depth(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d d = p.head<2>() - centre;
    const double u = std::abs(d.dot(along)) - half.x() + corner_radius;
    const double v = std::abs(along.x() * d.y() - along.y() * d.x()) - half.y() + corner_radius;
    const double outside = std::hypot(std::max(u, 0.0), std::max(v, 0.0));
    return corner_radius - outside - std::min(std::max(u, v), 0.0);
  }
};

class MineField {
 public:
  MineField(const Mine& mine, std::uint64_t seed, double finest)
      : rock_(mine.rock),
        wall_(rock_.wall, derived_seed(seed, "wall"), finest),
        ceiling_(rock_.ceiling, derived_seed(seed, "ceiling"), finest),
        floor_(road_relief(rock_.floor_class, rock_.floor_inner, rock_.floor_outer),
               derived_seed(seed, "floor"), finest),
        concrete_(rock_.concrete, derived_seed(seed, "concrete"), finest),
        weakness_({.rms = rock_.overbreak > 0 || rock_.look_out > 0 ? 1.0 : 0.0,
                   .inner = rock_.overbreak_scale,
                   .outer = rock_.overbreak_scale},
                  derived_seed(seed, "weakness"), 0),
        wet_({.rms = rock_.wet_share > 0 ? 1.0 : 0.0, .inner = wet_patch / 8, .outer = wet_patch},
             derived_seed(seed, "wet"), finest),
        bedding_(rock_.bedding_step, rock_.bedding_plate, derived_seed(seed, "bedding")),
        stones_(rock_.rock_density, rock_.rock_size, derived_seed(seed, "stones"), finest),
        index_(legs_of(mine), margin()) {
    for (const Leg& leg : index_.legs()) shapes_.emplace_back(leg, rock_.corner_radius, seed);
    for (const auto& [name, pillar] : mine.pillars) {
      if (pillar.at.size() != 1)
        throw std::invalid_argument("pillar '" + name + "': expected at: one point, found " +
                                    std::to_string(pillar.at.size()));
      pillars_.emplace_back(pillar, rock_.corner_radius);
    }
    if (rock_.puddle_share > 0)
      water_level_ = -normal_upper_quantile(rock_.puddle_share) *
                     road_relief(rock_.floor_class, rock_.floor_inner, rock_.floor_outer).rms;
    if (rock_.wet_share > 0) wet_level_ = normal_upper_quantile(rock_.wet_share);
    if (rock_.half_cast_spacing > 0 && !(rock_.half_cast_spacing >= 8 * half_cast_radius))
      throw std::invalid_argument("half-cast-spacing: expected 0 or at least " +
                                  number_text(8 * half_cast_radius) + " m, found " +
                                  number_text(rock_.half_cast_spacing));
    // Grooves that no edge of the mesh would show are left out.
    half_casts_ = rock_.half_cast_spacing > 0 && finest <= 2 * half_cast_radius;
  }

  struct Value {
    Interval interval = {};
    std::uint8_t material = sandstone;  // these two only meaningful for radius 0
    std::uint8_t face = 0;
  };

  /// The displaced field in a ball. Relief takes most of the time, so it is evaluated only where it
  /// can change the result: first all is bounded without it.
  Value value(const Eigen::Vector3d& p, double radius) const {
    const std::span<const std::uint32_t> near = index_.near(p, radius);
    double lowest_high = infinity;
    for_each_drift(near, p, radius, [&](const auto& for_each_leg) {
      double high = -infinity;
      for_each_leg([&](const LegShape& shape) {
        high = std::max(high, loose(shape.distances(p), shape, radius).high);
      });
      lowest_high = std::min(lowest_high, high);
    });

    ReliefHere relief{*this, p, radius};
    // Legs that are not near are farther than this. Values do not tell more, wherever one asks.
    const double farther = radius <= LegIndex::reach ? LegIndex::reach - radius : LegIndex::reach;
    Value result = {.interval = {farther, infinity}};
    for_each_drift(near, p, radius, [&](const auto& for_each_leg) {
      // The ball may hold places of any of these legs.
      Value drift = {.interval = {infinity, -infinity}};
      for_each_leg([&](const LegShape& shape) {
        const LegDistances d = shape.distances(p);
        const Interval bounds = loose(d, shape, radius);
        const Value leg =
            bounds.low > lowest_high ? Value{bounds} : leg_value(shape, d, radius, relief);
        if (leg.interval.low < drift.interval.low) {
          drift.material = leg.material;
          drift.face = leg.face;
        }
        drift.interval.low = std::min(drift.interval.low, leg.interval.low);
        drift.interval.high = std::max(drift.interval.high, leg.interval.high);
      });
      if (drift.interval.low < result.interval.low) {
        result.material = drift.material;
        result.face = drift.face;
      }
      result.interval.low = std::min(result.interval.low, drift.interval.low);
      result.interval.high = std::min(result.interval.high, drift.interval.high);
    });
    for (const PillarShape& pillar : pillars_) add_pillar(pillar, p, radius, relief, result);
    return result;
  }

  std::vector<Material> materials() const {
    std::vector<Material> list = mine_materials();
    const auto roughen = [&](std::uint8_t material, const Relief& relief) {
      list[material].roughness = relief.left_out().height;
      list[material].fine_slope = relief.left_out().slope;
    };
    roughen(sandstone, wall_);
    roughen(wet_sandstone, wall_);
    roughen(bedded_sandstone, ceiling_);
    roughen(gravel, floor_);
    roughen(concrete, concrete_);
    return list;
  }

  const std::vector<Leg>& legs() const { return index_.legs(); }

  /// Largest displacement of any surface.
  double margin() const {
    return std::max({wall_bound(), ceiling_bound(), floor_bound(), concrete_.bound()});
  }

 private:
  /// What is the same for all legs at one place, each evaluated when it is first asked for.
  enum Shared { wall_relief, ceiling_relief, concrete_relief, weakness, shared_count };
  struct ReliefHere {
    const MineField& field;
    const Eigen::Vector3d& place;
    double radius;
    std::array<Interval, shared_count> values = {};
    std::array<bool, shared_count> known = {};

    const Interval& operator[](Shared which) {
      const auto i = static_cast<std::size_t>(which);
      if (!known[i]) values[i] = field.shared(which, place, radius);
      known[i] = true;
      return values[i];
    }

    // Of the floor below or above the place: a height over its plan, so that water on it is level.
    Interval floor = {};
    double floor_z = infinity;  // for which it was evaluated

    const Interval& on_floor(double z, double steepness) {
      if (floor_z != z) {
        const double reach = radius * steepness;
        const Eigen::Vector3d foot(place.x(), place.y(), z);
        floor = field.floor_.range(foot, reach) + field.stones_.range(foot, reach);
      }
      floor_z = z;
      return floor;
    }
  };

  /// A drift is what its nearest leg says. For each drift with legs in `near` (which lists them one
  /// after the other), calls action(for_each_leg), where for_each_leg(f) calls f for those of its
  /// legs that are the nearest one to some place in the ball.
  template <class Action>
  void for_each_drift(std::span<const std::uint32_t> near, const Eigen::Vector3d& p, double radius,
                      Action&& action) const {
    for (std::size_t begin = 0, end = 0; begin < near.size(); begin = end) {
      const auto number = shapes_[near[begin]].leg.number;
      while (end < near.size() && shapes_[near[end]].leg.number == number) ++end;
      if (end - begin == 1) {
        action([&](auto&& f) { f(shapes_[near[begin]]); });
        continue;
      }
      std::uint32_t first = near[begin];
      double nearest = infinity;
      for (std::size_t i = begin; i < end; ++i) {
        const double distance = shapes_[near[i]].leg.distance_in_plan(p);
        if (distance < nearest) first = near[i];
        nearest = std::min(nearest, distance);
      }
      if (radius == 0) {
        action([&](auto&& f) { f(shapes_[first]); });
        continue;
      }
      action([&](auto&& f) {
        for (std::size_t i = begin; i < end; ++i)
          if (shapes_[near[i]].leg.distance_in_plan(p) <= nearest + 2 * radius) f(shapes_[near[i]]);
      });
    }
  }

  /// The field of one leg, exact where that matters.
  Value leg_value(const LegShape& shape, const LegDistances& d, double radius,
                  ReliefHere& relief) const {
    Parts<Interval> parts = loose_parts(d, shape, radius);
    for (int part = 0; part < part_count; ++part) {
      if (!matters(parts, part)) continue;
      const double r = radius * shape.steepness[part];
      parts[part] = Interval{d.parts[part] - r, d.parts[part] + r} -
                    displacement(part, d.place, shape, relief);
    }
    Interval flat = {-infinity, -infinity};
    if (d.concrete > -infinity)
      flat = Interval{d.concrete - radius, d.concrete + radius} - relief[concrete_relief];
    const Interval rough = united(parts);
    Value value = {.interval = {std::max(rough.low, flat.low), std::max(rough.high, flat.high)}};
    if (flat.low > rough.low) {
      value.material = concrete;
      value.face = 1;
    } else {
      value.material = material_of(parts, d.place, shape, relief);
    }
    return value;
  }

  double wall_bound() const {
    return wall_.bound() + overbreak_deepest * rock_.overbreak + rock_.look_out / 2 +
           half_cast_radius;
  }
  double ceiling_bound() const { return ceiling_.bound() + bedding_.bound(); }
  double floor_bound() const { return floor_.bound() + stones_.bound() + rock_.rut_depth; }
  double bound_of(int part) const {
    return part == wall ? wall_bound() : part == ceiling ? ceiling_bound() : floor_bound();
  }

  Interval shared(Shared which, const Eigen::Vector3d& p, double radius) const {
    switch (which) {
      case wall_relief:
        return wall_.range(p, radius);
      case ceiling_relief:
        return ceiling_.range(p, radius) + bedding_.range(p, radius);
      case concrete_relief:
        return concrete_.range(p, radius);
      default:
        return weakness_.range(p, radius);
    }
  }

  /// By how much a surface lies beyond its place, into the rock.
  Interval displacement(int part, const LegPlace& place, const LegShape& shape,
                        ReliefHere& relief) const {
    switch (part) {
      case wall:
        return relief[wall_relief] + overbreak(relief) +
               saw_tooth(shape.leg.chainage + place.along, relief) +
               half_casts(place, shape, relief);
      case ceiling:
        return relief[ceiling_relief];
      default: {
        const Interval height = floor_height(place, shape, relief);
        return {-height.high, -height.low};
      }
    }
  }

  Interval overbreak(ReliefHere& relief) const {
    if (rock_.overbreak == 0) return {0, 0};
    return through(relief[weakness], [this](double weak) {
      const double depth = std::max(0.0, weak - overbreak_level) / overbreak_mean;
      return rock_.overbreak * std::min(depth, overbreak_deepest);
    });
  }

  /// Drilling leans outwards, to make room for the drill in the next round; around its mean. Rounds
  /// do not break off along a plane, but where the rock is weak.
  Interval saw_tooth(double chainage, ReliefHere& relief) const {
    if (rock_.look_out == 0) return {0, 0};
    const Interval weak = relief[weakness];
    const double from = chainage - relief.radius + round_break * weak.low;
    const double to = chainage + relief.radius + round_break * weak.high;
    const double length = rock_.round_length;
    const double fall = std::min(round_fall * rock_.look_out, length / 2);
    // Rising from the start of a round to its tip, falling from there to the next start.
    const auto height = [&](double x) {
      const double within = x - length * std::floor(x / length);
      const double tip = length - fall;
      const double part = within < tip ? within / tip : (length - within) / fall;
      return rock_.look_out * (part - 0.5);
    };
    const auto between_multiples = [&](double shift) {
      return std::floor((from - shift) / length) == std::floor((to - shift) / length);
    };
    const double ends[] = {height(from), height(to)};
    return {between_multiples(0) ? std::min(ends[0], ends[1]) : -rock_.look_out / 2,
            between_multiples(length - fall) ? std::max(ends[0], ends[1]) : rock_.look_out / 2};
  }

  /// Grooves along the drift at multiples of the spacing, each with its own small shift.
  Interval half_casts(const LegPlace& place, const LegShape& shape,
                      const ReliefHere& relief) const {
    if (!half_casts_) return {0, 0};
    const Interval any = {0, half_cast_radius};
    const double spacing = rock_.half_cast_spacing;
    if (relief.radius > spacing / 4) return any;
    const double chainage = shape.leg.chainage + place.along;
    const double z = relief.place.z() - place.floor;
    const auto round = static_cast<std::int64_t>(std::floor(chainage / rock_.round_length));
    const auto hole = static_cast<std::int64_t>(std::floor(z / spacing));
    const double within = chainage - static_cast<double>(round) * rock_.round_length;
    const double longest = half_cast_part * rock_.round_length;
    // A ball over either end of a groove, or over the axis, holds more than one of them.
    const double border = std::min(
        {within, std::abs(within - longest), rock_.round_length - within, std::abs(place.side)});
    if (relief.radius > 0 && border <= relief.radius) return any;
    if (within > longest) return {0, 0};
    const std::int64_t side = place.side > 0 ? 1 : 0;
    const auto uniform = [&](std::int64_t purpose) {
      return lattice_uniform(round, hole, 2 * purpose + side, shape.seed);
    };
    if (uniform(0) >= half_cast_share) return {0, 0};
    const double middle = (static_cast<double>(hole) + 0.4 + 0.2 * uniform(1)) * spacing;
    const auto depth = [](double distance) {
      const double t = distance / half_cast_radius;
      return t < 1 ? half_cast_radius * std::sqrt(1 - t * t) : 0.0;
    };
    // A ball that reaches over to the next hole's part of the wall still keeps away from that hole.
    const double distance = std::abs(z - middle);
    const double reach = relief.radius * shape.steepness[floor_part];
    return {depth(distance + reach), depth(std::max(0.0, distance - reach))};
  }

  /// Of stones and relief, with ruts; without water.
  Interval dry_floor(const LegPlace& place, const LegShape& shape, ReliefHere& relief) const {
    Interval height = relief.on_floor(place.floor, shape.steepness[floor_part]);
    if (rock_.rut_depth > 0 && shape.leg.width > rut_track + 4 * rut_width) {
      const double t = (std::abs(place.side) - rut_track / 2) / rut_width;
      const double depth = rock_.rut_depth * std::exp(-t * t);
      const double change = rock_.rut_depth * rut_steepness / rut_width * relief.radius;
      height = height -
               Interval{std::max(0.0, depth - change), std::min(rock_.rut_depth, depth + change)};
    }
    return height;
  }

  Interval floor_height(const LegPlace& place, const LegShape& shape, ReliefHere& relief) const {
    const Interval dry = dry_floor(place, shape, relief);
    if (!holds_water(shape.leg)) return dry;
    return through(dry, [this](double height) { return std::max(height, water_level_); });
  }

  bool holds_water(const Leg& leg) const {
    return water_level_ > -infinity && std::hypot(leg.slope, leg.cross_slope) <= level_floor;
  }

  Parts<Interval> loose_parts(const LegDistances& d, const LegShape& shape, double radius) const {
    Parts<Interval> parts = {};
    for (int part = 0; part < part_count; ++part) {
      const double slack = radius * shape.steepness[part] + bound_of(part);
      parts[part] = {d.parts[part] - slack, d.parts[part] + slack};
    }
    return parts;
  }

  /// Bounds of a leg without any relief.
  Interval loose(const LegDistances& d, const LegShape& shape, double radius) const {
    Interval result = united(loose_parts(d, shape, radius));
    const double slack = radius + concrete_.bound();
    result.low = std::max(result.low, d.concrete - slack);
    result.high = std::max(result.high, d.concrete + slack);
    return result;
  }

  /// The open space is within all parts.
  Interval united(const Parts<Interval>& parts) const {
    Parts<double> low = {};
    Parts<double> high = {};
    for (int part = 0; part < part_count; ++part) {
      low[part] = parts[part].low;
      high[part] = parts[part].high;
    }
    return {rounded_max(low, rock_.corner_radius), rounded_max(high, rock_.corner_radius)};
  }

  /// Whether a part's exact interval could change `united`.
  bool matters(const Parts<Interval>& parts, int part) const {
    if (parts[part].high > -rock_.corner_radius) return true;
    for (int other = 0; other < part_count; ++other)
      if (other != part && parts[part].high <= parts[other].low) return false;
    return true;
  }

  std::uint8_t material_of(const Parts<Interval>& parts, const LegPlace& place,
                           const LegShape& shape, ReliefHere& relief) const {
    if (relief.radius > 0) return sandstone;
    const bool is_floor = parts[floor_part].low > std::max(parts[wall].low, parts[ceiling].low);
    if (is_floor)
      return holds_water(shape.leg) && dry_floor(place, shape, relief).low < water_level_ ? water
                                                                                          : gravel;
    if (is_wet(relief.place)) return wet_sandstone;
    return parts[ceiling].low > parts[wall].low ? bedded_sandstone : sandstone;
  }

  bool is_wet(const Eigen::Vector3d& p) const {
    return wet_level_ < infinity && wet_.at(p) > wet_level_;
  }

  /// Rock in the open space.
  void add_pillar(const PillarShape& pillar, const Eigen::Vector3d& p, double radius,
                  ReliefHere& relief, Value& result) const {
    const double depth = pillar.depth(p);
    // Relief is evaluated only where it could change the result.
    const double highest = depth + radius + wall_bound();
    if (highest <= -rock_.corner_radius && highest <= result.interval.low) return;
    const Interval rock = Interval{depth - radius, depth + radius} - relief[wall_relief];
    if (rock.low > result.interval.low) {
      result.material = is_wet(p) ? wet_sandstone : sandstone;
      result.face = 0;
    }
    result.interval = rounded_max(result.interval, rock, rock_.corner_radius);
  }

  RockOptions rock_;
  Relief wall_;
  Relief ceiling_;
  Relief floor_;
  Relief concrete_;
  Relief weakness_;  // of the rock: where it comes out too easily
  Relief wet_;
  Bedding bedding_;
  LooseRocks stones_;
  double water_level_ = -infinity;
  double wet_level_ = infinity;
  bool half_casts_ = false;
  LegIndex index_;
  std::vector<LegShape> shapes_;
  std::vector<PillarShape> pillars_;
};

// A person's eyes, metres above the floor, and where they stand: a little into the drift
// (assumed).
constexpr double eye_height = 1.7;
constexpr double eye_part = 0.2;
constexpr double eye_farthest = 15;

Pose view_of(const CentreLine& line) {
  const double at = std::min(eye_part * length_of(line), eye_farthest);
  return Pose(frame_on(line, at) *
              Eigen::Translation3d(0, 0, std::min(eye_height, line.height / 2)));
}

}  // namespace

Mine with_names(Mine mine, const Settings& given) {
  add_named_parts(mine.drifts, "drifts.", given);
  add_named_parts(mine.pillars, "pillars.", given);
  add_named_parts(mine.things, "things.", given);
  return mine;
}

ImplicitSurface surface_of(const Mine& mine, std::uint64_t seed, double edge_length) {
  const auto field = std::make_shared<const MineField>(mine, seed, 2 * edge_length);
  ImplicitSurface surface;
  surface.materials = field->materials();
  surface.at = [field](const Eigen::Vector3d& p) {
    const MineField::Value value = field->value(p, 0);
    return ImplicitSurface::Sample{value.interval.low, value.material, value.face};
  };
  surface.range = [field](const Eigen::Vector3d& centre, double radius) {
    return field->value(centre, radius).interval;
  };
  for (const Leg& leg : field->legs()) {
    surface.area += 2 * (leg.width + leg.height) * leg.length;
    if (!leg.bend_from) surface.area += leg.width * leg.height;
    if (!leg.bend_to) surface.area += leg.width * leg.height;
    for (const double s : {0.0, leg.length}) {
      const Eigen::Vector2d place = leg.from + s * leg.direction;
      const double floor = leg.floor + s * leg.slope;
      // Half a width to all sides covers the section for any heading.
      const Eigen::Vector2d reach = Eigen::Vector2d::Constant(leg.width / 2);
      const Eigen::Vector2d low = place - reach, high = place + reach;
      const double tilt = std::abs(leg.cross_slope) * leg.width / 2;
      surface.bounds.extend(Eigen::Vector3d(low.x(), low.y(), floor - tilt));
      surface.bounds.extend(Eigen::Vector3d(high.x(), high.y(), floor + leg.height + tilt));
    }
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(field->margin());
  surface.bounds.min() -= margin;
  surface.bounds.max() += margin;
  return surface;
}

Scene scene_of(const std::string& name, const Mine& mine, const MeshOptions& mesh,
               std::uint64_t seed) {
  Scene scene{.name = name, .mesh = mesh, .centre_lines = centre_lines(mine)};
  scene.T_world_view = view_of(*std::max_element(
      scene.centre_lines.begin(), scene.centre_lines.end(),
      [](const CentreLine& a, const CentreLine& b) { return length_of(a) < length_of(b); }));
  const auto shared = std::make_shared<const Mine>(mine);
  scene.surface = [shared, seed](double edge_length) {
    return surface_of(*shared, seed, edge_length);
  };
  if (mine.furnished && !mine.things.empty()) {
    std::vector<ThingRun> runs;
    for (const auto& [unused, run] : mine.things) runs.push_back(run);
    // Where the rock has a step, triangles cut its corner by a part of an edge.
    const double clearance = 0.02 + mesh.edge_length / 2;
    scene.things = [runs, lines = scene.centre_lines,
                    rock = surface_of(mine, seed, mesh.edge_length),
                    clearance](const Eigen::AlignedBox2d& region) {
      return things_in(runs, lines, rock, clearance, region);
    };
  }
  return scene;
}

}  // namespace minescan
