// SPDX-License-Identifier: MIT
#include "sim/scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "sim/fine_relief.h"
#include "sim/kinematics.h"
#include "test/sim/shapes.h"

namespace minescan {
namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

// Where beams nominally point.
class Directions {
 public:
  explicit Directions(const Scanner& s) : kinematics_(s) {}
  Vector3d operator()(int ring, int column) const {
    return kinematics_.nominal(kinematics_.plane(column, 0), ring).direction;
  }

 private:
  Kinematics kinematics_;
};
Scanner ideal(int plane_beams, int planes) {
  Scanner s = find_scanner("ideal-yawing");
  s.plane_beams = plane_beams;
  s.planes = planes;
  return s;
}

Pose some_pose() {
  return Eigen::Translation3d(0.5, -0.75, 0.25) *
         Eigen::AngleAxisd(0.3, Vector3d(1, -2, 3).normalized());
}

TEST(Scan, WithoutNoiseMeasuresTheTruthOfABox) {
  const Vector3d half(8, 6, 4);
  const RayCaster caster(box(half.cast<float>(), 5, 0.4));
  const Pose T = some_pose();
  const Scanner s = ideal(57, 43);  // not multiples of a tile
  const Scan result = scan(caster, s, T, 7, "box");
  const Directions direction_of(s);
  EXPECT_EQ(result.scene, "box");
  EXPECT_EQ(result.scanner, "ideal-yawing");
  EXPECT_EQ(result.seed, 7u);
  EXPECT_EQ(result.beams, 57u * 43u);
  ASSERT_EQ(result.cloud.points.size(), result.beams);
  for (std::size_t i = 0; i < result.beams; ++i) {
    EXPECT_EQ(result.ring[i], i % 57);
    EXPECT_EQ(result.column[i], i / 57);
    EXPECT_DOUBLE_EQ(result.time[i], static_cast<double>(i) * s.beam_time);
    const Vector3d direction = direction_of(static_cast<int>(i % 57), static_cast<int>(i / 57));
    const auto [range, normal] = box_hit(half, T.translation(), T.linear() * direction);
    // At the edges of the box Embree may take the other face, within single precision.
    ASSERT_NEAR(result.true_range[i], range, 1e-5);
    EXPECT_EQ(result.range[i], result.true_range[i]);
    // Coordinates are rounded to single precision, by 6e-8 of their size at most.
    EXPECT_TRUE(result.cloud.points[i].isApprox(result.range[i] * direction, 1e-7));
    EXPECT_EQ(result.flags[i], flag_none);
    EXPECT_EQ(result.material[i], 0);
    const Vector3d seen = T.linear() * result.true_normal[i].cast<double>();
    if (!seen.isApprox(normal, 1e-6)) continue;  // an edge
    const double cosine = -normal.dot(T.linear() * direction);
    EXPECT_NEAR(std::cos(result.incidence[i]), cosine, 1e-6);  // single precision
    EXPECT_NEAR(result.true_range[i], range, 1e-12);
    const double g = 1 - std::exp(-81 / (range * range));
    EXPECT_NEAR(result.intensity[i], 0.4 * cosine * g, 1e-7);
    // The triangle is the one with that point in it: in its plane and its bounding box.
    const auto& corners = caster.mesh().triangles[result.triangle[i]];
    const Eigen::Vector3f point = (T * result.cloud.points[i]).cast<float>();
    Eigen::AlignedBox3f bounds;
    for (const std::uint32_t v : corners) bounds.extend(caster.mesh().vertices[v]);
    EXPECT_LE(bounds.exteriorDistance(point), 1e-5);
  }
}

// A square room moved and turned together with the scanner: only the rounding of the vertices to
// single precision (1e-6 m at 20 m) changes, seen under up to 80 degrees or so.
TEST(Scan, DoesNotChangeWhenMineAndScannerMoveTogether) {
  const TriangleMesh mesh = cave(8, 4, 0.1);
  const Pose T = some_pose();
  const Pose motion =
      Eigen::Translation3d(11, -7, 3) * Eigen::AngleAxisd(2.1, Vector3d(3, 1, -1).normalized());
  TriangleMesh moved = mesh;
  for (Eigen::Vector3f& v : moved.vertices) v = (motion * v.cast<double>()).cast<float>();
  Scanner s = find_scanner("optab-yawing");
  s.plane_beams = 100;
  s.planes = 90;
  s.phase_bits = 0;  // else a range may go to the next step, 0.3 mm
  const Scan a = scan(RayCaster(mesh), s, T, 3, "");
  const Scan b = scan(RayCaster(moved), s, motion * T, 3, "");
  ASSERT_EQ(a.cloud.points.size(), b.cloud.points.size());
  std::size_t other_triangle = 0;
  for (std::size_t i = 0; i < a.range.size(); ++i) {
    ASSERT_EQ(a.ring[i], b.ring[i]);
    ASSERT_NEAR(a.true_range[i], b.true_range[i], 1e-4);
    if (a.triangle[i] != b.triangle[i]) {
      ++other_triangle;
      continue;
    }
    ASSERT_LT((a.cloud.points[i] - b.cloud.points[i]).norm(), 1e-4);
    ASSERT_LT((a.true_normal[i] - b.true_normal[i]).norm(), 1e-5);
  }
  EXPECT_LE(other_triangle, a.range.size() / 1000);  // rays within 1e-6 m of an edge
}

// Every array, so that a forgotten one shows.
void expect_same_bytes(const Scan& a, const Scan& b) {
  EXPECT_EQ(a.cloud.points, b.cloud.points);
  EXPECT_EQ(a.intensity, b.intensity);
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.ring, b.ring);
  EXPECT_EQ(a.column, b.column);
  EXPECT_EQ(a.range, b.range);
  EXPECT_EQ(a.true_range, b.true_range);
  EXPECT_EQ(a.incidence, b.incidence);
  EXPECT_EQ(a.true_normal, b.true_normal);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.material, b.material);
  EXPECT_EQ(a.flags, b.flags);
  EXPECT_EQ(a.true_point, b.true_point);
  EXPECT_EQ(a.echo, b.echo);
  EXPECT_EQ(a.beams, b.beams);
}

Scan scan_of_a_cave(int threads, std::uint64_t seed) {
  const ThreadLimit limit(threads);
  Scanner s = find_scanner("optab-yawing");
  s.plane_beams = 203;
  s.planes = 101;
  s.min_amplitude = 0.19;  // so that many beams are dropped
  return scan(RayCaster(cave(12, 6, 0.004)), s, some_pose(), seed, "cave");
}

TEST(Scan, IsTheSameForAnyNumberOfThreads) {
  const Scan one = scan_of_a_cave(1, 5);
  EXPECT_LT(one.range.size(), one.beams);
  EXPECT_GT(one.range.size(), one.beams / 2);
  expect_same_bytes(one, scan_of_a_cave(2, 5));
  expect_same_bytes(one, scan_of_a_cave(4, 5));
}

TEST(Scan, DependsOnTheSeed) {
  const Scan a = scan_of_a_cave(2, 5);
  const Scan b = scan_of_a_cave(2, 6);
  EXPECT_NE(a.range, b.range);
  EXPECT_NE(a.true_range, b.true_range);  // jitter
}

TEST(Scan, ListsPointsInTheOrderOfTimeAndOnlyThoseWithReturn) {
  const Scan result = scan_of_a_cave(2, 5);
  ASSERT_EQ(result.beams, 203u * 101u);
  for (std::size_t i = 0; i < result.range.size(); ++i) {
    if (i > 0) {
      ASSERT_LT(result.time[i - 1], result.time[i]);
    }
    ASSERT_DOUBLE_EQ(result.time[i], 40e-6 * (203.0 * result.column[i] + result.ring[i]));
    ASSERT_GE(result.intensity[i], 0.19f);
  }
}

TEST(Scan, DropsSurfacesOutsideTheRangeLimitsWithoutLookingThroughThem) {
  // A small box inside a large one: nothing of either is seen through the near wall.
  TriangleMesh mesh = box({1, 1, 1});
  const TriangleMesh outer = box({10, 10, 10});
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), outer.vertices.begin(), outer.vertices.end());
  for (const auto& t : outer.triangles)
    mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  mesh = with_material(mesh, 0.5);
  Scanner s = ideal(40, 40);
  s.min_range = 2;
  EXPECT_TRUE(scan(RayCaster(mesh), s, Pose::Identity(), 0, "").range.empty());
  s.range_noise = 1;  // too near to be measured at all, whatever the noise would make of it
  EXPECT_TRUE(scan(RayCaster(mesh), s, Pose::Identity(), 0, "").range.empty());
  s.range_noise = 0;

  s.min_range = 0.1;
  s.max_range = 1.2;
  const Scan result = scan(RayCaster(mesh), s, Pose::Identity(), 0, "");
  EXPECT_EQ(result.beams, 1600u);
  EXPECT_LT(result.range.size(), 1600u);
  EXPECT_GT(result.range.size(), 100u);
  for (const double range : result.range) EXPECT_LE(range, 1.2);
}

// Straight up at a flat ceiling, R cos(mirror angle) is its height: ranges tell the true angle.
TEST(Scan, TurnsTheTrueBeamAndKeepsPointsOnTheNominalOne) {
  const RayCaster caster(box({30, 30, 5}));
  Scanner s = ideal(1, 20000);
  s.plane_field = 90 * degree;  // one beam, in the middle
  s.motion_start = s.motion_end = 0;
  const Pose T(
      Eigen::AngleAxisd(45 * degree, Vector3d::UnitY()));  // hits the ceiling at 45 degrees
  const auto angles = [&](const Scan& result) {
    std::vector<double> list;
    for (std::size_t i = 0; i < result.range.size(); ++i) {
      EXPECT_TRUE(result.cloud.points[i].isApprox(result.range[i] * Vector3d::UnitZ(), 1e-7));
      list.push_back(std::acos(5 / result.true_range[i]) - 45 * degree);
    }
    EXPECT_EQ(list.size(), 20000u);
    return list;
  };

  s.index_error = 0.01;
  for (const double angle : angles(scan(caster, s, T, 1, ""))) ASSERT_NEAR(angle, 0.01, 1e-12);

  s.encoder_jitter = 0.001;
  double sum = 0;
  double squares = 0;
  for (const double angle : angles(scan(caster, s, T, 1, ""))) {
    sum += angle - 0.01;
    squares += (angle - 0.01) * (angle - 0.01);
  }
  // Standard errors of 20 000 samples: 1 / 141 of sigma for the mean, 1 / 200 for sigma; times 4.
  EXPECT_NEAR(sum / 20000, 0, 4 * 0.001 / 141);
  EXPECT_NEAR(std::sqrt(squares / 20000), 0.001, 4 * 0.001 / 200);
}

TEST(Scan, WobbleTurnsBeamsOutOfTheirPlane) {
  const RayCaster caster(box({30, 5, 30}));
  Scanner s = ideal(1, 1);
  s.motion_start = s.motion_end = 0;
  s.wobble = 0.01;
  // A plane x, z that leans by 30 degrees to the wall at y = 5; its one beam is at the mirror angle
  // 0, where wobble * sin vanishes, and with three beams at -90, 0 and 90 degrees.
  const Pose T(Eigen::AngleAxisd(30 * degree, Vector3d::UnitZ()));
  s.plane_beams = 3;
  s.plane_field = 270 * degree;
  const Scan result = scan(caster, s, T, 1, "");
  ASSERT_EQ(result.range.size(), 3u);
  // At 90 degrees the beam is (cos, sin, 0) of wobble in the scanner frame, so 30 degrees + wobble
  // in the world; at -90 degrees the opposite turn of the opposite direction.
  EXPECT_NEAR(result.true_range[2], 5 / std::sin(30 * degree + 0.01), 1e-12);
  EXPECT_NEAR(result.true_range[0], 5 / std::sin(30 * degree + 0.01), 1e-12);
  EXPECT_NEAR(result.true_range[1], 30, 1e-12);
}

// The whole path: residuals divided by the sigma of the stated law have spread 1, in a room with
// all ranges and incidences.
TEST(Scan, NoiseFollowsTheStatedLaw) {
  Scanner pulse = ideal(200, 200);
  pulse.range_noise = 0.004;
  pulse.range_noise_growth = 0.0008;
  Scanner phase = pulse;
  phase.ranging = RangingKind::phase;
  phase.tones = {8, 80};
  phase.defocus_range = 0.5;  // 1 / R^2 in all the room
  for (const Scanner& s : {pulse, phase}) {
    const Scan result = scan(RayCaster(box({12, 8, 3}, 3, 0.3)), s, some_pose(), 21, "");
    double n = 0, sum = 0, squares = 0;
    for (std::size_t i = 0; i < result.range.size(); ++i) {
      const double R = result.true_range[i];
      if (!(R > 2)) continue;  // (1 - exp(-x)) / x = 1 - x / 2, x = (0.5 / R)^2: within 3 %
      const double growth = 0.0008 * R;
      const double sigma =
          s.ranging == RangingKind::pulse
              ? 0.004 + growth
              : std::sqrt(0.004 * 0.004 + growth * growth / (0.3 * std::cos(result.incidence[i])));
      const double residual = (result.range[i] - R) / sigma;
      n += 1;
      sum += residual;
      squares += residual * residual;
    }
    EXPECT_GT(n, 30000);
    EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
    // And the 3 % of the variance's second part.
    EXPECT_NEAR(squares / n, 1, 4 * std::sqrt(2 / n) + 0.01);
  }
}

TEST(Scan, OfAWetSurfaceReceivesHalfTheLight) {
  TriangleMesh mesh = box({8, 6, 4}, 5, 0.4);
  const Scanner s = ideal(57, 43);
  const Scan dry = scan(RayCaster(mesh), s, some_pose(), 7, "");
  mesh.materials[0].wetness = 1;
  const Scan wet = scan(RayCaster(mesh), s, some_pose(), 7, "");
  ASSERT_EQ(wet.intensity.size(), dry.intensity.size());
  for (std::size_t i = 0; i < dry.intensity.size(); ++i)
    ASSERT_EQ(wet.intensity[i], dry.intensity[i] / 2);
  EXPECT_EQ(wet.range, dry.range);
}

TriangleMesh rough(TriangleMesh mesh, double roughness, double fine_slope) {
  mesh.materials[0].roughness = roughness;
  mesh.materials[0].fine_slope = fine_slope;
  return mesh;
}

// One wall after the other of a box from far away, nearly at right angles, with 90 000 beams over
// 16 x 16 m of it. A wave of the relief is 0.21 m long, so the wall has some 30 000 cells of the
// noise: the relative error of a variance is about sqrt(2 / 30 000) = 0.8 %, that of a deviation
// half of it, and neighbouring cells depend on each other; 2 %.
TEST(FineRelief, HasTheStatedHeightsAndSlopes) {
  const double r = 0.01, slope = 0.3;
  const TriangleMesh flat = box({40, 40, 40});
  const RayCaster caster(rough(flat, r, slope));
  Scanner s = ideal(300, 300);
  s.motion = Motion::pitch;
  s.plane_field = 0.4;
  s.motion_start = -0.2;
  s.motion_end = 0.2;
  const Directions direction_of(s);
  for (const Pose& T : {Pose::Identity(), Pose(Eigen::AngleAxisd(90 * degree, Vector3d::UnitZ())),
                        Pose(Eigen::AngleAxisd(90 * degree, Vector3d::UnitY())), some_pose()}) {
    const Scan result = scan(caster, s, T, 1, "");
    ASSERT_EQ(result.range.size(), 90000u);
    EXPECT_EQ(result.range, result.true_range);  // measured is the truth, relief included
    double n = 0, heights = 0, height_squares = 0, slope_squares = 0;
    for (std::size_t i = 0; i < 90000; ++i) {
      const Vector3d direction =
          T.linear() * direction_of(static_cast<int>(i % 300), static_cast<int>(i / 300));
      const auto [range, wall] = box_hit({40, 40, 40}, T.translation(), direction);
      const double cosine = -wall.dot(direction);
      if (!(cosine > 0.9)) continue;  // of the last pose: another wall
      const double height = (range - result.true_range[i]) * cosine;
      const Vector3d normal = T.linear() * result.true_normal[i].cast<double>();
      EXPECT_NEAR(normal.norm(), 1, 1e-6);  // single precision, as the next
      EXPECT_NEAR(std::cos(result.incidence[i]), -normal.dot(direction), 1e-6);
      const double along = normal.dot(wall);
      n += 1;
      heights += height;
      height_squares += height * height;
      slope_squares += (normal - along * wall).squaredNorm() / (along * along);
    }
    ASSERT_GT(n, 50000);
    EXPECT_NEAR(heights / n, 0, 0.02 * r);
    EXPECT_NEAR(std::sqrt(height_squares / n) / r, 1, 0.02);
    // Two directions in the wall.
    EXPECT_NEAR(std::sqrt(slope_squares / n / 2) / slope, 1, 0.02);
  }
}

// A scanner of one beam, and the pose at `place` from which it meets `target`.
Scan scan_of_a_spot(const RayCaster& caster, const Vector3d& place, const Vector3d& target,
                    std::uint64_t seed) {
  Scanner s = ideal(1, 1);
  s.motion = Motion::pitch;
  s.motion_start = s.motion_end = 0;
  s.min_range = 0.1;
  const Pose T = Eigen::Translation3d(place) *
                 Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), target - place);
  return scan(caster, s, T, seed, "");
}

// The height that a scan of one spot of the floor at z = -5 m has seen there.
double height_of(const Scan& spot, const Vector3d& place, const Vector3d& target) {
  const Vector3d direction = (target - place).normalized();
  return ((target - place).norm() - spot.true_range.at(0)) * -direction.z();
}

TEST(FineRelief, IsTheSameStoneFromEverywhere) {
  const RayCaster caster(rough(box({30, 30, 5}), 0.01, 0.3));
  double largest = 0;
  int facing_both = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    Random random(5, i);
    const Vector3d target(6 * random.uniform(), 6 * random.uniform(), -5);
    const Vector3d left(-3, 1, 0), right(8, -4, 1);
    const Scan a = scan_of_a_spot(caster, left, target, 1);
    const Scan b = scan_of_a_spot(caster, right, target, 2);
    const double height = height_of(a, left, target);
    // Rounding: 1e-15 of 10 m.
    ASSERT_NEAR(height, height_of(b, right, target), 1e-12);
    largest = std::max(largest, std::abs(height));
    // A side that faces away from one of them is turned to it.
    if (std::max(a.incidence[0], b.incidence[0]) > 80 * degree) continue;
    ++facing_both;
    const Vector3d normal_a = a.T_world_scanner.linear() * a.true_normal[0].cast<double>();
    const Vector3d normal_b = b.T_world_scanner.linear() * b.true_normal[0].cast<double>();
    ASSERT_LT((normal_a - normal_b).norm(), 3e-7);  // single precision
  }
  EXPECT_GT(facing_both, 400);
  EXPECT_GT(largest, 0.02);  // there is something to see

  // The tilt is the slope of the heights: the difference of two spots 1e-5 m to each side, off by
  // 1e-10 m^2 times a third derivative of order r (2 pi / 0.2 m)^3, and 1e-7 of the normal.
  const Vector3d eye(0, 0, 0);
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(6, i);
    const Vector3d target(2 * random.uniform(), 2 * random.uniform(), -5);
    const Scan here = scan_of_a_spot(caster, eye, target, 1);
    const Vector3d normal = here.T_world_scanner.linear() * here.true_normal[0].cast<double>();
    for (int axis = 0; axis < 2; ++axis) {
      const auto at = [&](double step) {
        const Vector3d there = target + step * Vector3d::Unit(axis);
        return height_of(scan_of_a_spot(caster, eye, there, 1), eye, there);
      };
      ASSERT_NEAR(-normal[axis] / normal.z(), (at(1e-5) - at(-1e-5)) / 2e-5, 1e-6);
    }
  }
}

TEST(FineRelief, IsNoneWhenSwitchedOffOrWithoutHeightOrSlope) {
  const TriangleMesh flat = cave(12, 4, 0.05);
  Scanner s = find_scanner("optab-yawing");
  s.plane_beams = 100;
  s.planes = 90;
  const Scan expected = scan(RayCaster(flat), s, some_pose(), 3, "");
  expect_same_bytes(expected, scan(RayCaster(rough(flat, 0, 0.3)), s, some_pose(), 3, ""));
  expect_same_bytes(expected, scan(RayCaster(rough(flat, 0.01, 0)), s, some_pose(), 3, ""));
  const RayCaster stone(rough(flat, 0.01, 0.3));
  EXPECT_NE(scan(stone, s, some_pose(), 3, "").true_range, expected.true_range);
  const Scanner off = with_settings(s, {{"fine-relief", "false"}});
  expect_same_bytes(expected, scan(stone, off, some_pose(), 3, ""));
}

// On the materials that have it and no other.
TEST(FineRelief, BelongsToTheMaterial) {
  TriangleMesh mesh = box({6, 5, 3}, 4);
  const Scan expected = scan(RayCaster(mesh), ideal(60, 50), some_pose(), 3, "");
  mesh.materials.push_back({.name = "stone", .roughness = 0.005, .fine_slope = 0.2});
  for (std::size_t i = 0; i < mesh.material.size(); i += 3) mesh.material[i] = 1;
  const Scan result = scan(RayCaster(mesh), ideal(60, 50), some_pose(), 3, "");
  ASSERT_EQ(result.range.size(), expected.range.size());
  std::size_t stone = 0;
  for (std::size_t i = 0; i < result.range.size(); ++i) {
    EXPECT_EQ(result.true_range[i] != expected.true_range[i], result.material[i] == 1);
    stone += result.material[i] == 1;
  }
  EXPECT_GT(stone, 500u);
}

// Along a floor, down to 0.3 degrees.
TEST(FineRelief, StaysWithinBoundsAtGrazingIncidence) {
  const double r = 0.02, slope = 0.5;
  const double reach = fine_relief_reach * 2 * std::numbers::pi * r / slope;
  const TriangleMesh flat = box({90, 90, 0.5});
  Scanner s = ideal(200, 200);
  const Scan expected = scan(RayCaster(flat), s, Pose::Identity(), 3, "");
  const Scan result = scan(RayCaster(rough(flat, r, slope)), s, Pose::Identity(), 3, "");
  const Directions direction_of(s);
  std::size_t grazing = 0;
  std::size_t other = 0;  // index in `expected`; relief loses beams beyond the limits of the range
  for (std::size_t i = 0; i < result.range.size(); ++i, ++other) {
    while (expected.time[other] < result.time[i]) ++other;
    ASSERT_EQ(expected.time[other], result.time[i]);
    ASSERT_LE(std::abs(result.true_range[i] - expected.true_range[other]), reach * (1 + 1e-9));
    ASSERT_LT(result.incidence[i], 90 * degree);
    ASSERT_NEAR(result.true_normal[i].norm(), 1, 1e-6f);
    const Vector3d direction =
        direction_of(static_cast<int>(result.ring[i]), static_cast<int>(result.column[i]));
    ASSERT_LT(result.true_normal[i].cast<double>().dot(direction), 0);
    grazing += expected.incidence[other] > 85 * degree;
  }
  EXPECT_GT(grazing, 500u);
  EXPECT_GT(result.range.size(), expected.range.size() * 9 / 10);
}

TEST(FineRelief, IsTheSameForAnyNumberOfThreads) {
  const RayCaster caster(rough(cave(12, 4, 0.05), 0.01, 0.3));
  const auto with_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    return scan(caster, ideal(101, 53), some_pose(), 3, "");
  };
  expect_same_bytes(with_threads(1), with_threads(4));
}

std::string message_of(const Scanner& s, const Pose& T = Pose::Identity()) {
  static const RayCaster caster(box({5, 5, 5}));
  try {
    scan(caster, s, T, 0, "");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

// Along x and turning about z, both evenly: the place of every beam is known.
TEST(Scan, OfAMovingScannerCastsEveryBeamFromWhereItIs) {
  const Vector3d half(12, 8, 4);
  const RayCaster caster(box(half.cast<float>(), 5, 0.4));
  const double speed = 0.8, turning = 0.3;
  const auto pose_at = [&](double t) -> Pose {
    return Eigen::Translation3d(-2 + speed * t, 0.5, 0.25) *
           Eigen::AngleAxisd(turning * t, Vector3d::UnitZ());
  };
  Trajectory trajectory;
  for (int k = 0; k <= 30; ++k) {
    trajectory.times.push_back(0.25 * k);
    trajectory.poses.push_back(pose_at(0.25 * k));
  }
  Scanner s = ideal(40, 30);
  s.turn_time = 0.2;  // 6 s
  s.lever = {0.1, 0, 0.2};
  const Kinematics kinematics(s);
  const double start = 1.1;
  const Scan result = scan(caster, s, SmoothPath(trajectory), start, 1, "");
  EXPECT_TRUE(result.T_world_scanner.isApprox(pose_at(start), 1e-9));
  ASSERT_EQ(result.range.size(), 1200u);
  double farthest = 0;
  for (std::size_t i = 0; i < result.range.size(); ++i) {
    const Beam beam = kinematics.nominal(kinematics.plane(static_cast<int>(result.column[i]), 0),
                                         static_cast<int>(result.ring[i]));
    const Pose T = pose_at(start + result.time[i]);
    const Vector3d origin = T * beam.origin, direction = T.linear() * beam.direction;
    const auto [range, normal] = box_hit(half, origin, direction);
    // Smooth paths are exact for even motion; at the edges of the box Embree may take the other
    // face, within single precision.
    ASSERT_NEAR(result.true_range[i], range, 1e-5);
    // True points are on the wall; measured ones where they would be without the motion.
    const Vector3d truth = result.T_world_scanner * result.true_point[i].cast<double>();
    ASSERT_LT((truth - (origin + range * direction)).norm(), 2e-5);
    const Vector3d still = beam.origin + result.range[i] * beam.direction;
    ASSERT_LT((result.cloud.points[i] - still).norm(), 2e-6);
    farthest =
        std::max(farthest, (result.cloud.points[i] - result.true_point[i].cast<double>()).norm());
  }
  EXPECT_GT(farthest, 5);  // 1.8 rad off at the end
  EXPECT_THROW(scan(caster, s, SmoothPath(trajectory), 1.6, 1, ""), std::invalid_argument);
}

TEST(Scan, OfAScannerAtRestOnAPathIsThatFromItsPlace) {
  const RayCaster caster(cave(9, 4, 0.05));
  Scanner s = find_scanner("optab-yawing");
  s.plane_beams = 50;
  s.planes = 40;
  const Trajectory rest{.times = {0, 5, 10}, .poses = {some_pose(), some_pose(), some_pose()}};
  const Scan a = scan(caster, s, some_pose(), 4, "");
  const Scan b = scan(caster, s, SmoothPath(rest), 0, 4, "");
  ASSERT_EQ(a.range.size(), b.range.size());
  for (std::size_t i = 0; i < a.range.size(); ++i)
    ASSERT_NEAR(a.true_range[i], b.true_range[i], 1e-4);
}

// A post half-way between scanner and wall, and beams 2 cm wide that meet its edge.
TEST(Footprint, EdgesGiveMixedPixels) {
  TriangleMesh mesh = box({10, 10, 10});
  TriangleMesh post = box({0.2f, 0.2f, 9});
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (Eigen::Vector3f v : post.vertices) mesh.vertices.push_back(v + Eigen::Vector3f(5, 0, 0));
  for (const auto& t : post.triangles)
    mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  const RayCaster caster(with_material(mesh, 0.5));
  Scanner s = ideal(400, 10);
  s.motion = Motion::pitch;
  s.plane_field = 0.2;
  s.motion_start = -0.05;
  s.motion_end = 0.05;
  s.spot = 0.02;
  s.pulse_length = 20;
  const auto mixed = [&](int sub_rays, bool edge_test) {
    s.sub_rays = sub_rays;
    s.edge_test = edge_test;
    const Scan result = scan(caster, s, Pose::Identity(), 1, "");
    EXPECT_EQ(result.range.size(), 4000u);
    int count = 0, between = 0;
    for (std::size_t i = 0; i < result.range.size(); ++i) {
      const bool is_mixed = (result.flags[i] & flag_mixed_pixel) != 0;
      count += is_mixed;
      between += result.range[i] > 5.1 && result.range[i] < 9.7;
      if (is_mixed) {
        EXPECT_LT(
            std::abs(std::abs(5 * result.cloud.points[i].y() / result.cloud.points[i].x()) - 0.2),
            0.02);
      }
    }
    EXPECT_EQ(between > 0, sub_rays > 1);
    return count;
  };
  EXPECT_EQ(mixed(1, true), 0);
  // Two edges; each is within the footprint's radius of 1 cm over 2 cm of 5 m * 0.2 / 400 = 2.5 mm
  // wide steps: 8 beams or so in each of 10 planes.
  const int all = mixed(19, false);
  EXPECT_NEAR(all, 160, 20);
  EXPECT_EQ(mixed(19, true), all);
}

// Two returns of one beam: each has the truth of the surface that it came from, relief included, so
// that without noise measured and true ranges differ by the footprint's slope alone.
TEST(Footprint, EveryReturnHasTheTruthOfItsOwnSurface) {
  TriangleMesh mesh = box({10, 10, 10});
  const TriangleMesh post = box({0.2f, 0.2f, 9});
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3f& v : post.vertices)
    mesh.vertices.push_back(v + Eigen::Vector3f(5, 0, 0));
  for (const auto& t : post.triangles)
    mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  mesh = with_material(mesh, 0.5);
  mesh.materials[0].roughness = 0.02;
  mesh.materials[0].fine_slope = 0.1;
  const RayCaster caster(mesh);
  Scanner s = ideal(400, 10);
  s.motion = Motion::pitch;
  s.plane_field = 0.2;
  s.motion_start = -0.05;
  s.motion_end = 0.05;
  s.spot = 0.02;
  s.sub_rays = 19;
  s.returns = 2;
  const Scan result = scan(caster, s, Pose::Identity(), 1, "");
  int second = 0;
  for (std::size_t i = 0; i < result.range.size(); ++i) {
    second += result.echo[i] == 2;
    // Directions 0.1 rad off the walls' normals over 1 cm.
    EXPECT_NEAR(result.range[i], result.true_range[i], 0.002);
    EXPECT_NEAR(result.true_point[i].norm(), result.true_range[i], 0.0002);  // spot / 2 aside
  }
  EXPECT_GT(second, 50);
  EXPECT_GT(result.range.size(), 4050u);
}

TEST(Air, SwallowsBeams) {
  const RayCaster caster(sphere(10, 5));
  Scanner s = ideal(200, 200);
  s.dust_loss = 0.05;
  const auto kept = static_cast<double>(scan(caster, s, Pose::Identity(), 1, "").range.size());
  // exp(-0.5) of 40 000, one sigma is 98; the sphere's facets are up to 0.2 % nearer.
  EXPECT_NEAR(kept, 40000 * std::exp(-0.5), 4 * 98 + 30);
  s.dust_loss = 0;
  s.min_amplitude = 0.1;
  EXPECT_EQ(scan(caster, s, Pose::Identity(), 1, "").range.size(), 40000u);
  s.fog_extinction = 0.1;  // amplitude 0.28 exp(-2) = 0.04
  EXPECT_TRUE(scan(caster, s, Pose::Identity(), 1, "").range.empty());
}

TEST(Scan, RejectsScannersThatCannotBe) {
  Scanner s = ideal(0, 10);
  EXPECT_NE(message_of(s).find("plane-beams"), std::string::npos) << message_of(s);
  s = ideal(1000000, 1000);  // 1e9 beams
  EXPECT_EQ(message_of(s),
            "scanner 'ideal-yawing': expected plane-beams * planes * returns <= 100000000, found "
            "1000000000");
  s = ideal(10, 10);
  s.range_noise = -1;
  EXPECT_NE(message_of(s).find("range-noise"), std::string::npos);
  s.range_noise = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message_of(s).find("range-noise"), std::string::npos);
  s = ideal(10, 10);
  s.min_range = s.max_range;
  EXPECT_NE(message_of(s).find("min-range < max-range"), std::string::npos);
  const auto phase = [](std::vector<double> tones) {
    Scanner p = ideal(10, 10);
    p.ranging = RangingKind::phase;
    p.tones = std::move(tones);
    return p;
  };
  EXPECT_EQ(message_of(phase({})),
            "scanner 'ideal-yawing': phase ranging needs 1 to 4 tones, found 0");
  EXPECT_EQ(message_of(phase({5, 4})),
            "scanner 'ideal-yawing': expected tones from the finest to the coarsest, found 5 "
            "before 4");
  s = phase({1, 1000});
  s.amplitude_noise = 0.01;
  EXPECT_EQ(message_of(s),
            "scanner 'ideal-yawing': the tone of 1000 m cannot tell the periods of the one of 1 m: "
            "even on a white plate it errs by 1.59 m, expected less than half of 1 m");
  s = phase({1, 1000});
  s.phase_bits = 8;
  EXPECT_NE(message_of(s).find("with 8 phase-bits its steps are 3.91 m"), std::string::npos)
      << message_of(s);
  s = phase({4, 40});
  s.tone_depths = {1};
  EXPECT_NE(message_of(s).find("as many tone-depths as tones, 2, found 1"), std::string::npos);
  s = phase({4, 40});
  s.returns = 2;
  EXPECT_NE(message_of(s).find("phase ranging has one return"), std::string::npos);
  s = ideal(10, 10);
  s.sub_rays = 5;
  EXPECT_NE(message_of(s).find("sub-rays 1, 7 or 19, found 5"), std::string::npos);
  s = find_scanner("flash-3d");
  s.wobble = 0.01;
  EXPECT_EQ(message_of(s), "scanner 'flash-3d': wobble belongs to a mirror; this pattern has none");
  s = find_scanner("rosette");
  s.wedge_1 = 0.6;
  s.wedge_2 = 0.6;
  EXPECT_NE(message_of(s).find("reflect the light"), std::string::npos);

  Pose T = Pose::Identity();
  T.translation().x() = std::numeric_limits<double>::infinity();
  EXPECT_NE(message_of(ideal(10, 10), T).find("T_world_scanner"), std::string::npos);
  T = Pose::Identity();
  T.linear() *= 2;
  EXPECT_NE(message_of(ideal(10, 10), T).find("T_world_scanner"), std::string::npos);

  EXPECT_THROW(with_settings(ideal(10, 10), {{"plane-beams", "0"}}), std::invalid_argument);
  EXPECT_THROW(with_settings(ideal(10, 10), {{"plane-beams", "1e9"}}), std::invalid_argument);
}

TEST(Scanners, AreKnownByNameAndEachOfThemScans) {
  const RayCaster caster(box({6, 5, 3}));
  for (const Scanner& row : scanners()) {
    SCOPED_TRACE(row.name);
    EXPECT_FALSE(row.description.empty());
    EXPECT_EQ(&find_scanner(row.name), &row);
    EXPECT_NO_THROW(check(row));
    Scanner s = row;
    s.plane_beams = 24;
    s.planes = 18;
    const Scan result = scan(caster, s, Pose::Identity(), 1, "box");
    EXPECT_GT(result.range.size(), 24u * 18u * 9 / 10);
  }
  try {
    find_scanner("optab");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "unknown scanner 'optab'; known: optab-yawing, optab-pitching, sick-lms200-ptu, "
                 "tls-phase, flash-3d, spin-16, spin-128, rosette, ideal-yawing");
  }
}

}  // namespace
}  // namespace minescan
