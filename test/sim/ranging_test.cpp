// SPDX-License-Identifier: MIT
#include "sim/ranging.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "core/random.h"

namespace minescan {
namespace {

using std::numbers::pi;

// Measures one surface many times; beams without return are left out.
std::vector<Echo> measured(const Scanner& s, double range, double reflectance, double cosine,
                           std::uint64_t count) {
  const Ranging ranging(s);
  std::vector<Echo> echoes;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(17, i);
    const auto n = four_normals(random);
    const Echo echo = ranging.measure(range, reflectance, cosine, {n[0], n[1], n[2]});
    if (echo.returned) echoes.push_back(echo);
  }
  return echoes;
}

TEST(FourNormals, AreStandardNormalAndIndependent) {
  const std::uint64_t count = 100000;
  const double n = static_cast<double>(count);
  std::array<double, 4> mean{}, square{}, fourth{}, beyond{};
  double products = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(3, i);
    const auto x = four_normals(random);
    for (std::size_t k = 0; k < 4; ++k) {
      mean[k] += x[k] / n;
      square[k] += x[k] * x[k] / n;
      fourth[k] += std::pow(x[k], 4) / n;
      beyond[k] += (x[k] > 1) / n;
    }
    products += x[0] * x[1] + x[0] * x[2] + x[1] * x[3];
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

TEST(Amplitude, IsFlatNearByAndFallsWithTheSquareOfTheRangeFarAway) {
  const Scanner s{.defocus_range = 9};
  EXPECT_NEAR(amplitude(s, 1, 1, 1), 1, 1e-12);  // a white plate at 1 m
  EXPECT_NEAR(amplitude(s, 9, 1, 1), 1 - std::exp(-1.0), 1e-15);
  // exp(-x) = 1 - x + x^2 / 2 ...: g falls short of (9 / R)^2 by half of (9 / R)^2 of itself.
  EXPECT_NEAR(amplitude(s, 900, 1, 1) / 1e-4, 1, 0.51e-4);
  EXPECT_NEAR(amplitude(s, 20, 0.3, 0.5), 0.15 * amplitude(s, 20, 1, 1), 1e-15);
  double last = 2;
  for (double range = 1; range < 100; range *= 1.1) {
    EXPECT_LT(amplitude(s, range, 1, 1), last);
    last = amplitude(s, range, 1, 1) + 1e-15;
  }
}

TEST(Ranging, SpreadFollowsTheNoiseLaw) {
  const Scanner s{.range_noise = 0.006, .range_noise_growth = 0.0004};
  const std::uint64_t count = 20000;
  for (const double range : {1.0, 10.0, 30.0}) {
    for (const double reflectance : {0.1, 0.9}) {
      for (const double cosine : {1.0, 0.3}) {
        double sum = 0;
        double squares = 0;
        const std::vector<Echo> echoes = measured(s, range, reflectance, cosine, count);
        ASSERT_EQ(echoes.size(), count);
        for (const Echo& echo : echoes) {
          sum += echo.range - range;
          squares += (echo.range - range) * (echo.range - range);
        }
        const double n = static_cast<double>(count);
        const double sigma =
            std::sqrt(0.006 * 0.006 + 0.0004 * 0.0004 * range * range / (reflectance * cosine));
        EXPECT_NEAR(sum / n, 0, 4 * sigma / std::sqrt(n));
        EXPECT_NEAR(std::sqrt(squares / n), sigma, 4 * sigma / std::sqrt(2 * n));
      }
    }
  }
}

TEST(Ranging, WithoutNoiseIsExact) {
  const Ranging ranging(Scanner{});
  for (const double range : {0.5, 3.7, 99.0}) {
    const Echo echo = ranging.measure(range, 0.2, 0.7, {1, -2, 3});
    EXPECT_TRUE(echo.returned);
    EXPECT_EQ(echo.range, range);
    EXPECT_EQ(echo.flags, flag_none);
  }
}

TEST(Ranging, WrapsAtTheAmbiguityIntervalAndSaysSo) {
  const Ranging ranging(Scanner{.max_range = 200, .wrap_interval = 48, .fine_interval = 4.8});
  for (double range = 0.75; range < 200; range += 0.9) {
    const Echo echo = ranging.measure(range, 0.4, 1, {0, 0, 0});
    const double expected = std::fmod(range, 48);
    EXPECT_EQ(echo.returned, expected >= 0.5) << range;
    EXPECT_NEAR(echo.range, expected, 1e-13);
    EXPECT_EQ(echo.flags, range >= 48 ? flag_wrapped : flag_none);
  }
}

TEST(Ranging, CyclicErrorRepeatsWithTheFineTone) {
  const Ranging ranging(Scanner{.wrap_interval = 48, .fine_interval = 4.8, .cyclic_error = 0.005});
  const auto error = [&](double range) {
    return ranging.measure(range, 0.4, 1, {0, 0, 0}).range - range;
  };
  EXPECT_NEAR(error(4.8), 0, 1e-14);
  EXPECT_NEAR(error(1.2), 0.005, 1e-14);
  EXPECT_NEAR(error(3.6), -0.005, 1e-14);
  for (double range = 1; range < 5; range += 0.3)
    EXPECT_NEAR(error(range), error(range + 4 * 4.8), 1e-13);
}

TEST(Ranging, WeakSignalsDoNotReturn) {
  const Ranging ranging(Scanner{.defocus_range = 9, .min_amplitude = 0.01});
  // 0.3 * (9 / R)^2 = 0.01 at R = 49.3 m, to the second order in 1 / R^2: 48.9 m.
  EXPECT_TRUE(ranging.measure(48.5, 0.3, 1, {0, 0, 0}).returned);
  EXPECT_FALSE(ranging.measure(49.5, 0.3, 1, {0, 0, 0}).returned);
  EXPECT_FALSE(ranging.measure(10, 0.3, 0.03, {0, 0, 0}).returned);
}

// A signal of length s (in units of the noise) has its phase beyond +-L when it lies outside a
// wedge, two half-planes at distance s sin L: 2 Q(s sin L), less the part outside of both, below
// exp(-s^2 / 2). The coarse tone is 10 fine periods long, so L = pi / 10.
TEST(Ranging, TakesWrongPeriodsAsOftenAsThePhaseNoiseSays) {
  Scanner s{.min_range = 0, .amplitude_noise = 1, .wrap_interval = 48, .fine_interval = 4.8};
  const std::uint64_t count = 100000;
  for (const double strength : {4.0, 6.0, 8.0}) {
    s.amplitude_noise = amplitude(s, 5, 1, 1) / strength;
    int wrong = 0;
    for (const Echo& echo : measured(s, 5, 1, 1, count)) {
      const double periods = std::remainder(echo.range - 5, 48) / 4.8;
      EXPECT_NEAR(periods, std::round(periods), 1e-12);  // without range noise
      EXPECT_EQ(std::abs(periods) > 0.5, (echo.flags & flag_outlier) != 0);
      if ((echo.flags & flag_outlier) != 0) ++wrong;
    }
    const double expected = std::erfc(strength * std::sin(pi / 10) / std::sqrt(2));
    const double n = static_cast<double>(count);
    EXPECT_NEAR(wrong / n, expected,
                4 * std::sqrt(expected / n) + std::exp(-strength * strength / 2));
  }
}

TEST(Ranging, NoSignalGivesAnyPeriodEquallyOften) {
  Scanner s{.min_range = 0, .amplitude_noise = 1, .wrap_interval = 48, .fine_interval = 4.8};
  std::map<int, int> periods;
  const std::vector<Echo> echoes = measured(s, 2, 1e-9, 1, 100000);
  ASSERT_EQ(echoes.size(), 100000u);
  for (const Echo& echo : echoes) ++periods[static_cast<int>(echo.range / 4.8)];
  ASSERT_EQ(periods.size(), 10u);
  // 100 000 draws of probability 1 / 10: one sigma is 95.
  for (const auto& [period, times] : periods) EXPECT_NEAR(times, 10000, 4 * 95) << period;
}

TEST(Ranging, AmplitudeIsRician) {
  Scanner s{.amplitude_noise = 0.02};
  double squares = 0;
  const std::vector<Echo> echoes = measured(s, 5, 0.1, 1, 50000);
  for (const Echo& echo : echoes)
    squares += static_cast<double>(echo.amplitude) * static_cast<double>(echo.amplitude);
  const double A = amplitude(s, 5, 0.1, 1);
  // E |A + n|^2 = A^2 + 2 sigma^2; its standard deviation is about 2 A sigma = 0.004.
  EXPECT_NEAR(squares / static_cast<double>(echoes.size()), A * A + 2 * 0.02 * 0.02,
              4 * 0.0042 / std::sqrt(50000));
}

}  // namespace
}  // namespace minescan
