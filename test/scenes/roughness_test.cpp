// SPDX-License-Identifier: MIT
#include "scenes/roughness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "core/random.h"

namespace minescan {
namespace {

Eigen::Vector3d random_place(Random& random, double size) {
  const double x = random.uniform(), y = random.uniform(), z = random.uniform();
  return size * (Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(0.5));
}

Eigen::Vector3d random_direction(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

TEST(Relief, HasTheStatedRms) {
  for (const ReliefBand& band : {ReliefBand{}, ReliefBand{.rms = 0.015, .hurst = 0.5},
                                 ReliefBand{.rms = 0.2, .hurst = 1, .inner = 0.5, .outer = 4}}) {
    const Relief relief(band, 11, 0);
    Random random(3, 0);
    const int n = 100000;
    double squares = 0;
    for (int i = 0; i < n; ++i) {
      const double h = relief.at(random_place(random, 1e4));
      EXPECT_LE(std::abs(h), relief.bound());
      squares += h * h;
    }
    // Independent places: sqrt(2 / n) / 2 = 0.2 %; four times that.
    EXPECT_NEAR(std::sqrt(squares / n) / band.rms, 1, 0.01);
  }
}

/// Power spectral density of profiles along random lines at wavelength L (any unit).
double density(const Relief& relief, double wavelength) {
  Random random(4, 0);
  const int lines = 150, samples = 256;
  const double step = wavelength / 16;  // 16 wavelengths long, sampled 16 times each
  double sum = 0;
  for (int line = 0; line < lines; ++line) {
    const Eigen::Vector3d start = random_place(random, 1e4);
    const Eigen::Vector3d along = random_direction(random);
    std::complex<double> amplitude = 0;
    for (int i = 0; i < samples; ++i) {
      // Hann window: longer wavelengths, which are much stronger, must not leak in.
      const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (i + 0.5) / samples);
      amplitude += window * relief.at(start + i * step * along) *
                   std::polar(1.0, -2 * std::numbers::pi * i / 16);
    }
    sum += std::norm(amplitude) * step;
  }
  return sum / lines;
}

TEST(Relief, HasTheSpectrumOfItsHurstExponent) {
  for (const double hurst : {0.4, 0.75}) {
    const Relief relief({.rms = 0.07, .hurst = hurst, .inner = 0.05, .outer = 20}, 12, 0);
    // Slope of a straight line through the logarithms, well inside the band.
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    int n = 0;
    for (double wavelength = 0.25; wavelength < 5; wavelength *= std::sqrt(2.0)) {
      const double x = std::log(1 / wavelength);
      const double y = std::log(density(relief, wavelength));
      sx += x;
      sy += y;
      sxx += x * x;
      sxy += x * y;
      ++n;
    }
    const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    // Each density has a relative error of 1 / sqrt(150) = 8 %, over a range of 3 in the logarithm:
    // 0.03; the steps between octaves add about as much.
    EXPECT_NEAR(slope, -(1 + 2 * hurst), 0.1) << "H " << hurst;
  }
}

TEST(Relief, RangeEnclosesAllHeightsNearby) {
  const Relief relief({.rms = 0.1, .hurst = 0.6}, 13, 0);
  Random random(5, 0);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d centre = random_place(random, 100);
    const double radius = std::pow(10, -3 + 4 * random.uniform());
    const Interval range = relief.range(centre, radius);
    const double height = relief.at(centre + radius * random.uniform() * random_direction(random));
    EXPECT_LE(range.low, height);
    EXPECT_GE(range.high, height);
  }
}

TEST(Relief, KeepsItsLongWavesWhenShortOnesAreLeftOut) {
  const ReliefBand band{.rms = 0.1, .hurst = 0.75, .inner = 0.05, .outer = 10};
  const Relief all(band, 14, 0);
  const Relief coarse(band, 14, 1.0);  // keeps 10, 5, 2.5 and 1.25 m of 8 octaves
  Random random(6, 0);
  const int n = 20000;
  double squares = 0;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d p = random_place(random, 1e4);
    squares += std::pow(all.at(p) - coarse.at(p), 2);
  }
  // Octave k has variance ~ q^k with q = 2^(-2 H).
  const double q = std::pow(2, -1.5);
  const double expected = 0.1 * std::sqrt((std::pow(q, 4) - std::pow(q, 8)) / (1 - std::pow(q, 8)));
  EXPECT_NEAR(std::sqrt(squares / n) / expected, 1, 0.03);
}

TEST(Relief, DiffersBetweenSeedsOnly) {
  const Eigen::Vector3d p(1.23, 4.56, 7.89);
  EXPECT_EQ(Relief({}, 1, 0).at(p), Relief({}, 1, 0).at(p));
  EXPECT_NE(Relief({}, 1, 0).at(p), Relief({}, 2, 0).at(p));
}

TEST(Relief, OfNoAmplitudeIsFlat) {
  const Relief relief({.rms = 0}, 1, 0);
  EXPECT_EQ(relief.bound(), 0);
  EXPECT_EQ(relief.at({1, 2, 3}), 0);
}

TEST(Relief, RefusesAnEmptyBand) {
  EXPECT_THROW(Relief({.inner = 2, .outer = 1}, 1, 0), std::invalid_argument);
  EXPECT_THROW(Relief({.inner = 0, .outer = 1}, 1, 0), std::invalid_argument);
  EXPECT_THROW(Relief({.inner = std::nan(""), .outer = 1}, 1, 0), std::invalid_argument);
}

TEST(Bedding, HasThreeLevelsOnPlatesOfTheStatedSize) {
  const Bedding bedding(0.04, 2.5, 21);
  Random random(7, 0);
  std::array<int, 3> counts = {};
  int steps = 0;
  const int n = 30000;
  const double gap = 0.05;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d p = random_place(random, 1e4);
    const double height = bedding.range(p, 0).low;
    const double level = height / 0.04;
    ASSERT_EQ(level, std::round(level));
    ++counts.at(static_cast<std::size_t>(level));
    if (bedding.range(p + Eigen::Vector3d(gap, 0, 0), 0).low != height) ++steps;
    const double radius = 2 * random.uniform();
    const Interval range = bedding.range(p, radius);
    const double near = bedding.range(p + radius * random_direction(random), 0).low;
    EXPECT_LE(range.low, near);
    EXPECT_GE(range.high, near);
  }
  // Binomial with p = 1/3: one sigma is 0.27 % of n; four of them.
  for (const int count : counts) EXPECT_NEAR(static_cast<double>(count) / n, 1.0 / 3, 0.011);
  // Cells of a jittered grid are cut by a line at least once per plate, by a Poisson-Voronoi
  // pattern 4 / pi times; 2 of 3 borders are steps.
  const double per_metre = steps / (n * gap);
  EXPECT_GT(per_metre, 2.0 / 3 / 2.5 * 0.95);
  EXPECT_LT(per_metre, 2.0 / 3 / 2.5 * 4 / std::numbers::pi * 1.05);
}

TEST(Bedding, RefusesSizesThatAreNone) {
  EXPECT_THROW(Bedding(-0.1, 1, 0), std::invalid_argument);
  EXPECT_THROW(Bedding(0.1, 0, 0), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
