// SPDX-License-Identifier: MIT
// Plans of mines measured on their meshes, as a surveyor would: by rays.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "scenes/half_edge.h"
#include "scenes/mine.h"
#include "scenes/room_and_pillar.h"
#include "scenes/scene_mesh.h"
#include "sim/raycaster.h"

namespace minescan {
namespace {

/// Metres from a place to the surface.
double distance(const RayCaster& mesh, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const std::optional<Hit> hit = mesh.cast(from, to.normalized(), 0, 1000);
  EXPECT_TRUE(hit.has_value());
  return hit ? hit->range : 0;
}

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v.cast<double>());
  return box;
}

constexpr double walking_height = 2;

/// Middle between the walls to both sides of places 1 m apart from `from` to `to`, at floor level.
/// Where the walls are more than 12 m apart there is an opening: nothing there. Means over 5 m:
/// the walls' relief is not the way's.
std::vector<Eigen::Vector2d> middles(const RayCaster& mesh, const Eigen::Vector2d& from,
                                     const Eigen::Vector2d& to) {
  const Eigen::Vector2d ahead = (to - from).normalized();
  const Eigen::Vector3d left(-ahead.y(), ahead.x(), 0);
  const int count = static_cast<int>((to - from).norm()) + 1;
  std::vector<Eigen::Vector2d> found;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int in_sum = 0;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d place = from + i * ahead;
    const Eigen::Vector3d eye(place.x(), place.y(), walking_height);
    const double to_left = distance(mesh, eye, left), to_right = distance(mesh, eye, -left);
    if (to_left + to_right > 12) {
      sum.setZero();
      in_sum = 0;
      continue;
    }
    sum += place + (to_left - to_right) / 2 * left.head<2>();
    if (++in_sum == 5) {
      found.push_back(sum / 5);
      sum.setZero();
      in_sum = 0;
    }
  }
  return found;
}

/// Where two sides cross: straight through the last two places of one and the first two of the
/// next.
Eigen::Vector2d crossing_of(const std::vector<Eigen::Vector2d>& before,
                            const std::vector<Eigen::Vector2d>& after) {
  const Eigen::Vector2d a = before.back(), u = a - before[before.size() - 2];
  const Eigen::Vector2d b = after[0], v = after[1] - b;
  Eigen::Matrix2d directions;
  directions << u, -v;
  return a + u * directions.inverse().row(0).dot(b - a);
}

double length_of(const std::vector<Eigen::Vector2d>& line) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) sum += (line[i + 1] - line[i]).norm();
  return sum;
}

// Two tunnels, two end links and two in the middle: three pillars (paper, section 5.1; sizes as in
// presets.cpp). Each pillar is a handle of the open space.
TEST(KvarntorpLoop, HasTheSizeAndThreePillarsOfItsPlan) {
  const TriangleMesh mesh = mesh_of(
      find_scene("kvarntorp-loop").make({{"edge-length", "0.2"}, {"furnished", "false"}}, 1));
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 1U);
  EXPECT_EQ(check.euler_characteristic, 2 - 2 * 3);
  const Eigen::Vector3d size = box_of(mesh).sizes();
  EXPECT_NEAR(size.x(), 155, 5);
  EXPECT_NEAR(size.y(), 55, 5);
  // 6 m, relief and two bedding steps of 4 cm: 0.25 m at each side would be four sigma of both.
  EXPECT_NEAR(size.z(), 6.1, 0.4);

  const RayCaster rays(mesh);
  const std::vector<Eigen::Vector2d> south = middles(rays, {6, 0}, {137, 0});
  const std::vector<Eigen::Vector2d> east = middles(rays, {143, 6}, {143, 17});
  // Within both parts of the north tunnel.
  const std::vector<Eigen::Vector2d> north = middles(rays, {137, 22.5}, {6, 22.5});
  const std::vector<Eigen::Vector2d> west = middles(rays, {0, 16}, {0, 6});
  // Openings take less than half of the tunnels.
  ASSERT_GT(south.size(), 13U);
  ASSERT_GT(north.size(), 13U);
  ASSERT_GE(east.size(), 2U);
  ASSERT_GE(west.size(), 2U);

  // The way round, from corner to corner where the middles cross.
  std::vector<Eigen::Vector2d> round;
  const std::array<std::vector<Eigen::Vector2d>, 4> sides = {south, east, north, west};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto& before = sides[(i + 3) % 4];
    round.push_back(crossing_of(before, sides[i]));
    round.insert(round.end(), sides[i].begin(), sides[i].end());
  }
  round.push_back(round.front());
  EXPECT_NEAR(length_of(round), 330, 10);

  // The crews met 72 m east, with the north-eastern tunnel to the left: lines through the middles
  // of the straight legs to both sides, 40 to 76 m and 68 to 110 m.
  const double met = 72;
  const auto line_at_met = [&](double from, double to) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const Eigen::Vector2d& p : north)
      if (p.x() > from && p.x() < to) {
        ++n;
        sx += p.x() - met;
        sy += p.y();
        sxx += (p.x() - met) * (p.x() - met);
        sxy += (p.x() - met) * p.y();
      }
    EXPECT_GE(n, 4);
    return (sxx * sy - sx * sxy) / (n * sxx - sx * sx);
  };
  const double planned = (24 - 0.5 * 4 / 42) - (21 + 0.5 * 4 / 36);  // presets.cpp
  // A middle over 5 m scatters by 0.05 m: two walls' relief of 0.07 m each, halved. A line through
  // four of them reaches the crews' place with about that too; 0.07 m for two lines. Four of these.
  EXPECT_NEAR(line_at_met(76, 112) - line_at_met(40, 68), planned, 0.3);
}

// Where a flat face meets rough rock vertices lie within cells, and triangles must not cross there.
TEST(Junction, IsValidWithConcreteAtAllEnds) {
  for (const std::string edge : {"0.4", "0.2"})
    for (const std::uint64_t seed : {1, 2, 3}) {
      const MeshCheck check = check_mesh(mesh_of(find_scene("junction")
                                                     .make({{"edge-length", edge},
                                                            {"furnished", "false"},
                                                            {"drifts.main.start", "concrete"},
                                                            {"drifts.passage.end", "concrete"}},
                                                           seed)));
      EXPECT_TRUE(check.valid()) << "edge " << edge << " seed " << seed << ": "
                                 << check.self_intersections << " pairs of triangles cross";
      EXPECT_EQ(check.components, 1U);
      EXPECT_EQ(check.euler_characteristic, 2);
    }
}

RockOptions flat_rock() {
  RockOptions rock;
  rock.wall.rms = rock.ceiling.rms = 0;
  rock.floor_class = RoadClass::none;
  rock.bedding_step = rock.overbreak = rock.look_out = rock.half_cast_spacing = 0;
  rock.rock_density = rock.rut_depth = 0;
  rock.corner_radius = 0;
  return rock;
}

RoomAndPillarOptions small_grid() {
  return {.rows = 3, .columns = 4, .dead_ends = 0, .furnished = false};
}

TriangleMesh mesh_of(const Mine& mine, double edge) {
  return mesh_of(scene_of("test", mine, {.edge_length = edge}, 1));
}

/// Pieces of drift between crossings: a line has a point at each crossing and one beyond each end.
std::size_t driven_pieces(const Mine& mine) {
  std::size_t count = 0;
  for (const auto& [name, drift] : mine.drifts) count += drift.line.size() - 3;
  return count;
}

// Each ring of drifts stands around one pillar: edges - nodes + 1 of them in a plan in one piece,
// and each pillar takes 2 from the Euler characteristic of a sphere.
TEST(RoomAndPillar, LeavesThePillarsOfItsPlan) {
  RoomAndPillarOptions o = small_grid();
  for (const double gaps : {0.0, 0.5, 1.0})
    for (const std::uint64_t seed : {1, 2}) {
      if (gaps == 0 && seed == 2) continue;  // the same plan but for its jitter
      o.gaps = gaps;
      const Mine mine = room_and_pillar(o, seed);
      const std::size_t pieces = driven_pieces(mine);
      const auto rings = static_cast<std::ptrdiff_t>(pieces) - o.rows * o.columns + 1;
      if (gaps == 0) {
        EXPECT_EQ(rings, 6);  // (3 - 1) x (4 - 1)
      }
      // Around the border 10 pieces; two more reach the two crossings within it.
      if (gaps == 1) {
        EXPECT_EQ(pieces, 12U);
      }
      const MeshCheck check = check_mesh(mesh_of(mine, 0.4));
      EXPECT_TRUE(check.valid()) << "gaps " << gaps << " seed " << seed;
      // Every crossing can be reached: one open space. A crossing apart would be a piece more.
      EXPECT_EQ(check.components, 1U) << "gaps " << gaps << " seed " << seed;
      EXPECT_EQ(check.euler_characteristic, 2 - 2 * rings) << "gaps " << gaps << " seed " << seed;
    }
}

TEST(RoomAndPillar, StandsOpenAtEveryCrossing) {
  RoomAndPillarOptions o = small_grid();
  o.gaps = 1;
  o.rock = flat_rock();
  const RayCaster rays(mesh_of(room_and_pillar(o, 5), 0.4));
  for (int row = 0; row < o.rows; ++row)
    for (int column = 0; column < o.columns; ++column) {
      const Eigen::Vector3d place = crossing(o, 5, column, row);
      EXPECT_NEAR(place.x(), column * o.spacing, o.jitter);
      EXPECT_NEAR(place.y(), row * o.spacing, o.jitter);
      const Eigen::Vector3d eye = place + Eigen::Vector3d(0, 0, 2);
      // Flat but for the margin of a vertex to a lattice point, a thousandth of an edge.
      EXPECT_NEAR(distance(rays, eye, {0, 0, -1}), 2, 1e-3) << column << ", " << row;
      EXPECT_NEAR(distance(rays, eye, {0, 0, 1}), o.height - 2, 1e-3) << column << ", " << row;
    }
}

TEST(RoomAndPillar, HasDeadEndsAllAroundOrNone) {
  RoomAndPillarOptions o = small_grid();
  o.gaps = 0;
  o.jitter = 0;
  o.rock = flat_rock();
  for (const double dead_ends : {0.0, 1.0}) {
    o.dead_ends = dead_ends;
    const RayCaster rays(mesh_of(room_and_pillar(o, 2), 0.4));
    const double expected = dead_ends == 0 ? o.width / 2 : 0.8 * o.spacing;
    const auto look = [&](int column, int row, const Eigen::Vector3d& out) {
      const Eigen::Vector3d eye = crossing(o, 2, column, row) + Eigen::Vector3d(0, 0, 2);
      EXPECT_NEAR(distance(rays, eye, out), expected, 1e-3)
          << "crossing " << column << ", " << row << " dead ends " << dead_ends;
    };
    for (int row = 0; row < o.rows; ++row) {
      look(0, row, {-1, 0, 0});
      look(o.columns - 1, row, {1, 0, 0});
    }
    for (int column = 0; column < o.columns; ++column) {
      look(column, 0, {0, -1, 0});
      look(column, o.rows - 1, {0, 1, 0});
    }
  }
  // In between some of 14: binomial with p = 0.5, outside of 2 ... 12 once in 500.
  o.dead_ends = 0.5;
  int ends = 0;
  const Mine mine = room_and_pillar(o, 2);
  for (const auto& [name, drift] : mine.drifts) {
    if ((drift.line[1] - drift.line[0]).norm() > o.width) ++ends;
    if ((drift.line.back() - drift.line[drift.line.size() - 2]).norm() > o.width) ++ends;
  }
  EXPECT_GE(ends, 2);
  EXPECT_LE(ends, 12);
}

TEST(RoomAndPillar, DiffersBetweenSeeds) {
  RoomAndPillarOptions o = small_grid();
  o.gaps = 0.5;
  o.jitter = 0;  // which pieces are driven, not where crossings lie
  std::set<std::vector<std::vector<double>>> plans;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    std::vector<std::vector<double>> plan;
    for (const auto& [name, drift] : room_and_pillar(o, seed).drifts) {
      std::vector<double> numbers;
      for (const Eigen::Vector3d& p : drift.line) numbers.insert(numbers.end(), {p.x(), p.y()});
      plan.push_back(numbers);
    }
    plans.insert(plan);
  }
  // 7 pieces may be missing: about 100 plans. Of 20 draws two or three are seen before.
  EXPECT_GE(plans.size(), 12U);
}

// Along the middles of the drifts: a drift is level across, so a column's floor follows the slope
// from one row to the next only in its middle, and rows step by up to half a width's rise where
// they enter crossings.
TEST(RoomAndPillar, DipsAlongX) {
  RoomAndPillarOptions o = small_grid();
  o.gaps = 0;
  o.dip = 0.1;
  o.rock = flat_rock();
  for (const double jitter : {0.0, 0.5}) {
    o.jitter = jitter;
    const RayCaster rays(mesh_of(room_and_pillar(o, 3), 0.2));
    const auto expect_floor = [&](const Eigen::Vector3d& place) {
      EXPECT_NEAR(place.z(), o.dip * place.x(), 1e-9);
      const double floor =
          place.z() + 2 - distance(rays, place + Eigen::Vector3d(0, 0, 2), {0, 0, -1});
      // Sloping faces are interpolated exactly; the margin moves some vertices by 1e-3 of an edge.
      EXPECT_NEAR(floor, o.dip * place.x(), 3e-4) << place.transpose();
    };
    for (int row = 0; row < o.rows; ++row)
      for (int column = 0; column < o.columns; ++column) {
        const Eigen::Vector3d here = crossing(o, 3, column, row);
        for (const double t : {0.35, 0.5, 0.65}) {
          if (column + 1 < o.columns)
            expect_floor((1 - t) * here + t * crossing(o, 3, column + 1, row));
          if (row + 1 < o.rows) expect_floor((1 - t) * here + t * crossing(o, 3, column, row + 1));
        }
      }
  }
}

}  // namespace
}  // namespace minescan
