// SPDX-License-Identifier: MIT
#include "sim/kinematics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "test/sim/shapes.h"

namespace minescan {
namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

Scanner pitching() {
  Scanner s;
  s.motion = Motion::pitch;
  s.plane_beams = 181;
  s.planes = 100;
  s.plane_field = 181 * degree;
  s.motion_start = 20 * degree;
  s.motion_end = -30 * degree;
  return s;
}

Beam nominal(const Scanner& s, int ring, int column) {
  const Kinematics kinematics(s);
  return kinematics.nominal(kinematics.plane(column, 0), ring);
}
Beam actual(const Scanner& s, int ring, int column, double jitter = 0, double head = 0) {
  const Kinematics kinematics(s);
  return kinematics.actual(kinematics.plane(column, head), ring, jitter);
}

// Polar angle from straight up, and azimuth to the left of forward, both degrees.
double polar(const Vector3d& d) { return std::acos(std::clamp(d.z(), -1.0, 1.0)) / degree; }
double azimuth(const Vector3d& d) { return std::atan2(d.y(), d.x()) / degree; }

Vector3d direction(const Scanner& s, int ring, int column) {
  return nominal(s, ring, column).direction;
}

Scanner of_size(int plane_beams, int planes) {
  Scanner s;
  s.plane_beams = plane_beams;
  s.planes = planes;
  return s;
}

double angle_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

TEST(BeamDirections, YawingPlanesAreVerticalAndSweepOverTheTop) {
  // Three beams 90 degrees apart, and two planes that turn from 45 degrees right to 45 degrees
  // left.
  Scanner s = of_size(3, 2);
  s.plane_field = 270 * degree;
  const double h = std::sqrt(0.5);
  EXPECT_TRUE(direction(s, 0, 0).isApprox(Vector3d(-h, h, 0)));
  EXPECT_TRUE(direction(s, 1, 0).isApprox(Vector3d(0, 0, 1)));
  EXPECT_TRUE(direction(s, 2, 0).isApprox(Vector3d(h, -h, 0)));
  EXPECT_TRUE(direction(s, 0, 1).isApprox(Vector3d(-h, -h, 0)));
  EXPECT_TRUE(direction(s, 2, 1).isApprox(Vector3d(h, h, 0)));
}

TEST(BeamDirections, PitchingPlanesSweepFromRightToLeftAndTiltUp) {
  Scanner s = of_size(3, 1);
  s.motion = Motion::pitch;
  s.plane_field = 270 * degree;
  s.motion_start = 0;
  s.motion_end = 90 * degree;  // one plane, in the middle
  const double h = std::sqrt(0.5);
  EXPECT_TRUE(direction(s, 0, 0).isApprox(Vector3d(0, -1, 0)));
  EXPECT_TRUE(direction(s, 1, 0).isApprox(Vector3d(h, 0, h)));
  EXPECT_TRUE(direction(s, 2, 0).isApprox(Vector3d(0, 1, 0)));
}

// 300 degrees about the zenith, turned by 180: everything but a cone of 30 degrees about straight
// down. Neighbouring beams are 0.75 degrees apart in a plane and planes 0.5 degrees.
TEST(BeamDirections, OfTheYawingOptabCoverTheStatedAngles) {
  const Scanner& s = find_scanner("optab-yawing");
  const Kinematics kinematics(s);
  const auto direction_of = [&](int ring, int column) {
    return kinematics.nominal(kinematics.plane(column, 0), ring).direction;
  };
  std::vector<Vector3d> beams;
  for (int column = 0; column < s.planes; ++column)
    for (int ring = 0; ring < s.plane_beams; ++ring) {
      beams.push_back(direction_of(ring, column));
      ASSERT_NEAR(beams.back().norm(), 1, 1e-15 * 4);
      ASSERT_LE(polar(beams.back()), 150 - 0.375 + 1e-9);
    }
  EXPECT_EQ(beams.size(), 144000u);
  for (std::uint64_t i = 0; i < 60; ++i) {
    Random random(1, i);
    const Vector3d direction = random_direction(random);
    if (polar(direction) > 150) continue;
    double nearest = -1;
    for (const Vector3d& beam : beams) nearest = std::max(nearest, beam.dot(direction));
    // Half a step each way: hypot(0.375, 0.25) degrees.
    EXPECT_LE(std::acos(std::min(1.0, nearest)) / degree, 0.4507) << direction.transpose();
  }
}

TEST(BeamDirections, OfThePitchingOptabCoverTheStatedAngles) {
  const Scanner& s = find_scanner("optab-pitching");
  const Kinematics kinematics(s);
  const auto direction_of = [&](int ring, int column) {
    return kinematics.nominal(kinematics.plane(column, 0), ring).direction;
  };
  for (int column = 0; column < s.planes; ++column) {
    const double pitch = 0.5 * column + 0.25;  // 0 to 90 degrees in 180 planes
    const Vector3d across(-std::sin(pitch * degree), 0, std::cos(pitch * degree));
    double forward = 0;
    for (int ring = 0; ring < s.plane_beams; ++ring) {
      const Vector3d beam = direction_of(ring, column);
      ASSERT_NEAR(beam.dot(across), 0, 1e-14);
      forward = std::max(forward,
                         beam.x() * std::cos(pitch * degree) + beam.z() * std::sin(pitch * degree));
    }
    ASSERT_NEAR(std::acos(forward) / degree, 0.6875, 1e-9);  // half of 220 / 160
  }
  EXPECT_NEAR(azimuth(direction(s, 0, 0)), -109.3125,
              1e-3);  // the first plane is all but level
  EXPECT_NEAR(azimuth(direction(s, 159, 0)), 109.3125, 1e-3);
  EXPECT_NEAR(polar(direction(s, 80, 0)), 89.75, 1e-3);
}

TEST(Kinematics, WithoutErrorsBeamsGoWhereTheyAreBelievedToGo) {
  Scanner s = pitching();
  s.lever = {0.1, 0.02, -0.05};
  s.mount = {0.1, -0.2, 0.3};
  for (const int ring : {0, 77, 180}) {
    const Beam a = nominal(s, ring, 13), b = actual(s, ring, 13);
    EXPECT_TRUE(a.direction.isApprox(b.direction, 1e-15));
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_NEAR(a.direction.norm(), 1, 1e-15);
    EXPECT_NEAR(a.along.norm(), 1, 1e-15);
    EXPECT_NEAR(a.along.dot(a.direction), 0, 1e-15);
  }
}

TEST(Kinematics, TheLeverTurnsWithTheHead) {
  Scanner s = pitching();
  s.lever = {0.2, 0, 0.1};
  const double pitch = (20 - 50 * 10.5 / 100) * degree;  // the middle of step 10
  const Vector3d expected(0.2 * std::cos(pitch) - 0.1 * std::sin(pitch), 0,
                          0.2 * std::sin(pitch) + 0.1 * std::cos(pitch));
  EXPECT_TRUE(nominal(s, 90, 10).origin.isApprox(expected, 1e-14));
}

TEST(Kinematics, TheMountTurnsTheMirrorInTheHead) {
  Scanner s = pitching();
  s.motion = Motion::none;
  s.mount = {0, 0, 30 * degree};  // the middle beam goes 30 degrees to the left
  EXPECT_TRUE(nominal(s, 90, 0).direction.isApprox(
      Vector3d(std::cos(30 * degree), std::sin(30 * degree), 0), 1e-14));
}

TEST(Kinematics, ErrorsOfTheMirrorTurnBeamsByTheirAngles) {
  Scanner s = pitching();
  s.index_error = 0.002;
  EXPECT_NEAR(angle_between(actual(s, 30, 5).direction, nominal(s, 30, 5).direction), 0.002, 1e-12);

  s = pitching();
  s.eccentricity = 0.003;  // * sin(-60 degrees)
  EXPECT_NEAR(angle_between(actual(s, 30, 5).direction, nominal(s, 30, 5).direction),
              0.003 * std::sin(60 * degree), 1e-12);

  // A cone: all beams leave the plane by twice the tilt, to the same side.
  s = pitching();
  s.mirror_tilt = 0.001;
  for (const int ring : {0, 45, 90, 180}) {
    const double pitch = (20 - 50 * 5.5 / 100) * degree;
    const Vector3d across(-std::sin(pitch), 0, std::cos(pitch));
    EXPECT_NEAR(actual(s, ring, 5).direction.dot(across), std::sin(0.002), 1e-12);
  }

  s = pitching();
  s.encoder_jitter = 0.0005;
  EXPECT_NEAR(angle_between(actual(s, 30, 5, 2).direction, nominal(s, 30, 5).direction), 0.001,
              2e-10);  // sine for angle: a^3 / 6
}

TEST(Kinematics, ErrorsOfTheHeadTurnWholePlanes) {
  Scanner s = pitching();
  s.motion_jitter = 0.001;
  s.lever = {0.2, 0, 0};
  // Straight ahead the whole angle, to the side none; the lever turns along.
  EXPECT_NEAR(angle_between(actual(s, 90, 5, 0, 1.5).direction, nominal(s, 90, 5).direction),
              0.0015, 1e-12);
  EXPECT_NEAR(angle_between(actual(s, 0, 5, 0, 1.5).direction, nominal(s, 0, 5).direction), 0,
              1e-12);
  EXPECT_NEAR((actual(s, 90, 5, 0, 1.5).origin - nominal(s, 90, 5).origin).norm(), 0.2 * 0.0015,
              1e-9);

  s = pitching();
  s.axis_tilt = 0.001;  // about up: the beam that points ahead and up by p moves by cos(p)
  const double pitch = (20 - 50 * 5.5 / 100) * degree;
  EXPECT_NEAR(angle_between(actual(s, 90, 5).direction, nominal(s, 90, 5).direction),
              0.001 * std::cos(pitch), 1e-9);
}

// 0.5 degrees by two turns shifted against each other, as the SICK LMS does it: neighbouring beams
// are a turn apart.
TEST(Kinematics, InterlacedBeamsComeFromOneTurnAfterTheOther) {
  Scanner s = pitching();
  s.plane_beams = 361;
  s.plane_field = 361 * 0.5 * degree;
  s.interlace = 2;
  s.turn_time = 1 / 75.0;
  s.beam_time = 1 / (75.0 * 720);
  const Kinematics k(s);
  EXPECT_DOUBLE_EQ(k.time(0, 0), 0);
  EXPECT_DOUBLE_EQ(k.time(2, 0), 2 * s.beam_time);
  EXPECT_DOUBLE_EQ(k.time(1, 0), s.turn_time + s.beam_time);
  EXPECT_DOUBLE_EQ(k.time(0, 3), 6 * s.turn_time);
  EXPECT_DOUBLE_EQ(k.duration(), 200 * s.turn_time);
}

// The loop data of the paper: 525 lines of 181 beams at 75 turns per second are 7.0 s.
TEST(Kinematics, TheLmsTakesSevenSeconds) {
  const Scanner& s = find_scanner("sick-lms200-ptu");
  EXPECT_EQ(s.plane_beams * s.planes, 95025);
  EXPECT_DOUBLE_EQ(Kinematics(s).duration(), 7);
  EXPECT_NEAR((s.motion_start - s.motion_end) / s.planes / degree, 0.162, 0.0005);
  // From 90 degrees right to 90 degrees left, the first line 30 degrees up.
  EXPECT_NEAR(nominal(s, 0, 0).direction.y(), -1, 1e-12);
  EXPECT_NEAR(nominal(s, 180, 0).direction.y(), 1, 1e-12);
  EXPECT_NEAR(std::asin(nominal(s, 90, 0).direction.z()) / degree, 30 - 0.081, 1e-3);
}

// A head that turns on is where its speed has taken it, and at half of a step on average.
TEST(Kinematics, AContinuousHeadTurnsDuringASweep) {
  Scanner s;
  s.plane_beams = 4;
  s.planes = 10;
  s.plane_field = 0.1;
  s.plane_centre = 90 * degree;  // the horizon
  s.motion_start = 0;
  s.motion_end = 1;
  s.beam_time = 0.25;
  s.continuous = true;
  const Kinematics k(s);
  for (const int column : {0, 7})
    for (int ring = 0; ring < 4; ++ring) {
      const Vector3d d = nominal(s, ring, column).direction;
      EXPECT_NEAR(std::atan2(d.y(), d.x()), k.time(ring, column) / k.duration(), 1e-14);
    }
}

TEST(Kinematics, SpinningScannersSweepTheHorizonFromTopToBottom) {
  const Scanner& s = find_scanner("spin-16");
  for (int ring = 0; ring < 16; ++ring)
    EXPECT_NEAR(std::asin(nominal(s, ring, 100).direction.z()) / degree, 15 - 2 * ring, 1e-9);
}

TEST(Kinematics, PixelsLieOnAPlane) {
  const Scanner& s = find_scanner("flash-3d");
  const Vector3d corner = nominal(s, 0, 0).direction;
  // Half a pixel inside of the stated field: 34.6 by 43.6 degrees.
  EXPECT_NEAR(corner.z() / corner.x(), std::tan(17.3 * degree) * 143 / 144, 1e-12);
  EXPECT_NEAR(corner.y() / corner.x(), std::tan(21.8 * degree) * 175 / 176, 1e-12);
  const auto at = [&](int ring, int column) -> Vector3d {
    const Vector3d d = nominal(s, ring, column).direction;
    return d / d.x();
  };
  const Vector3d step = at(0, 1) - at(0, 0);
  EXPECT_TRUE((at(0, 101) - at(0, 100)).isApprox(step, 1e-9));
  EXPECT_TRUE((at(99, 101) - at(99, 100)).isApprox(step, 1e-9));
}

// One prism deviates a beam that meets its slanted face from inside by asin(n sin w) - w; turned
// against each other the two nearly cancel.
TEST(Kinematics, PrismsBendAsSnellsLawSays) {
  Scanner s = find_scanner("rosette");
  s.wedge_2 = 0;
  const double w = s.wedge_1;
  EXPECT_NEAR(angle_between(nominal(s, 123, 45).direction, Vector3d::UnitX()),
              std::asin(1.51 * std::sin(w)) - w, 1e-12);
  // One prism alone draws a circle with its own rate.
  s.rotor_1 = 100;
  EXPECT_TRUE(nominal(s, 0, 0).direction.isApprox(nominal(s, 0, 1).direction, 1e-9));  // 10 ms

  // Both: a field of a little under 40 degrees (38.4 is what such a sensor is sold with).
  double widest = 0, narrowest = 10;
  const Scanner& both = find_scanner("rosette");
  const Kinematics k(both);
  const Kinematics::Plane plane = k.plane(3, 0);
  for (int ring = 0; ring < both.plane_beams; ++ring) {
    const double angle = angle_between(k.nominal(plane, ring).direction, Vector3d::UnitX());
    widest = std::max(widest, angle);
    narrowest = std::min(narrowest, angle);
  }
  EXPECT_NEAR(2 * widest / degree, 38.4, 2);
  EXPECT_LT(narrowest / degree, 1.5);
}

// Sixteen beams at once are those of one by one, up to the order in which rounded products are
// added: a few units of the last place, 2e-16 of a unit vector.
TEST(BeamDirections, OfLanesAreThoseOneByOne) {
  Scanner levered = pitching();
  levered.lever = {0.1, -0.2, 0.3};
  levered.encoder_jitter = 1e-3;
  levered.mirror_tilt = 0.01;
  levered.motion_jitter = 1e-3;
  for (const Scanner& s : {levered, find_scanner("spin-16"), find_scanner("rosette"),
                           find_scanner("flash-3d"), find_scanner("optab-yawing")}) {
    const Kinematics kinematics(s);
    Kinematics::Heads heads;
    Kinematics::Rings rings;
    Lanes jitter;
    std::array<Kinematics::Plane, lanes> planes;
    for (std::size_t i = 0; i < lanes; ++i) {
      const auto n = static_cast<int>(i);
      planes[i] = kinematics.plane(7 * n % s.planes, 0.1 * n);
      heads.set(i, planes[i]);
      rings[i] = 5 * n % s.plane_beams;
      jitter[i] = 0.5f * static_cast<float>(n) - 3;
    }
    Kinematics::Beams nominal, actual;
    VectorLanes along;
    kinematics.nominal(heads, rings, nominal);
    kinematics.actual(heads, rings, jitter, actual);
    kinematics.along(heads, rings, along);
    for (std::size_t i = 0; i < lanes; ++i) {
      const Beam believed = kinematics.nominal(planes[i], rings[i]);
      const Beam real = kinematics.actual(planes[i], rings[i], static_cast<double>(jitter[i]));
      EXPECT_LT((nominal.origin.lane(i) - believed.origin).norm(), 1e-15) << s.name;
      EXPECT_LT((nominal.direction.lane(i) - believed.direction).norm(), 1e-15) << s.name;
      EXPECT_LT((actual.origin.lane(i) - real.origin).norm(), 1e-15) << s.name;
      EXPECT_LT((actual.direction.lane(i) - real.direction).norm(), 1e-15) << s.name;
      EXPECT_LT((along.lane(i) - real.along).norm(), 1e-15) << s.name;
    }
  }
}

}  // namespace
}  // namespace minescan
