// SPDX-License-Identifier: MIT
#include "scenes/things.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "core/parallel.h"
#include "scenes/contour.h"
#include "scenes/half_edge.h"
#include "scenes/materials.h"
#include "scenes/shapes.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double width = 10;
constexpr double height = 6;
constexpr double clearance = 0.05;
constexpr double reach = 1e4;
const Eigen::AlignedBox2d everywhere(Eigen::Vector2d(-reach, -reach),
                                     Eigen::Vector2d(reach, reach));

/// A room around a straight line at floor level, with waves of `relief` metres and 2.5 m length in
/// all faces.
struct Room {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double relief = 0;

  double at(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d d = (to - from).head<2>();
    const Eigen::Vector2d along = d.normalized();
    const Eigen::Vector2d q = (p - from).head<2>();
    const double u = q.dot(along);
    const double v = along.x() * q.y() - along.y() * q.x();
    const double z = p.z() - from.z() - u / d.norm() * (to - from).z();
    const double k = 2 * pi / 2.5;
    const double side = relief * std::sin(k * u) * std::cos(k * z);
    const double up = relief * std::sin(k * u + 1) * std::cos(k * v);
    const double end = relief * std::sin(k * v);
    return std::max(
        {std::abs(v) - width / 2 - side, z - height - up, -z - up, -u - end, u - d.norm() - end});
  }
  /// No value changes faster than this over distance: a distance, the slope of the floor, the waves
  /// along two axes.
  double steepest() const {
    const double slope = (to - from).z() / (to - from).head<2>().norm();
    return std::hypot(1, slope) * (1 + std::sqrt(2) * 2 * pi / 2.5 * relief);
  }
};

/// All that is in one of the rooms.
ImplicitSurface open_in(const std::vector<Room>& rooms) {
  ImplicitSurface surface;
  double steepest = 0;
  for (const Room& room : rooms) {
    steepest = std::max(steepest, room.steepest());
    for (const Eigen::Vector3d& p : {room.from, room.to})
      surface.bounds.extend(p - Eigen::Vector3d(width, width, 1))
          .extend(p + Eigen::Vector3d(width, width, height + 1));
    surface.area += 2 * (width + height) * (room.to - room.from).norm();
  }
  surface.at = [=](const Eigen::Vector3d& p) {
    double value = std::numeric_limits<double>::infinity();
    for (const Room& room : rooms) value = std::min(value, room.at(p));
    return ImplicitSurface::Sample{.value = value};
  };
  surface.range = [at = surface.at, steepest](const Eigen::Vector3d& p, double radius) {
    const double value = at(p).value;
    return Interval{value - steepest * radius, value + steepest * radius};
  };
  surface.materials = mine_materials();
  return surface;
}

CentreLine straight(const Eigen::Vector3d& to = {60, 0, 0}) {
  return {.drift = "main", .points = {{0, 0, 0}, to}, .width = width, .height = height};
}

ImplicitSurface room(double relief, const Eigen::Vector3d& to = {60, 0, 0}) {
  return open_in({{.from = {0, 0, 0}, .to = to, .relief = relief}});
}

/// A drift that turns by `angle` to the left after 30 m, and its rock: all within half a width of
/// the line, with waves as above.
std::pair<CentreLine, ImplicitSurface> bent(double angle, double relief) {
  CentreLine line = straight();
  const Eigen::Vector3d bend(30, 0, 1);
  line.points = {{0, 0, 0}, bend, bend + 30 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)};
  ImplicitSurface surface = open_in({{.from = line.points[0], .to = line.points[1]},
                                     {.from = line.points[1], .to = line.points[2]}});
  surface.at = [line, relief](const Eigen::Vector3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    double floor = 0;
    for (std::size_t i = 1; i < line.points.size(); ++i) {
      const Eigen::Vector3d &a = line.points[i - 1], &b = line.points[i];
      const Eigen::Vector2d d = (b - a).head<2>();
      const double t = std::clamp((p - a).head<2>().dot(d) / d.squaredNorm(), 0.0, 1.0);
      const double distance = (p - a - t * (b - a)).head<2>().norm();
      if (distance < nearest) floor = (a + t * (b - a)).z();
      nearest = std::min(nearest, distance);
    }
    const double k = 2 * pi / 2.5;
    const double side = relief * std::sin(k * (p.x() + p.y())) * std::cos(k * p.z());
    const double up = relief * std::sin(k * p.x() + 1) * std::cos(k * p.y());
    return ImplicitSurface::Sample{.value =
                                       std::max({nearest - width / 2 - side,
                                                 p.z() - floor - height - up, floor - p.z() - up})};
  };
  // The floor's slope, and waves along three axes.
  const double steepest = std::hypot(1, 1.0 / 30) * (1 + 2 * pi / 2.5 * relief * std::sqrt(3));
  surface.range = [at = surface.at, steepest](const Eigen::Vector3d& p, double radius) {
    const double value = at(p).value;
    return Interval{value - steepest * radius, value + steepest * radius};
  };
  return {line, surface};
}

/// A run of one kind that fits the rooms.
ThingRun run_of(const std::string& kind, Side side = Side::left) {
  ThingRun run{.kind = kind, .drift = "main", .from = 3, .side = side};
  if (kind == "duct") run.offset = 2;
  if (kind == "vehicle")
    run = {.kind = kind, .drift = "main", .from = 8, .every = 10, .side = side};
  return run;
}

/// Runs of all kinds, on both sides where they are on walls; no two of them meet.
std::vector<ThingRun> all_runs() {
  std::vector<ThingRun> runs;
  for (const ThingKind& kind : thing_kinds()) {
    runs.push_back(run_of(kind.name));
    if (kind.name == "cable" || kind.name == "pipe") runs.push_back(run_of(kind.name, Side::right));
  }
  runs.push_back(run_of("sign", Side::right));
  runs.back().height = 3;
  // Bolts are 0.75 and 2.25 m from the line: the duct fits between. Signs hang on the line as
  // lights do, elsewhere.
  for (ThingRun& run : runs) {
    if (run.kind == "duct") run.offset = 1.5;
    if (run.kind == "sign") run.from = 5;
  }
  return runs;
}

TriangleMesh things(const std::vector<ThingRun>& runs, const CentreLine& line,
                    const ImplicitSurface& rock) {
  return things_in(runs, {line}, rock, clearance, everywhere);
}

std::size_t count(const std::vector<ThingRun>& runs, const CentreLine& line,
                  const ImplicitSurface& rock) {
  return check_mesh(things(runs, line, rock)).components;
}

/// The value nearest to rock over all triangles, sampled 5 cm apart.
double highest_value(const TriangleMesh& mesh, const ImplicitSurface& rock) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const auto& triangle : mesh.triangles) {
    const auto [a, b, c] = corners(mesh, triangle);
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int steps = static_cast<int>(std::ceil(longest / 0.05));
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j) {
        const Eigen::Vector3d p = a + (b - a) * i / steps + (c - a) * j / steps;
        highest = std::max(highest, rock.at(p).value);
      }
  }
  return highest;
}

void expect_closed_and_clear(const TriangleMesh& mesh, const ImplicitSurface& rock) {
  ASSERT_FALSE(mesh.triangles.empty());
  EXPECT_EQ(mesh.material.size(), mesh.triangles.size());
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.euler_characteristic, 2 * static_cast<std::ptrdiff_t>(check.components));
  EXPECT_LT(measures(mesh).volume, 0);  // solid
  EXPECT_LT(highest_value(mesh, rock), -clearance / 2);
}

std::string message_of(const std::vector<ThingRun>& runs, const CentreLine& line = straight()) {
  try {
    things(runs, line, room(0));
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

TEST(FrameOn, LiesOnTheLineWithItsAxesLevel) {
  const CentreLine line{.drift = "ramp", .points = {{1, 2, 3}, {1, 6, 6}, {9, 6, 0}}};
  EXPECT_NEAR(length_of(line), 15, 1e-12);
  const Eigen::Isometry3d on_first = frame_on(line, 2.5);
  EXPECT_TRUE(on_first.translation().isApprox(Eigen::Vector3d(1, 4, 4.5), 1e-12));
  Eigen::Matrix3d axes;
  axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_TRUE(on_first.linear().isApprox(axes, 1e-12));
  // The bend belongs to the leg that begins there.
  EXPECT_TRUE(frame_on(line, 5).linear().isApprox(Eigen::Matrix3d::Identity(), 1e-12));
  EXPECT_TRUE(frame_on(line, 5 - 1e-9).linear().isApprox(axes, 1e-12));
}

TEST(FrameOn, HoldsPlacesWithinTheLine) {
  EXPECT_EQ(frame_on(straight(), -7).translation(), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(frame_on(straight(), 70).translation(), Eigen::Vector3d(60, 0, 0));
}

TEST(FrameOn, RefusesWhatIsNoLine) {
  const double nan = std::nan("");
  EXPECT_THROW(frame_on(straight(), nan), std::invalid_argument);
  for (const std::vector<Eigen::Vector3d>& points : {std::vector<Eigen::Vector3d>{},
                                                     {{0, 0, 0}},
                                                     {{0, 0, 0}, {0, 0, 0}},
                                                     {{0, 0, 0}, {0, 0, 5}},
                                                     {{0, 0, 0}, {1, nan, 0}}}) {
    CentreLine line = straight();
    line.points = points;
    EXPECT_THROW(length_of(line), std::invalid_argument);
    EXPECT_THROW(frame_on(line, 0), std::invalid_argument);
  }
  for (const double bad : {0.0, -1.0, nan}) {
    CentreLine line = straight();
    line.width = bad;
    EXPECT_THROW(length_of(line), std::invalid_argument);
    line = straight();
    line.height = bad;
    EXPECT_THROW(length_of(line), std::invalid_argument);
  }
}

TEST(ThingKinds, AreClosedAndClearOfFlatAndRoughAndSlopingRock) {
  for (const ThingKind& kind : thing_kinds()) {
    for (const double relief : {0.0, 0.15}) {
      for (const Side side : {Side::left, Side::right}) {
        SCOPED_TRACE(kind.name + ", relief " + std::to_string(relief));
        const ThingRun run = run_of(kind.name, side);
        expect_closed_and_clear(things({run}, straight(), room(relief)), room(relief));
        const Eigen::Vector3d up(60, 10, 7);
        expect_closed_and_clear(things({run}, straight(up), room(relief, up)), room(relief, up));
      }
    }
  }
}

TEST(ThingKinds, DescribeThemselvesAndAreFoundByName) {
  for (const ThingKind& kind : thing_kinds()) {
    EXPECT_EQ(&find_thing_kind(kind.name), &kind);
    EXPECT_FALSE(kind.description.empty());
    EXPECT_GE(kind.every, kind.least);
    EXPECT_GT(kind.least, 0);
    EXPECT_GE(kind.height, 0);
  }
}

// Every place of a run in a room without obstacles has its thing; a row of bolts is as wide as the
// drift allows, a vehicle has nine parts.
TEST(ThingsIn, PutsOneAtEveryPlace) {
  for (const double relief : {0.0, 0.15}) {
    const ImplicitSurface rock = room(relief);
    const auto placed = [&](const std::string& kind, double from, double to, double every) {
      ThingRun run = run_of(kind);
      run.from = from, run.to = to, run.every = every;
      return count({run}, straight(), rock);
    };
    EXPECT_EQ(placed("light", 3, 57, 0), 10U);    // usually every 6 m
    EXPECT_EQ(placed("light", 3, 57, 2.7), 21U);  // (57 - 3) / 2.7 = 20
    EXPECT_EQ(placed("light", 3, 56.9, 2.7), 20U);
    EXPECT_EQ(placed("bolts", 3, 57, 0), 37U * 6);  // +-0.75, +-2.25 and +-3.75 m
    EXPECT_EQ(placed("sign", 3, 57, 0), 2U);
    EXPECT_EQ(placed("vehicle", 8, 50, 9), 5U * 9);
    // Lengths up to `to`; the last one is what is left.
    EXPECT_EQ(placed("cable", 1, 59, 0), 20U);
    EXPECT_EQ(placed("pipe", 1, 59, 0), 10U);
    EXPECT_EQ(placed("duct", 1, 59, 0), 6U);
    EXPECT_EQ(placed("pipe", 1, 7.2, 0), 1U);  // 0.2 m are none
    EXPECT_EQ(placed("light", 30, 30, 0), 1U);
  }
}

TEST(ThingsIn, GoesToTheEndOfTheDriftIfNotToldOtherwise) {
  ThingRun run = run_of("light");
  run.every = 10;
  EXPECT_EQ(count({run}, straight(), room(0)), 6U);  // 3, 13, ... 53
  run.to = 43;
  EXPECT_EQ(count({run}, straight(), room(0)), 5U);
}

// Where a thing may end up beyond its clearance: 1 cm at once, and for samples that are as far from
// rock as the longest side of their cells, up to 2.5 cm in steps of 2.
constexpr double loose = 0.06;

TEST(ThingsIn, HangOrStandCloseToFlatRock) {
  const auto box_of = [&](const ThingRun& run) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3f& v : things({run}, straight(), room(0)).vertices)
      box.extend(v.cast<double>());
    return box;
  };
  const auto expect_gap = [&](double gap) {
    EXPECT_GE(gap, clearance);
    EXPECT_LE(gap, clearance + loose);
  };
  ThingRun run{.kind = "light", .drift = "main", .from = 20, .to = 20, .offset = 3};
  expect_gap(height - box_of(run).max().z());
  EXPECT_NEAR(box_of(run).center().x(), 20, 1e-5);
  EXPECT_NEAR(box_of(run).center().y(), 3, 1e-5);
  EXPECT_TRUE(box_of(run).sizes().isApprox(Eigen::Vector3d(1.5, 0.3, 0.3), 1e-5));
  run.side = Side::right;
  EXPECT_NEAR(box_of(run).center().y(), -3, 1e-5);

  run.kind = "bolts";
  expect_gap(height - box_of(run).max().z());
  EXPECT_NEAR(box_of(run).sizes().z(), 0.1, 1e-5);

  run.kind = "vehicle";
  expect_gap(box_of(run).min().z());
  EXPECT_TRUE(box_of(run).sizes().isApprox(Eigen::Vector3d(8, 2.5, 2.4), 1e-5));

  run.kind = "sign";
  expect_gap(height - box_of(run).max().z());
  EXPECT_TRUE(box_of(run).sizes().isApprox(Eigen::Vector3d(0.02, 0.6, 0.4), 1e-5));
  run.height = 2;
  expect_gap(box_of(run).min().y() + width / 2);
  EXPECT_NEAR(box_of(run).center().z(), 2, 1e-5);
  EXPECT_TRUE(box_of(run).sizes().isApprox(Eigen::Vector3d(0.6, 0.02, 0.4), 1e-5));

  run = {.kind = "pipe", .drift = "main", .from = 20, .to = 26, .height = 2};
  expect_gap(width / 2 - box_of(run).max().y());
  EXPECT_NEAR(box_of(run).center().z(), 2, 1e-5);
  EXPECT_NEAR(box_of(run).min().x(), 20, 0.1);
  EXPECT_NEAR(box_of(run).max().x(), 26, 0.1);

  run = {.kind = "cable", .drift = "main", .from = 20, .to = 23, .side = Side::right, .height = 2};
  expect_gap(box_of(run).min().y() + width / 2);
  // 2.96 m of cable, 5 % of it lower in its middle; the radius is 3 cm.
  EXPECT_NEAR(box_of(run).max().z(), 2 + 0.03, 0.005);
  EXPECT_NEAR(box_of(run).min().z(), 2 - 0.05 * 2.96 - 0.03, 0.005);

  run = {.kind = "duct", .drift = "main", .from = 20, .to = 30, .offset = 2};
  expect_gap(height - box_of(run).max().z());
  EXPECT_NEAR(box_of(run).center().y(), 2, 1e-5);
}

TEST(ThingsIn, JoinsARoughRoomWithoutCrossingIt) {
  for (const double relief : {0.0, 0.15}) {
    const ImplicitSurface rock = room(relief, {30, 0, 0});
    TriangleMesh mesh = contour(rock, 0.1);
    const TriangleMesh more = things(all_runs(), straight({30, 0, 0}), rock);
    expect_closed_and_clear(more, rock);
    append(mesh, more);
    EXPECT_EQ(check_mesh(mesh).self_intersections, 0U);
    EXPECT_TRUE(check_mesh(mesh).valid());
    ASSERT_EQ(more.materials.size(), mesh.materials.size());
  }
}

TEST(ThingsIn, GoAroundBendsAndDoNotMeetThere) {
  for (const double angle : {-0.5, 0.1, pi / 2}) {
    for (const double relief : {0.0, 0.1}) {
      SCOPED_TRACE("turn " + std::to_string(angle) + ", relief " + std::to_string(relief));
      const auto [line, rock] = bent(angle, relief);
      const TriangleMesh mesh = things(all_runs(), line, rock);
      expect_closed_and_clear(mesh, rock);
      // A length around the bend is there in one piece on both walls, up to both its ends.
      for (const Side side : {Side::left, Side::right}) {
        ThingRun run{
            .kind = "pipe", .drift = "main", .from = 22, .to = 38, .every = 20, .side = side};
        const TriangleMesh pipe = things({run}, line, rock);
        EXPECT_EQ(check_mesh(pipe).components, 1U);
        for (const double end : {run.from, run.to}) {
          const Eigen::Isometry3d T_world_line = frame_on(line, end);
          double nearest = reach;
          for (const Eigen::Vector3f& v : pipe.vertices)
            nearest = std::min(nearest, std::abs((T_world_line.inverse() * v.cast<double>()).x()));
          EXPECT_LT(nearest, 0.03);  // the gap is 2 cm
        }
      }
    }
  }
}

// On the inside of a right angle the places of both legs would be the same.
TEST(ThingsIn, KeepToTheirSideOfABend) {
  const auto [line, rock] = bent(pi / 2, 0);
  ThingRun run{.kind = "light", .drift = "main", .from = 26, .every = 2, .offset = 4};
  run.to = 34;
  EXPECT_EQ(count({run}, line, rock), 0U);
  run.side = Side::right;  // and on the outside there is room for all but the one across the bend
  EXPECT_EQ(count({run}, line, rock), 5U);
  run.offset = 0;
  EXPECT_EQ(count({run}, line, rock), 4U);
}

TEST(ThingsIn, LeaveOutTheMouthOfASidePassage) {
  const CentreLine line = straight();
  // Open from 25 to 35 m.
  const ImplicitSurface rock =
      open_in({{.from = {0, 0, 0}, .to = {60, 0, 0}}, {.from = {30, 0, 0}, .to = {30, 20, 0}}});
  ThingRun run{.kind = "pipe", .drift = "main", .from = 1};
  EXPECT_EQ(count({run}, line, rock), 10U - 2);  // 19 - 25 is there; 25 - 31 and 31 - 37 not
  run.side = Side::right;
  EXPECT_EQ(count({run}, line, rock), 10U);
  run = {.kind = "sign", .drift = "main", .from = 20, .every = 4, .height = 2};
  run.to = 40;
  EXPECT_EQ(count({run}, line, rock), 4U);  // not at 28 and 32 m
}

TEST(ThingsIn, LeaveOutWhatHasNoPlace) {
  CentreLine line = straight();
  // Within half a light or vehicle of the drift's end.
  EXPECT_EQ(count({{.kind = "light", .drift = "main", .to = 2, .every = 2}}, line, room(0)), 1U);
  // No drift at all: where the line is in rock, or its ceiling is far too high.
  line.points = {{0, 100, 0}, {60, 100, 0}};
  EXPECT_TRUE(things(all_runs(), line, room(0)).triangles.empty());
  line = straight();
  line.height = 3;
  EXPECT_EQ(count({run_of("light")}, line, room(0)), 0U);
}

TEST(ThingsIn, SplitsAmongRegionsWithoutOverlapOrGap) {
  const auto [line, rock] = bent(0.8, 0.1);
  const TriangleMesh all = things(all_runs(), line, rock);
  // Of the places on the line some lie on the border: at x = 15 m.
  const double x = 15, y = 4;
  using Key = std::tuple<float, float, float>;
  const auto keys_of = [](const TriangleMesh& mesh) {
    std::vector<Key> keys;
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle)
        keys.emplace_back(mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z());
    return keys;
  };
  std::vector<Key> parts;
  std::size_t regions_used = 0;
  for (const auto& [x0, x1] : {std::pair{-reach, x}, std::pair{x, reach}})
    for (const auto& [y0, y1] : {std::pair{-reach, y}, std::pair{y, reach}}) {
      const Eigen::AlignedBox2d region(Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1));
      const TriangleMesh mesh = things_in(all_runs(), {line}, rock, clearance, region);
      const std::vector<Key> keys = keys_of(mesh);
      regions_used += keys.empty() ? 0 : 1;
      parts.insert(parts.end(), keys.begin(), keys.end());
    }
  std::vector<Key> expected = keys_of(all);
  std::ranges::sort(parts);
  std::ranges::sort(expected);
  EXPECT_EQ(regions_used, 3U);
  EXPECT_TRUE(parts == expected);
}

TEST(ThingsIn, CountsAPlaceOnABorderOnce) {
  const ThingRun run{.kind = "light", .drift = "main", .from = 5, .to = 55, .every = 5};
  const auto within = [&](double low, double high) {
    const Eigen::AlignedBox2d region(Eigen::Vector2d(low, -1), Eigen::Vector2d(high, 1));
    return check_mesh(things_in({run}, {straight()}, room(0), clearance, region)).components;
  };
  EXPECT_EQ(within(10, 20), 2U);
  EXPECT_EQ(within(20, 30), 2U);
  EXPECT_EQ(within(30, 30), 0U);
}

TEST(ThingsIn, GivesTheSameBytesForAnyNumberOfThreads) {
  const auto [line, rock] = bent(0.8, 0.1);
  TriangleMesh one;
  {
    const ThreadLimit limit(1);
    one = things(all_runs(), line, rock);
  }
  const ThreadLimit limit(4);
  EXPECT_TRUE(same_bytes(one, things(all_runs(), line, rock)));
}

TEST(ThingsIn, FollowsTheOrderOfTheRuns) {
  const ThingRun light = run_of("light"), sign{.kind = "sign", .drift = "main", .from = 20};
  TriangleMesh both = things({light}, straight(), room(0));
  append(both, things({sign}, straight(), room(0)));
  EXPECT_TRUE(same_bytes(both, things({light, sign}, straight(), room(0))));
}

TEST(ThingsIn, AsksFewQuestionsPerBolt) {
  ImplicitSurface rock = room(0.15);
  std::atomic<std::size_t> calls = 0;
  rock.at = [&calls, at = rock.at](const Eigen::Vector3d& p) {
    ++calls;
    return at(p);
  };
  rock.range = [&calls, range = rock.range](const Eigen::Vector3d& p, double radius) {
    ++calls;
    return range(p, radius);
  };
  const std::size_t bolts = count({run_of("bolts")}, straight(), rock);
  ASSERT_GT(bolts, 200U);
  RecordProperty("calls_per_bolt", static_cast<int>(calls / bolts));

  EXPECT_LT(calls, 150 * bolts);
}

// Ranges may be wider than the values; that costs time and nothing else.
TEST(ThingsIn, WorksWithRangesThatTellNothing) {
  const ImplicitSurface rock = room(0.15);
  ImplicitSurface silent = rock;
  silent.range = [](const Eigen::Vector3d&, double) { return Interval{-100, 100}; };
  for (const std::string kind : {"light", "pipe", "sign"}) {
    const ThingRun run{.kind = kind, .drift = "main", .from = 20, .to = 24};
    const TriangleMesh mesh = things({run}, straight(), silent);
    expect_closed_and_clear(mesh, rock);
  }
}

TEST(ThingsIn, MakesNothingOfNothing) {
  const TriangleMesh none = things({}, straight(), room(0));
  EXPECT_TRUE(none.triangles.empty());
  EXPECT_EQ(none.materials.size(), mine_materials().size());
  EXPECT_TRUE(things_in({run_of("light")}, {straight()}, room(0), clearance, Eigen::AlignedBox2d())
                  .triangles.empty());
}

TEST(ThingsIn, RefusesRunsThatDoNotFitAndSaysWhy) {
  const auto expect = [](const ThingRun& bad, const std::vector<std::string>& words) {
    const std::string message = message_of({run_of("light"), bad});
    EXPECT_EQ(message.substr(0, 6), "run 1 ") << message;
    for (const std::string& word : words)
      EXPECT_NE(message.find(word), std::string::npos) << message << "; expected " << word;
  };
  ThingRun run = run_of("light");
  run.kind = "lamp";
  expect(run, {"lamp", "light", "bolts", "cable", "pipe", "duct", "sign", "vehicle"});
  run = run_of("light");
  run.drift = "other";
  expect(run, {"unknown drift 'other'", "main"});
  run = run_of("light");
  run.from = 60.5;
  expect(run, {"from = 60.5 m", "at most", "60"});
  run.from = 3;
  run.to = 61;
  expect(run, {"to = 61 m", "at most", "60"});
  run.from = 20;
  run.to = 19;
  expect(run, {"to = 19 m", "at least from = 20"});
  run = run_of("light");
  run.every = 1;
  expect(run, {"every = 1 m", "at least 1.6"});
  run = run_of("light");
  run.offset = 5;
  expect(run, {"offset = 5 m", "less than half the drift's width, 5"});
  run = run_of("pipe");
  run.height = 6;
  expect(run, {"height = 6 m", "less than the drift's height, 6"});

  const double nan = std::nan("");
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -1.0}) {
    for (double ThingRun::*member :
         {&ThingRun::from, &ThingRun::to, &ThingRun::every, &ThingRun::offset, &ThingRun::height}) {
      run = run_of("sign");
      run.*member = bad;
      expect(run, {"expected a number"});
    }
    EXPECT_THROW(things_in({}, {}, room(0), bad, everywhere), std::invalid_argument);
  }
}

TEST(ThingsIn, RefusesACentreLineThatIsNone) {
  CentreLine line = straight();
  line.points.pop_back();
  EXPECT_NE(message_of({run_of("light")}, line).find("2 points or more"), std::string::npos);
}

}  // namespace
}  // namespace minescan
