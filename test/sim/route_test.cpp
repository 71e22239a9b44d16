// SPDX-License-Identifier: MIT
#include "sim/route.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace minescan {
namespace {

using Line = std::vector<Eigen::Vector3d>;
constexpr double pi = std::numbers::pi;

// The drifts of the paper's loop as scenes/presets.cpp has them, in driving order.
std::vector<Line> loop_lines() {
  return {{{-5, 0, 0}, {148, 0, 0}},
          {{143, -5, 0}, {143, 29, 0}},
          {{68, 24, 0}, {110, 23.5, 0}, {148, 24, 0}},
          {{-5, 21, 0}, {40, 21.5, 0}, {76, 21, 0}},
          {{0, -5, 0}, {0, 26, 0}}};
}

void expect_path(const Line& path, const Line& expected) {
  ASSERT_EQ(path.size(), expected.size());
  for (std::size_t i = 0; i < path.size(); ++i)
    // Intersections of lines 100 m long: a few roundings of that.
    EXPECT_LT((path[i] - expected[i]).norm(), 1e-12) << i << ": " << path[i].transpose();
}

std::string complaint(const std::vector<Line>& lines, bool closed, double reach = 5) {
  try {
    joined_lines(lines, closed, reach);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST(JoinedLines, ChangeOverWhereTheyCross) {
  expect_path(joined_lines({{{0, 0, 0}, {10, 0, 0}}, {{7, -2, 0}, {7, 20, 0}}}, false),
              {{0, 0, 0}, {7, 0, 0}, {7, 20, 0}});
  // The far end is where it goes, whichever way the line was written.
  expect_path(joined_lines({{{10, 0, 0}, {0, 0, 0}}, {{7, 20, 0}, {7, 9, 0}, {7, -2, 0}}}, false),
              {{0, 0, 0}, {7, 0, 0}, {7, 9, 0}, {7, 20, 0}});
  expect_path(joined_lines({{{0, 0, 1}, {10, 0, 1}}}, false), {{0, 0, 1}, {10, 0, 1}});
}

TEST(JoinedLines, CrossingIsAtTheMeanOfBothHeights) {
  expect_path(joined_lines({{{0, 0, 0}, {10, 0, 1}}, {{5, -2, 0.7}, {5, 20, 0.7}}}, false),
              {{0, 0, 0}, {5, 0, 0.6}, {5, 20, 0.7}});
}

TEST(JoinedLines, ThatRunSideBySideChangeOverAtASlant) {
  // The first ends at x = 18, the second begins at x = 8 beside it.
  const Line first = {{0, 0, 0}, {18, 0, 0}};
  const Line second = {{8, 3, 0}, {40, 3, 0}};
  expect_path(joined_lines({first, second}, false), {{0, 0, 0}, {8, 0, 0}, {18, 3, 0}, {40, 3, 0}});
  expect_path(joined_lines({second, first}, false), {{40, 3, 0}, {18, 3, 0}, {8, 0, 0}, {0, 0, 0}});
}

TEST(JoinedLines, ThatStopNearEachOtherJoinAtTheNearestPoints) {
  // Ends in front of the other's middle, and end near end.
  expect_path(joined_lines({{{0, 0, 0}, {10, 0, 0}}, {{12, -3, 0}, {12, 20, 0}}}, false),
              {{0, 0, 0}, {10, 0, 0}, {12, 0, 0}, {12, 20, 0}});
  expect_path(joined_lines({{{0, 0, 0}, {10, 0, 0}}, {{30, 1, 0}, {12, 1, 0}}}, false),
              {{0, 0, 0}, {10, 0, 0}, {12, 1, 0}, {30, 1, 0}});
}

TEST(JoinedLines, GoRoundTheLoopOfThePaper) {
  // Crossings of the links by hand: the north drifts are straight between their points.
  const double east = 23.5 + 0.5 * (143 - 110) / 38;
  const double west = 21 + 0.5 * 5 / 45;
  std::vector<Line> lines = loop_lines();
  const Line path = joined_lines(lines, true);
  ASSERT_EQ(path.size(), 8u);
  expect_path({path[0], path[1], path[2], path[3]},
              {{0, 0, 0}, {143, 0, 0}, {143, east, 0}, {110, 23.5, 0}});
  expect_path({path[6], path[7]}, {{40, 21.5, 0}, {0, west, 0}});
  // From near (76, 23.9) to near (68, 21.1); both feet are a few centimetres off for the slopes.
  EXPECT_LT((path[4] - Eigen::Vector3d(76, 23.9, 0)).norm(), 0.1);
  EXPECT_LT((path[5] - Eigen::Vector3d(68, 21.1, 0)).norm(), 0.1);
  // About 330 m, of which four corners of 3 m take 1.3 m each.
  EXPECT_NEAR(Route(path, true, 3).length(), 330, 5);

  // Each line may be written from either end.
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::reverse(lines[i].begin(), lines[i].end());
    expect_path(joined_lines(lines, true), path);
  }
}

TEST(JoinedLines, OfTwoThatCrossTwiceGoRound) {
  const Line straight = {{-10, 0, 0}, {10, 0, 0}};
  const Line bow = {{-4, -3, 0}, {-4, 6, 0}, {4, 6, 0}, {4, -3, 0}};
  expect_path(joined_lines({straight, bow}, true), {{-4, 0, 0}, {4, 0, 0}, {4, 6, 0}, {-4, 6, 0}});
}

TEST(JoinedLines, ComplaintsNameBothLines) {
  const Line a = {{0, 0, 0}, {10, 0, 0}};
  EXPECT_EQ(complaint({a, {{0, 0, 0}, {0, 9, 0}}, {{30, 5, 0}, {18, 5, 0}}}, false),
            "route: lines 1 and 2 do not meet: from (0, 5, 0) to (18, 5, 0) are 18 m in plan and 0 "
            "m in height, expected 5 m or less");
  // One drift passes over another.
  EXPECT_EQ(complaint({a, {{5, -5, 8}, {5, 5, 8}}}, false),
            "route: lines 0 and 1 do not meet: from (5, 0, 0) to (5, 0, 8) are 0 m in plan and 8 m "
            "in height, expected 5 m or less");
  EXPECT_EQ(complaint({}, false), "route: expected one line or more, found 0");
  EXPECT_EQ(complaint({a}, true), "route: expected two lines or more, found 1");
  EXPECT_EQ(complaint({a, {{1, 1, 0}}}, false),
            "route: line 1: expected 2 points or more, found 1");
  EXPECT_EQ(complaint({{{0, 0, 0}, {0, 0, 2}}}, false),
            "route: line 0: point 1 = (0, 0, 2): expected one beside the point before, as seen "
            "from above");
  EXPECT_EQ(complaint({{{0, 0, 0}, {std::numeric_limits<double>::quiet_NaN(), 0, 2}}}, false),
            "route: line 0: point 1 = (nan, 0, 2): expected finite numbers");
  // Crossing once, two lines lead there and back.
  EXPECT_EQ(complaint({a, {{5, -5, 0}, {5, 5, 0}}}, true),
            "route: lines 0 to 1 meet in one place and lead nowhere from it");
}

TEST(Route, OfARectangleHasItsLengthAndItsArcs) {
  const double radius = 2;
  const Route route({{0, 0, 0}, {20, 0, 0}, {20, 10, 0}, {0, 10, 0}}, true, radius);
  EXPECT_NEAR(route.length(), 60 - 8 * radius + 2 * pi * radius, 1e-12);
  // It begins where it leaves the first corner.
  EXPECT_LT((route.at(0).position - Eigen::Vector3d(2, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(route.at(0).heading, 0);
  // Along the arc around (18, 2).
  for (const double angle : {0.0, 0.3, 1.0, pi / 2}) {
    const RoutePlace place = route.at(16 + radius * angle);
    const Eigen::Vector3d expected(18 + radius * std::sin(angle), 2 - radius * std::cos(angle), 0);
    EXPECT_LT((place.position - expected).norm(), 1e-12) << angle;
    EXPECT_NEAR(place.heading, angle, 1e-12);
  }
  // Round and round, forwards and backwards, turning on.
  for (const double along : {0.0, 11.0, 17.0, 59.0}) {
    const RoutePlace place = route.at(along);
    for (const double rounds : {-2.0, -1.0, 1.0, 3.0}) {
      const RoutePlace again = route.at(along + rounds * route.length());
      EXPECT_LT((again.position - place.position).norm(), 1e-12);
      EXPECT_NEAR(again.heading, place.heading + rounds * 2 * pi, 1e-12);
    }
  }
}

TEST(Route, NeitherJumpsNorTurnsAwayFromItsHeading) {
  const Line path = joined_lines(loop_lines(), true);
  const Route loop(path, true, 3);
  // Clockwise, over a hill, with a leg too short for its corners.
  const Route open({{0, 0, 0}, {10, 0, 1}, {10, -1, 1}, {30, -8, 0}, {30, 5, 0}}, false, 4);
  for (const Route* route : {&loop, &open}) {
    const double h = 1e-4;
    const double end = route->length() - (route->closed() ? 0 : h);
    RoutePlace before = route->at(0);
    for (double along = 0; along < end; along += 0.05) {
      const RoutePlace here = route->at(along);
      const RoutePlace next = route->at(along + h);
      const Eigen::Vector2d step = (next.position - here.position).head<2>();
      // A chord of an arc of 0.3 m or more is shorter than it by 1e-8 of it, and a corner between
      // pieces none at all.
      EXPECT_NEAR(step.norm(), h, 1e-7 * h) << along;
      // It points to the middle of both headings; 1e-16 * 100 m of rounding over 1e-4 m.
      const double middle = (here.heading + next.heading) / 2;
      EXPECT_NEAR(step.x() * std::sin(middle) - step.y() * std::cos(middle), 0, 1e-9 * h + 1e-13);
      EXPECT_LT(std::abs(here.heading - before.heading), 0.05 / 0.3);
      // Where one piece ends the next begins: heights rise by 1 in 10 at most.
      EXPECT_LT((here.position - before.position).norm(), 0.05 * 1.006);
      before = here;
    }
  }
}

TEST(Route, TurnsToEitherSide) {
  const Route route({{0, 0, 0}, {10, 0, 0}, {10, -10, 0}, {20, -10, 0}}, false, 2);
  EXPECT_LT((route.at(8 + pi / 2).position -
             Eigen::Vector3d(10 - 2 + std::sqrt(2.0), -2 + std::sqrt(2.0), 0))
                .norm(),
            1e-12);
  EXPECT_NEAR(route.at(8 + pi + 1).heading, -pi / 2, 1e-12);
  EXPECT_NEAR(route.at(route.length()).heading, 0, 1e-12);
  EXPECT_LT((route.at(route.length()).position - Eigen::Vector3d(20, -10, 0)).norm(), 1e-12);
}

TEST(Route, CornersAreAsWideAsTheLegsAllow) {
  // The middle leg of 2 m is shared by two square corners: 1 m each, on the other legs too.
  const Route route({{0, 0, 0}, {10, 0, 0}, {10, 2, 0}, {20, 2, 0}}, false, 4);
  EXPECT_NEAR(route.length(), 9 + pi / 2 + pi / 2 + 9, 1e-12);
  EXPECT_LT((route.at(9 + pi / 2).position - Eigen::Vector3d(10, 1, 0)).norm(), 1e-12);
  // A free end leaves the whole leg to the corner.
  EXPECT_NEAR(Route({{0, 0, 0}, {3, 0, 0}, {3, 50, 0}}, false, 10).length(), 3 * pi / 2 + 47,
              1e-12);
}

TEST(Route, HeightsGoEvenly) {
  const Route route({{0, 0, 0}, {10, 0, 1}, {10, 10, 1}}, false, 2);
  EXPECT_NEAR(route.at(4).position.z(), 0.4, 1e-12);
  EXPECT_NEAR(route.at(8).position.z(), 0.8, 1e-12);
  EXPECT_NEAR(route.at(8 + pi / 2).position.z(), 0.9, 1e-12);  // the middle of the arc
  EXPECT_NEAR(route.at(8 + pi).position.z(), 1, 1e-12);
}

TEST(Route, RefusesWhatIsNone) {
  const Line corner = {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}};
  EXPECT_THROW(Route({{0, 0, 0}}, false, 1), std::invalid_argument);
  EXPECT_THROW(Route({{0, 0, 0}, {1, 0, 0}}, true, 1), std::invalid_argument);
  EXPECT_THROW(Route(corner, false, 0), std::invalid_argument);
  EXPECT_THROW(Route({{0, 0, 0}, {10, 0, 0}, {0, 0.1, 0}}, false, 1), std::invalid_argument);
  EXPECT_THROW(Route({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 0, 0}}, true, 1),
               std::invalid_argument);
  const Route route(corner, false, 1);
  EXPECT_THROW(route.at(-0.1), std::invalid_argument);
  EXPECT_THROW(route.at(20), std::invalid_argument);
  EXPECT_THROW(route.at(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

TEST(Stops, AreStepsApartAndTheSameEveryTime) {
  const Route loop(joined_lines(loop_lines(), true), true, 3);
  const std::vector<double> list = stops(loop, 4, 5, 1000, 7);
  ASSERT_EQ(list.size(), 1000u);
  EXPECT_EQ(list[0], 0);
  double least = 5;
  double most = 4;
  for (std::size_t k = 1; k < list.size(); ++k) {
    least = std::min(least, list[k] - list[k - 1]);
    most = std::max(most, list[k] - list[k - 1]);
  }
  // Of 999 even draws the extremes are within 1 % of the ends but for odds of 4e-5.
  EXPECT_GE(least, 4 - 1e-9);
  EXPECT_LT(least, 4.01);
  EXPECT_LE(most, 5 + 1e-9);
  EXPECT_GT(most, 4.99);
  // The mean step has a standard deviation of 1 / sqrt(12 * 999) = 9 mm; three of them.
  EXPECT_NEAR(list.back() / 999, 4.5, 0.028);
  EXPECT_EQ(stops(loop, 4, 5, 1000, 7), list);
  EXPECT_NE(stops(loop, 4, 5, 1000, 8), list);
}

TEST(Stops, RefuseAShortRouteAndWrongSteps) {
  const Route open({{0, 0, 0}, {10, 0, 0}}, false, 1);
  EXPECT_EQ(stops(open, 5, 5, 3, 1), (std::vector<double>{0, 5, 10}));
  EXPECT_THROW(stops(open, 5, 5, 4, 1), std::invalid_argument);
  EXPECT_THROW(stops(open, 0, 5, 2, 1), std::invalid_argument);
  EXPECT_THROW(stops(open, 5, 4, 2, 1), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
