// SPDX-License-Identifier: MIT
// Mines as data: what a sheet of drifts means, and which sheets are refused.
#include "scenes/mine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "core/random.h"
#include "scenes/half_edge.h"
#include "scenes/materials.h"
#include "scenes/room_and_pillar.h"
#include "scenes/scene_mesh.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

const RockOptions flat_rock = {.wall = {.rms = 0},
                               .ceiling = {.rms = 0},
                               .floor_class = RoadClass::none,
                               .bedding_step = 0,
                               .overbreak = 0,
                               .look_out = 0,
                               .half_cast_spacing = 0,
                               .rock_density = 0,
                               .rut_depth = 0,
                               .corner_radius = 0};

/// A mine of flat faces, so that places are known exactly.
Mine flat_mine() {
  Mine mine;
  mine.rock = flat_rock;
  return mine;
}

Mine one_drift(const Drift& drift) {
  Mine mine = flat_mine();
  mine.drifts["a"] = drift;
  return mine;
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing thrown";
}

std::string refusal(const Mine& mine) {
  return message_of([&] { surface_of(mine, 1, 0.1); });
}

bool open_at(const ImplicitSurface& surface, double x, double y, double z) {
  return surface.at({x, y, z}).value < 0;
}

TEST(Mine, HasTheOpenSpaceThatItsSheetDescribes) {
  Mine mine = one_drift({.line = {{0, 0, 0}, {20, 0, 0}}, .width = 6, .height = 4});
  mine.drifts["b"] = {
      .off = "a", .at = 10, .side = Side::left, .length = 5, .width = 3, .height = 2.5};
  mine.pillars["p"] = {.at = {{5, 0, 0}}, .length = 2, .width = 1};
  const ImplicitSurface s = surface_of(mine, 1, 0.1);
  EXPECT_TRUE(open_at(s, 0.1, 2.9, 3.9));
  EXPECT_FALSE(open_at(s, -0.1, 0, 2));
  EXPECT_FALSE(open_at(s, 20.1, 0, 2));
  EXPECT_FALSE(open_at(s, 2, 3.1, 2));
  EXPECT_FALSE(open_at(s, 2, 0, 4.1));
  EXPECT_FALSE(open_at(s, 2, 0, -0.1));
  // The branch: 3 m wide about x = 10, from the wall at y = 3 on for 5 m.
  EXPECT_TRUE(open_at(s, 11.4, 7.9, 2.4));
  EXPECT_FALSE(open_at(s, 10, 8.1, 1));
  EXPECT_FALSE(open_at(s, 11.6, 5, 1));
  EXPECT_FALSE(open_at(s, 10, 5, 2.6));
  // The pillar: 2 m along x, 1 m across.
  EXPECT_FALSE(open_at(s, 5.9, 0.4, 2));
  EXPECT_TRUE(open_at(s, 6.1, 0, 2));
  EXPECT_TRUE(open_at(s, 5, 0.6, 2));
}

TEST(Mine, HasArchesAndSlopes) {
  const Mine mine = one_drift(
      {.line = {{0, 0, 0}, {20, 0, 2}}, .width = 6, .height = 5, .arch = 2, .end = End::concrete});
  const ImplicitSurface s = surface_of(mine, 1, 0.1);
  // The floor rises by 1 in 10; the ceiling is 5 m above it in the middle and 3 m at the walls, a
  // parabola between.
  for (const double x : {1.0, 7.0, 19.0}) {
    const double floor = x / 10;
    EXPECT_NEAR(s.at({x, 0, floor + 0.01}).value, -0.01, 1e-9);
    for (const double y : {0.0, 1.5, -2.9}) {
      const double roof = floor + 5 - 2 * (y / 3) * (y / 3);
      EXPECT_TRUE(open_at(s, x, y, roof - 0.01)) << x << " " << y;
      EXPECT_FALSE(open_at(s, x, y, roof + 0.01)) << x << " " << y;
    }
  }
  EXPECT_EQ(s.at({20.01, 0, 4}).material, concrete);
  EXPECT_EQ(s.at({20.01, 0, 4}).face, 1);
  EXPECT_EQ(s.at({-0.01, 0, 2}).material, sandstone);
}

// Its lowest and highest corners lie beyond those of a level section.
TEST(Mine, IsClosedWhereItSlopesAcross) {
  const Mine mine = one_drift({.line = {{0, 0, 0}, {8, 0, 0}}, .height = 4, .cross_slope = 0.3});
  const ImplicitSurface s = surface_of(mine, 1, 0.2);
  EXPECT_TRUE(open_at(s, 4, 4.9, 5.4));
  EXPECT_FALSE(open_at(s, 4, -4.9, 2.6));
  EXPECT_LE(s.bounds.min().z(), -1.5);
  EXPECT_GE(s.bounds.max().z(), 5.5);
  EXPECT_TRUE(check_mesh(mesh_of(scene_of("slope", mine, {.edge_length = 0.2}, 1))).closed());
}

TEST(Mine, FollowsASplineThroughItsPoints) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {10, 3, 0}, {22, 0, 1}, {30, -8, 1}};
  Mine mine = one_drift({.line = points, .course = Course::spline, .width = 4});
  const CentreLine line = centre_lines(mine).at(0);
  EXPECT_GT(line.points.size(), 20U);
  for (const Eigen::Vector3d& p : points) {
    double nearest = 1e9;
    for (const Eigen::Vector3d& q : line.points) nearest = std::min(nearest, (p - q).norm());
    EXPECT_LT(nearest, 1e-12);
  }
  // No turn of more than a few degrees: the chords are about 1 m, the bends about 10 m.
  for (std::size_t i = 1; i + 1 < line.points.size(); ++i) {
    const Eigen::Vector2d before = (line.points[i] - line.points[i - 1]).head<2>().normalized();
    const Eigen::Vector2d after = (line.points[i + 1] - line.points[i]).head<2>().normalized();
    EXPECT_GT(before.dot(after), std::cos(0.2));
  }
  const TriangleMesh mesh = mesh_of(scene_of("spline", mine, {.edge_length = 0.2}, 1));
  EXPECT_TRUE(check_mesh(mesh).closed());
}

// The open space of a bent drift is all places within half a width of its line.
TEST(Mine, GoesRoundBendsAtFullWidth) {
  const ImplicitSurface s = surface_of(
      one_drift({.line = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, .width = 4, .height = 3}), 1, 0.1);
  for (double angle = -1.5; angle < 0.05; angle += 0.1) {
    const Eigen::Vector3d along(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d bend(10, 0, 1.5);
    EXPECT_LT(s.at(bend + 1.99 * along).value, 0) << angle;
    EXPECT_GT(s.at(bend + 2.01 * along).value, 0) << angle;
  }
}

// What contouring relies on. Everything is switched on.
TEST(Mine, EnclosesItsValuesInABall) {
  Mine mine;
  mine.rock.wet_share = 0.2;
  mine.rock.puddle_share = 0.1;
  mine.rock.concrete.rms = 0.01;
  mine.drifts["a"] = {.line = {{0, 0, 0}, {12, 0, 0.5}, {18, 6, 0.5}},
                      .width = 6,
                      .height = 4,
                      .arch = 1,
                      .end = End::concrete};
  mine.drifts["b"] = {.off = "a", .at = 5, .side = Side::right, .length = 6, .width = 4};
  mine.pillars["p"] = {.at = {{9, 0.5, 0}}, .length = 2, .width = 1, .heading = 0.3};
  const ImplicitSurface s = surface_of(mine, 5, 0.02);
  Random random(1, 0);
  for (int i = 0; i < 40000; ++i) {
    Eigen::Vector3d centre, shift;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = s.bounds.min()[axis] - 1, high = s.bounds.max()[axis] + 1;
      centre[axis] = low + (high - low) * random.uniform();
    }
    for (int axis = 0; axis < 3; ++axis) shift[axis] = random.normal();
    const double radius = std::pow(10, -2.5 + 3.5 * random.uniform());
    const Interval range = s.range(centre, radius);
    const double value = s.at(centre + radius * random.uniform() * shift.normalized()).value;
    ASSERT_LE(range.low, value + 1e-12) << centre.transpose() << " radius " << radius;
    ASSERT_GE(range.high, value - 1e-12) << centre.transpose() << " radius " << radius;
  }
}

TEST(Mine, SaysWhatOfItsReliefTrianglesLeaveOut) {
  Mine mine = one_drift({.line = {{0, 0, 0}, {20, 0, 0}}});
  mine.rock = {};
  const auto material = [&](double edge, MaterialIndex index) {
    return surface_of(mine, 1, edge).materials.at(index);
  };
  // Waves of 10 m / 2^k down to 5 cm: all octaves are shown by edges of 2 cm.
  EXPECT_EQ(material(0.02, sandstone).roughness, 0);
  EXPECT_GT(material(0.05, sandstone).roughness, 0.001);
  EXPECT_GT(material(0.2, sandstone).roughness, material(0.05, sandstone).roughness);
  EXPECT_GT(material(0.2, sandstone).roughness, material(0.2, bedded_sandstone).roughness);
  EXPECT_GT(material(0.05, gravel).roughness, 0);
  EXPECT_EQ(material(0.05, steel).roughness, 0);
}

TEST(Mine, RefusesSheetsThatCannotBeBuilt) {
  EXPECT_EQ(refusal(flat_mine()), "mine: expected at least one drift (drifts.NAME.line)");
  EXPECT_EQ(refusal(one_drift({})),
            "drift 'a': expected a line of 2 points or more, or off: the drift it leaves; found 0 "
            "points");
  EXPECT_EQ(refusal(one_drift({.line = {{0, 0, 0}, {9, 0, 0}}, .width = 0})),
            "drift 'a': expected a width and a height > 0 m, found 0 and 6");
  EXPECT_EQ(refusal(one_drift({.line = {{0, 0, 0}, {0, 0, 0}}})),
            "drift 'a': expected points at least 0.1 m apart in plan, found (0, 0, 0) and (0, 0, "
            "0)");
  EXPECT_EQ(refusal(one_drift({.line = {{0, 0, 0}, {4, 0, 4}}})),
            "drift 'a': expected floors that rise by at most 1 in 2, found (0, 0, 0) to (4, 0, 4)");
  EXPECT_EQ(refusal(one_drift({.line = {{0, 0, 0}, {9, 0, 0}, {1, 1, 0}}})),
            "drift 'a': turns back on itself at (9, 0, 0); expected turns of at most 120 degrees");
  EXPECT_EQ(refusal(one_drift({.line = {{0, 0, 0}, {9, std::nan(""), 0}}})),
            "drift 'a': expected finite coordinates, found (9, nan, 0)");

  Mine mine = one_drift({.off = "b"});
  mine.drifts["b"] = {.off = "a"};
  EXPECT_EQ(refusal(mine), "drift 'a': leaves itself, by way of 'off: b'");
  mine.drifts["b"] = {.off = "c"};
  EXPECT_EQ(refusal(mine), "drift 'b': unknown drift 'c'; known: a, b");
  mine.drifts["b"] = {.line = {{0, 0, 0}, {9, 0, 0}}};
  mine.drifts["a"].at = 10;
  EXPECT_EQ(refusal(mine), "drift 'a': expected at: 0 to 9 m along 'b', found 10");
  mine.drifts["a"].at = 5;
  mine.pillars["p"].at = {};
  EXPECT_EQ(refusal(mine), "pillar 'p': expected at: one point, found 0");
}

TEST(Mine, RefusesDriftsThatMeetOnDifferentLevels) {
  Mine mine = one_drift({.line = {{0, 0, 0}, {40, 0, 0}}});
  mine.drifts["b"] = {.line = {{20, -20, 1}, {20, 20, 1}}};
  EXPECT_EQ(refusal(mine),
            "drift 'a': meets 'b' near (20, 0) on another level: floors at 0 and 1 m; expected the "
            "same floor, or 2 m of rock between");
  mine.drifts["b"].line = {{20, -20, 0.2}, {20, 20, 0.2}};
  EXPECT_EQ(refusal(mine), "nothing thrown");
  // One above the other, with rock between.
  mine.drifts["b"].line = {{20, -20, 9}, {20, 20, 9}};
  EXPECT_EQ(refusal(mine), "nothing thrown");
  // A drift that comes round to itself, higher up.
  Mine ramp = one_drift(
      {.line = {{0, 0, 0}, {20, 0, 0}, {20, 20, 2}, {0, 20, 2}, {0, -10, 3}}, .width = 6});
  EXPECT_NE(refusal(ramp).find("meets 'a' near (0, 0) on another level"), std::string::npos)
      << refusal(ramp);
}

TEST(Mine, TakesFurtherPartsByName) {
  const Settings settings = {{"drifts.new.line", "0 0, 9 0"},
                             {"drifts.new.width", "4"},
                             {"pillars.p.at", "3 0"},
                             {"things.l.drift", "new"}};
  const Mine mine = with_settings(with_names({}, settings), settings);
  ASSERT_EQ(mine.drifts.size(), 1U);
  EXPECT_EQ(mine.drifts.at("new").width, 4);
  EXPECT_EQ(mine.drifts.at("new").line.size(), 2U);
  EXPECT_EQ(mine.pillars.at("p").at.at(0), Eigen::Vector3d(3, 0, 0));
  EXPECT_EQ(mine.things.at("l").drift, "new");
  EXPECT_THROW(with_settings(Mine{}, settings), std::invalid_argument);
  // Every value can be printed and read back.
  Settings all;
  for (const Field& field : fields_of(mine)) all[field.name] = field.value;
  const Mine again = with_settings(with_names({}, all), all);
  EXPECT_EQ(fields_of(again).size(), fields_of(mine).size());
  for (const Field& field : fields_of(again)) EXPECT_EQ(field.value, all.at(field.name));
}

TEST(RoomAndPillar, RefusesDriftsWithoutRockBetween) {
  EXPECT_THROW(room_and_pillar({.spacing = 12, .width = 10}, 1), std::invalid_argument);
  EXPECT_NO_THROW(room_and_pillar({.spacing = 13, .width = 10}, 1));
}

}  // namespace
}  // namespace minescan
