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

/// One-sided power spectral density of profiles along random lines at wavelength L, m^2 per cycle
/// per metre.
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
  const double squares = 3.0 / 8 * samples;  // of the window
  return 2 * sum / lines / squares;
}

/// Slope of a straight line through the logarithms of densities over frequencies.
double fitted_slope(const Relief& relief, double shortest, double longest) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  int n = 0;
  for (double wavelength = shortest; wavelength <= longest; wavelength *= std::sqrt(2.0)) {
    const double x = std::log(1 / wavelength);
    const double y = std::log(density(relief, wavelength));
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
    ++n;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

TEST(Relief, HasTheSpectrumOfItsHurstExponent) {
  for (const double hurst : {0.4, 0.75}) {
    const Relief relief({.rms = 0.07, .hurst = hurst, .inner = 0.05, .outer = 20}, 12, 0);
    // Well inside the band.
    const double slope = fitted_slope(relief, 0.25, 5);
    // Each density has a relative error of 1 / sqrt(150) = 8 %, over a range of 3 in the logarithm:
    // 0.03; the steps between octaves add about as much.
    EXPECT_NEAR(slope, -(1 + 2 * hurst), 0.1) << "H " << hurst;
  }
}

// The octaves' own spectra are an octave wide, so the knee is round: a factor 2 to 3 to either side
// of it is left out. Tolerance as above.
TEST(Relief, HasTwoHurstExponents) {
  const Relief relief({.rms = 0.07,
                       .hurst = 0.75,
                       .inner = 0.004,
                       .outer = 20,
                       .fine_hurst = 0.5,
                       .fine_below = 0.3},
                      15, 0);
  EXPECT_NEAR(fitted_slope(relief, 0.8, 6), -2.5, 0.1);
  EXPECT_NEAR(fitted_slope(relief, 0.012, 0.1), -2.0, 0.1);
}

TEST(Relief, TellsHeightAndSlopeOfWhatItLeavesOut) {
  const ReliefBand band{
      .rms = 0.07, .hurst = 0.75, .inner = 0.05, .outer = 10, .fine_hurst = 0.5, .fine_below = 0.3};
  const Relief all(band, 16, 0), coarse(band, 16, 0.4);
  EXPECT_EQ(all.left_out().height, 0);
  EXPECT_EQ(all.left_out().slope, 0);
  Random random(8, 0);
  const auto missing = [&](const Eigen::Vector3d& p) { return all.at(p) - coarse.at(p); };
  double heights = 0, slopes = 0;
  const int n = 20000;
  const double h = 1e-3;  // small against the shortest wave
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d p = random_place(random, 1e3);
    const Eigen::Vector3d along = random_direction(random);
    heights += std::pow(missing(p), 2);
    slopes += std::pow((missing(p + h * along) - missing(p - h * along)) / (2 * h), 2);
  }
  // Independent places: sqrt(2 / n) / 2 = 0.5 %; noise is not normal, its squares scatter a little
  // more; four times that.
  EXPECT_NEAR(coarse.left_out().height / std::sqrt(heights / n), 1, 0.03);
  EXPECT_NEAR(coarse.left_out().slope / std::sqrt(slopes / n), 1, 0.03);
}

TEST(RoadRelief, HasTheDensityOfItsClassInTheMiddleOfTheClass) {
  const double n0 = 0.1;
  for (const RoadClass road : {RoadClass::C, RoadClass::D, RoadClass::E}) {
    const int k = static_cast<int>(road) - static_cast<int>(RoadClass::A);
    const double middle = 16e-6 * std::pow(4, k);  // ISO 8608
    EXPECT_DOUBLE_EQ(road_density(road), middle);
    const Relief relief(road_relief(road, 0.05, 10), 17, 0);
    double sum = 0;
    int count = 0;
    for (double wavelength = 0.25; wavelength < 5; wavelength *= std::sqrt(2.0)) {
      const double ratio = density(relief, wavelength) * std::pow(1 / wavelength / n0, 2) / middle;
      // 8 % from the number of lines, and some from the steps between octaves; four times that is
      // still well within the borders of the class, a factor 2.
      EXPECT_NEAR(ratio, 1, 0.35) << "wavelength " << wavelength;
      sum += ratio;
      ++count;
    }
    EXPECT_NEAR(sum / count, 1, 4 * 0.08 / std::sqrt(count));
    EXPECT_NEAR(fitted_slope(relief, 0.25, 5), -2, 0.1);
  }
}

TEST(RoadRelief, OfNoClassIsFlatAndOfNoWavelengthsIsRefused) {
  EXPECT_EQ(Relief(road_relief(RoadClass::none, 0.05, 10), 1, 0).bound(), 0);
  EXPECT_THROW(Relief(road_relief(RoadClass::D, 2, 1), 1, 0), std::invalid_argument);
  EXPECT_THROW(Relief(road_relief(RoadClass::D, 0, 1), 1, 0), std::invalid_argument);
  EXPECT_THROW(Relief(road_relief(RoadClass::none, 0, 1), 1, 0), std::invalid_argument);
}

TEST(LooseRocks, CoverTheAreaOfTheirNumberAndSizes) {
  const double per_area = 0.3, size = 0.6;
  const LooseRocks rocks(per_area, size, 31, 0);
  Random random(9, 0);
  const int n = 200000;
  int covered = 0;
  for (int i = 0; i < n; ++i) {
    const double height = rocks.range(random_place(random, 1000), 0).low;
    EXPECT_LE(height, rocks.bound());
    if (height > 0) ++covered;
  }
  // As many per doubling in size, from a third of the largest: E[across^2] = size^2 (1 - 1 / 9) /
  // (2 ln 3).
  const double share =
      per_area * std::numbers::pi / 4 * size * size * (8.0 / 9) / (2 * std::log(3));
  // Binomial in n places: sqrt(0.034 / n) = 0.0004; four of them.
  EXPECT_NEAR(static_cast<double>(covered) / n, share, 4 * std::sqrt(share / n));
}

TEST(LooseRocks, RangeEnclosesAllHeightsNearby) {
  const LooseRocks rocks(1, 0.8, 32, 0);
  Random random(10, 0);
  for (int i = 0; i < 50000; ++i) {
    const Eigen::Vector3d centre = random_place(random, 100);
    const double radius = std::pow(10, -3 + 3.3 * random.uniform());
    const Interval range = rocks.range(centre, radius);
    const double height =
        rocks.range(centre + radius * random.uniform() * random_direction(random), 0).low;
    EXPECT_LE(range.low, height);
    EXPECT_GE(range.high, height);
  }
}

TEST(LooseRocks, NarrowerThanAMeshShowsAreLeftOutAndTheOthersStay) {
  const LooseRocks all(0.5, 0.6, 33, 0), coarse(0.5, 0.6, 33, 0.4), none(0.5, 0.6, 33, 0.61);
  Random random(11, 0);
  int fewer = 0, same = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = random_place(random, 1000);
    const double height = all.range(p, 0).low;
    EXPECT_EQ(none.range(p, 0).low, 0);
    if (coarse.range(p, 0).low == height) {
      if (height > 0) ++same;
    } else {
      EXPECT_EQ(coarse.range(p, 0).low, 0);
      ++fewer;
    }
  }
  EXPECT_GT(fewer, 0);
  EXPECT_GT(same, 0);
}

TEST(LooseRocks, RefuseNumbersAndSizesThatDoNotFit) {
  EXPECT_THROW(LooseRocks(-0.1, 0.3, 0, 0), std::invalid_argument);
  EXPECT_THROW(LooseRocks(1.1, 0.3, 0, 0), std::invalid_argument);
  EXPECT_THROW(LooseRocks(0.1, 1.1, 0, 0), std::invalid_argument);
  EXPECT_THROW(LooseRocks(std::nan(""), 0.3, 0, 0), std::invalid_argument);
}

// From tables of the normal distribution.
TEST(NormalUpperQuantile, IsThatOfTables) {
  EXPECT_NEAR(normal_upper_quantile(0.5), 0, 1e-9);
  EXPECT_NEAR(normal_upper_quantile(0.158655), 1, 1e-5);
  EXPECT_NEAR(normal_upper_quantile(0.05), 1.644854, 1e-6);
  EXPECT_NEAR(normal_upper_quantile(0.9), -1.281552, 1e-6);
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
