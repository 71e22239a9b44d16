// SPDX-License-Identifier: MIT
#include "scenes/mine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>

#include "core/random.h"
#include "core/text.h"
#include "scenes/contour.h"
#include "scenes/materials.h"

namespace minescan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Interval operator-(const Interval& a, const Interval& b) {
  return {a.low - b.high, a.high - b.low};
}

enum Part { wall, ceiling, floor_part, end_face, part_count };

/// Distances to the parts of a drift's surface, one number or interval for each.
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

/// A drift with what is the same at all places worked out.
struct Frame {
  Eigen::Vector2d from;
  Eigen::Vector2d along;
  double length;
  Drift drift;
  double corner_radius;

  Frame(const Drift& d, double radius)
      : from(d.from),
        along((d.to - d.from).normalized()),
        length((d.to - d.from).norm()),
        drift(d),
        corner_radius(radius) {}

  /// Before displacement; negative inside.
  Parts<double> distances(const Eigen::Vector3d& p) const {
    const double dx = p.x() - from.x();
    const double dy = p.y() - from.y();
    const double u = dx * along.x() + dy * along.y();
    const double v = dy * along.x() - dx * along.y();
    Parts<double> d = {std::abs(v) - drift.width / 2, p.z() - drift.height, -p.z(), -infinity};
    const auto close = [&](End end, double distance) {
      double& part = d[end == End::rock ? wall : end_face];
      part = rounded_max(std::array{part, distance}, corner_radius);
    };
    close(drift.end_from, -u);
    close(drift.end_to, u - length);
    return d;
  }
};

class MineField {
 public:
  MineField(const Mine& mine, std::uint64_t seed, double finest)
      : fixtures_(mine.fixtures),
        corner_radius_(mine.rock.corner_radius),
        wall_(mine.rock.wall, derived_seed(seed, "wall"), finest),
        ceiling_(mine.rock.ceiling, derived_seed(seed, "ceiling"), finest),
        floor_(mine.rock.floor, derived_seed(seed, "floor"), finest),
        bedding_(mine.rock.bedding_step, mine.rock.bedding_plate, derived_seed(seed, "bedding")) {
    for (const Drift& drift : mine.drifts) frames_.emplace_back(drift, corner_radius_);
    bound_[wall] = wall_.bound();
    bound_[ceiling] = ceiling_.bound() + bedding_.bound();
    bound_[floor_part] = floor_.bound();
  }

  /// Largest displacement anywhere.
  double bound() const { return *std::max_element(bound_.begin(), bound_.end()); }

  struct Value {
    Interval interval = {};
    std::uint8_t material = sandstone;  // only meaningful for radius 0
  };

  /// The displaced field in a ball. Relief takes most of the time, so it is evaluated only where it
  /// can change the result: first all is bounded without it.
  Value value(const Eigen::Vector3d& p, double radius) const {
    double lowest_high = infinity;
    for (const Frame& frame : frames_)
      lowest_high = std::min(lowest_high, united(loose(frame.distances(p), radius)).high);

    ReliefHere relief{*this, p, radius};
    Value result = {.interval = {infinity, infinity}};
    for (const Frame& frame : frames_) {
      const Parts<double> distance = frame.distances(p);
      Parts<Interval> parts = loose(distance, radius);
      if (united(parts).low > lowest_high) continue;
      for (int part = 0; part < part_count; ++part)
        if (matters(parts, part))
          parts[part] = Interval{distance[part] - radius, distance[part] + radius} - relief[part];
      const Interval drift = united(parts);
      if (drift.low < result.interval.low) result.material = material_of(parts);
      result.interval.low = std::min(result.interval.low, drift.low);
      result.interval.high = std::min(result.interval.high, drift.high);
    }
    for (const Fixture& box : fixtures_) {
      const double above_bottom = p.z() - box.bottom;
      if (above_bottom + radius <= result.interval.low) continue;  // nothing of it is near
      const double inside = std::min(above_bottom, -distance_in_plan(box, p));
      if (inside - radius > result.interval.low) result.material = fixture;
      result.interval.low = std::max(result.interval.low, inside - radius);
      result.interval.high = std::max(result.interval.high, inside + radius);
    }
    return result;
  }

 private:
  /// Displacements at one place, each evaluated when it is first asked for.
  struct ReliefHere {
    const MineField& field;
    const Eigen::Vector3d& place;
    double radius;
    Parts<Interval> values = {};
    Parts<bool> known = {};

    const Interval& operator[](int part) {
      if (!known[part]) values[part] = field.relief(part, place, radius);
      known[part] = true;
      return values[part];
    }
  };

  Interval relief(int part, const Eigen::Vector3d& p, double radius) const {
    switch (part) {
      case wall:
        return wall_.range(p, radius);
      case ceiling: {
        const Interval rough = ceiling_.range(p, radius);
        const Interval step = bedding_.range(p, radius);
        return {rough.low + step.low, rough.high + step.high};
      }
      case floor_part:
        return floor_.range(p, radius);
      default:
        return {0, 0};
    }
  }

  Parts<Interval> loose(const Parts<double>& distance, double radius) const {
    Parts<Interval> parts = {};
    for (int part = 0; part < part_count; ++part)
      parts[part] = {distance[part] - radius - bound_[part],
                     distance[part] + radius + bound_[part]};
    return parts;
  }

  /// The open space is within all parts.
  Interval united(const Parts<Interval>& parts) const {
    Parts<double> low = {};
    Parts<double> high = {};
    for (int part = 0; part < part_count; ++part) {
      low[part] = parts[part].low;
      high[part] = parts[part].high;
    }
    return {rounded_max(low, corner_radius_), rounded_max(high, corner_radius_)};
  }

  /// Whether a part's exact interval could change `united`.
  bool matters(const Parts<Interval>& parts, int part) const {
    if (parts[part].high > -corner_radius_) return true;
    for (int other = 0; other < part_count; ++other)
      if (other != part && parts[part].high <= parts[other].low) return false;
    return true;
  }

  static std::uint8_t material_of(const Parts<Interval>& parts) {
    const double rock = std::max(parts[wall].low, parts[ceiling].low);
    if (parts[end_face].low > std::max(rock, parts[floor_part].low)) return concrete;
    return parts[floor_part].low > rock ? gravel : sandstone;
  }

  static double distance_in_plan(const Fixture& box, const Eigen::Vector3d& p) {
    const double dx = p.x() - box.centre.x();
    const double dy = p.y() - box.centre.y();
    const double u = dx * box.along.x() + dy * box.along.y();
    const double v = dy * box.along.x() - dx * box.along.y();
    return std::max(std::abs(u) - box.length / 2, std::abs(v) - box.width / 2);
  }

  std::vector<Frame> frames_;
  std::vector<Fixture> fixtures_;
  double corner_radius_;
  Relief wall_;
  Relief ceiling_;
  Relief floor_;
  Bedding bedding_;
  Parts<double> bound_ = {};
};

void check(const Mine& mine) {
  if (mine.drifts.empty()) throw std::invalid_argument("mine: expected at least one drift");
  for (const Drift& d : mine.drifts) {
    const double length = (d.to - d.from).norm();
    if (!(length > 0 && d.width > 0 && d.height > 0 && std::isfinite(length * d.width * d.height)))
      throw std::invalid_argument(
          "mine: expected a drift with length, width and height > 0, found " + number_text(length) +
          ", " + number_text(d.width) + ", " + number_text(d.height) + " m");
  }
}

}  // namespace

ImplicitSurface surface_of(const Mine& mine, std::uint64_t seed, double finest) {
  check(mine);
  const auto field = std::make_shared<const MineField>(mine, seed, finest);
  ImplicitSurface surface;
  surface.materials = mine_materials();
  surface.at = [field](const Eigen::Vector3d& p) {
    const MineField::Value value = field->value(p, 0);
    return ImplicitSurface::Sample{value.interval.low, value.material};
  };
  surface.range = [field](const Eigen::Vector3d& centre, double radius) {
    return field->value(centre, radius).interval;
  };
  for (const Drift& d : mine.drifts) {
    const double length = (d.to - d.from).norm();
    surface.area += 2 * ((d.width + d.height) * length + d.width * d.height);
    for (const Eigen::Vector2d& end : {d.from, d.to}) {
      // Half a width in all directions covers the section for any heading.
      const Eigen::Vector2d reach = Eigen::Vector2d::Constant(d.width / 2);
      const Eigen::Vector2d low = end - reach, high = end + reach;
      surface.bounds.extend(Eigen::Vector3d(low.x(), low.y(), 0));
      surface.bounds.extend(Eigen::Vector3d(high.x(), high.y(), d.height));
    }
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(field->bound());
  surface.bounds.min() -= margin;
  surface.bounds.max() += margin;
  return surface;
}

TriangleMesh mesh_of(const Mine& mine, std::uint64_t seed, double edge_length) {
  return contour(surface_of(mine, seed, 2 * edge_length), edge_length);
}

}  // namespace minescan
