// SPDX-License-Identifier: MIT
#include "sim/vector_math.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/gradient_noise.h"
#include "core/random.h"

namespace minescan {
namespace {

using std::numbers::pi;

// Numbers in [low, high], both included; as many as fill lanes.
std::vector<float> numbers(float low, float high) {
  std::vector<float> list;
  constexpr std::size_t count = 6400;
  static_assert(count % lanes == 0);
  for (std::size_t i = 0; i < count; ++i)
    list.push_back(low + (high - low) * static_cast<float>(i) / static_cast<float>(count - 1));
  return list;
}

TEST(VectorMath, SineAndCosineAreThoseOfTheStandardLibrary) {
  for (const float reach : {4.0f, 100.0f, 10000.0f}) {
    const std::vector<float> x = numbers(-reach, reach);
    std::vector<float> sine(x.size()), cosine(x.size());
    sine_cosine(x.data(), sine.data(), cosine.data(), x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const auto angle = static_cast<double>(x[i]);
      ASSERT_NEAR(sine[i], std::sin(angle), 2e-7 + 1e-7 * reach) << angle;
      ASSERT_NEAR(cosine[i], std::cos(angle), 2e-7 + 1e-7 * reach) << angle;
    }
  }
}

TEST(VectorMath, ArcTangentKnowsAllQuadrants) {
  const std::vector<float> angle = numbers(-3.1415925f, 3.1415925f);
  for (const double radius : {1e-20, 1.0, 1e15}) {
    std::vector<float> x, y, result(angle.size());
    for (const float a : angle) {
      x.push_back(static_cast<float>(radius * std::cos(static_cast<double>(a))));
      y.push_back(static_cast<float>(radius * std::sin(static_cast<double>(a))));
    }
    arc_tangent(y.data(), x.data(), result.data(), x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
      ASSERT_NEAR(result[i], std::atan2(static_cast<double>(y[i]), static_cast<double>(x[i])),
                  5e-7);
  }
  Lanes x = {0, 1, -1, 0, 0}, y = {0, 0, 0, 1, -1}, result;
  arc_tangent(y.data(), x.data(), result.data(), lanes);
  EXPECT_EQ(result[0], 0);
  EXPECT_EQ(result[1], 0);
  EXPECT_FLOAT_EQ(result[2], static_cast<float>(pi));
  EXPECT_FLOAT_EQ(result[3], static_cast<float>(pi / 2));
  EXPECT_FLOAT_EQ(result[4], static_cast<float>(-pi / 2));
}

TEST(VectorMath, ArcCosineAndExponentialAreThoseOfTheStandardLibrary) {
  const std::vector<float> x = numbers(-1, 1);
  std::vector<float> result(x.size());
  arc_cosine(x.data(), result.data(), x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    ASSERT_NEAR(result[i], std::acos(static_cast<double>(x[i])), 5e-7);
  for (const float reach : {1e-5f, 1.0f, 80.0f}) {
    const std::vector<float> y = numbers(-reach, reach);
    exponential_minus_1(y.data(), result.data(), y.size());
    for (std::size_t i = 0; i < y.size(); ++i) {
      const double expected = std::expm1(static_cast<double>(y[i]));
      ASSERT_NEAR(result[i], expected, 5e-7 * std::abs(expected));
    }
  }
}

TEST(VectorMath, NormalNumbersComeFromTheStreamsOfRandom) {
  std::array<std::uint64_t, lanes> streams;
  for (std::size_t i = 0; i < lanes; ++i) streams[i] = (i * i << 33) + 17 * i;
  const std::uint64_t seed = 0x123456789abcdef1, block = (1ULL << 34) + 3;
  std::array<Lanes, 4> result;
  four_normals(seed, streams, block, result);
  for (std::size_t i = 0; i < lanes; ++i) {
    Random random(seed, streams[i], block);
    for (std::size_t pair = 0; pair < 2; ++pair) {
      const std::uint64_t bits = random.bits();
      const double u = (static_cast<double>(bits >> 40) + 0.5) * 0x1.0p-24;
      const double v = (static_cast<double>((bits & 0xffffffff) >> 8) + 0.5) * 0x1.0p-24;
      const double radius = std::sqrt(-2 * std::log(u));
      // Single precision: angles up to 6.3 have steps of 5e-7, radii up to 5.9.
      EXPECT_NEAR(result[2 * pair][i], radius * std::cos(2 * pi * v), 4e-6);
      EXPECT_NEAR(result[2 * pair + 1][i], radius * std::sin(2 * pi * v), 4e-6);
    }
  }
}

TEST(VectorMath, NormalNumbersAreStandardNormalAndIndependent) {
  const std::uint64_t count = 102400;
  const double n = static_cast<double>(count);
  std::array<double, 4> mean{}, square{}, fourth{}, beyond{};
  double products = 0;
  for (std::uint64_t first = 0; first < count; first += lanes) {
    std::array<std::uint64_t, lanes> streams;
    for (std::size_t i = 0; i < lanes; ++i) streams[i] = first + i;
    std::array<Lanes, 4> x;
    four_normals(3, streams, 0, x);
    for (std::size_t i = 0; i < lanes; ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        const auto value = static_cast<double>(x[k][i]);
        mean[k] += value / n;
        square[k] += value * value / n;
        fourth[k] += std::pow(value, 4) / n;
        beyond[k] += (value > 1) / n;
      }
      products += static_cast<double>(x[0][i] * x[1][i] + x[0][i] * x[2][i] + x[1][i] * x[3][i]);
    }
  }
  // Four standard errors: variances of x, x^2, x^4 are 1, 2, 96.
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(mean[k], 0, 4 * std::sqrt(1 / n));
    EXPECT_NEAR(square[k], 1, 4 * std::sqrt(2 / n));
    EXPECT_NEAR(fourth[k], 3, 4 * std::sqrt(96 / n));
    EXPECT_NEAR(beyond[k], 0.5 * std::erfc(std::sqrt(0.5)), 4 * std::sqrt(0.134 / n));
  }
  EXPECT_NEAR(products / n, 0, 4 * std::sqrt(3 / n));
}

// Random triangles and rays at them from either side, against the formula written with Eigen.
TEST(VectorMath, RaysMeetPlanesWhereTheFormulaSays) {
  using Eigen::Vector3d;
  for (std::uint64_t trial = 0; trial < 100; ++trial) {
    RayPacket rays;
    Corners corners;
    HitPacket hits;
    std::array<Vector3d, lanes> a, normal, origin, direction;
    for (std::size_t i = 0; i < lanes; ++i) {
      Random random(trial, i);
      const auto vector = [&]() -> Vector3d {
        const double x = random.normal(), y = random.normal(), z = random.normal();
        return Vector3d(x, y, z).cast<float>().cast<double>();
      };
      a[i] = 10 * vector();
      const Vector3d b = a[i] + vector(), c = a[i] + vector();
      origin[i] = 10 * vector();
      direction[i] = ((a[i] + b + c) / 3 - origin[i]).normalized();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        corners.a[k][i] = static_cast<float>(a[i][axis]);
        corners.b[k][i] = static_cast<float>(b[axis]);
        corners.c[k][i] = static_cast<float>(c[axis]);
        a[i][axis] = static_cast<double>(corners.a[k][i]);
      }
      rays.set(i, {origin[i], direction[i]});
      const auto corner = [&](const std::array<Lanes, 3>& p) {
        return Vector3d(static_cast<double>(p[0][i]), static_cast<double>(p[1][i]),
                        static_cast<double>(p[2][i]));
      };
      normal[i] = (corner(corners.b) - a[i]).cross(corner(corners.c) - a[i]).normalized();
      if (normal[i].dot(direction[i]) > 0) normal[i] = -normal[i];
    }
    meet_planes(rays, corners, hits);
    for (std::size_t i = 0; i < lanes; ++i) {
      const Vector3d found = hits.normal.lane(i);
      const double cosine = -normal[i].dot(direction[i]);
      // Rounding of numbers of size 10, magnified where the plane is seen edge-on or the triangle
      // is thin.
      EXPECT_LT((found - normal[i]).norm(), 1e-12);
      EXPECT_NEAR(hits.cosine[i], cosine, 1e-12);
      EXPECT_NEAR(hits.range[i], normal[i].dot(a[i] - origin[i]) / -cosine, 1e-11 / cosine);
    }
  }
}

// Random hits, against the formulas of FineRelief for one, written with Eigen.
TEST(VectorMath, ReliefIsThatOfTheNoiseOneByOne) {
  using Eigen::Vector3d;
  const Eigen::Matrix3d to_lattice =
      7 * Eigen::AngleAxisd(1, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const double height = 0.03, reach = 0.08;
  std::size_t beyond_reach = 0, turned_away = 0;
  for (std::uint64_t trial = 0; trial < 100; ++trial) {
    ReliefNoise relief{.height = height, .reach = reach, .seed = trial};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = 0; l < 3; ++l)
        relief.to_lattice[k][l] =
            to_lattice(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
    RayPacket rays;
    HitPacket hits;
    std::array<bool, lanes> chosen;
    DoubleLanes shift;
    shift.fill(-1);
    std::array<Vector3d, lanes> place, normal, direction;
    for (std::size_t i = 0; i < lanes; ++i) {
      Random random(trial, i);
      const auto vector = [&]() -> Vector3d {
        const double x = random.normal(), y = random.normal(), z = random.normal();
        return {x, y, z};
      };
      place[i] = 20 * vector();
      normal[i] = vector().normalized();
      direction[i] = vector().normalized();
      if (direction[i].dot(normal[i]) > 0) direction[i] = -direction[i];
      rays.set(i, {place[i], direction[i]});
      hits.set(i, {1, 0, -normal[i].dot(direction[i]), normal[i]});
      chosen[i] = (i + trial) % 5 != 0;
    }
    apply_relief(relief, rays, chosen, hits, shift);
    for (std::size_t i = 0; i < lanes; ++i) {
      if (!chosen[i]) {
        EXPECT_EQ(hits.range[i], 0);
        EXPECT_EQ(hits.normal.lane(i), normal[i]);
        EXPECT_EQ(shift[i], -1);
        continue;
      }
      const NoiseSlope noise = gradient_noise_slope(to_lattice * place[i], trial);
      const double cosine = -normal[i].dot(direction[i]);
      const double rise = height * noise.value / cosine;
      beyond_reach += std::abs(rise) > reach;
      Vector3d slope = height * to_lattice.transpose() * noise.slope;
      slope -= slope.dot(normal[i]) * normal[i];
      const double away = -slope.dot(direction[i]);
      turned_away += away > 0.9 * cosine;
      if (away > 0.9 * cosine) slope *= 0.9 * cosine / away;
      const Vector3d tilted = (normal[i] - slope).normalized();
      const Vector3d found = hits.normal.lane(i);
      // Rounding of places of size 7 * 60 in the lattice, 1e-13, times the noise's steepest slope;
      // magnified at grazing incidence.
      EXPECT_NEAR(shift[i], -std::clamp(rise, -reach, reach), 1e-12 / cosine);
      EXPECT_LT((found - tilted).norm(), 1e-11);
      EXPECT_NEAR(hits.cosine[i], -tilted.dot(direction[i]), 1e-11);
    }
  }
  EXPECT_GT(beyond_reach, 20u);
  EXPECT_GT(turned_away, 20u);
}

}  // namespace
}  // namespace minescan
