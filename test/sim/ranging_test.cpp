// SPDX-License-Identifier: MIT
#include "sim/ranging.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "core/cloud.h"

namespace minescan {
namespace {

using std::numbers::pi;

// The returns of `count` beams that all meet the same, each with noise of its own.
std::vector<Echoes> measured(const Scanner& s, const std::vector<Facet>& facets,
                             std::uint64_t count, double age = 0) {
  const Ranging ranging(s);
  std::vector<Echoes> all;
  for (std::uint64_t first = 0; first < count; first += lanes) {
    Light light;
    const std::size_t beams = std::min<std::size_t>(lanes, count - first);
    light.clear(facets.size());
    std::array<std::uint64_t, lanes> streams = {};
    for (std::size_t i = 0; i < beams; ++i) {
      streams[i] = first + i;
      light.age[i] = age;
      for (std::size_t k = 0; k < facets.size(); ++k) light.set(k, i, facets[k]);
    }
    for (std::size_t block = 0; block < ranging.blocks(); ++block)
      four_normals(17, streams, block, light.normals[block]);
    std::array<Echoes, lanes> echoes;
    ranging.measure(light, {echoes.data(), beams});
    all.insert(all.end(), echoes.begin(), echoes.begin() + static_cast<long>(beams));
  }
  return all;
}

// Of a flat surface; beams without return are left out.
std::vector<Echo> measured(const Scanner& s, double range, double signal, std::uint64_t count) {
  std::vector<Echo> echoes;
  for (const Echoes& e : measured(s, {{1, range, signal}}, count))
    if (e.count > 0) echoes.push_back(e.echo[0]);
  return echoes;
}

// What a scanner without noise measures; nothing: no return.
std::vector<Echo> exact(const Scanner& s, const std::vector<Facet>& facets, double age = 0) {
  const Echoes e = measured(s, facets, 1, age).at(0);
  return {e.echo.begin(), e.echo.begin() + static_cast<long>(e.count)};
}

Scanner two_tones() {
  return {.min_range = 0.5, .ranging = RangingKind::phase, .tones = {4.8, 48}};
}

struct Spread {
  double mean = 0;
  double sigma = 0;
};
Spread spread_of(const std::vector<Echo>& echoes, double range) {
  const auto n = static_cast<double>(echoes.size());
  Spread s;
  for (const Echo& echo : echoes) s.mean += (echo.range - range) / n;
  for (const Echo& echo : echoes)
    s.sigma += (echo.range - range - s.mean) * (echo.range - range - s.mean) / (n - 1);
  s.sigma = std::sqrt(s.sigma);
  return s;
}

// Single precision in the phase: 1e-7 of a turn or so, of the finest tone.
constexpr double phase_rounding = 4e-7;

TEST(Amplitude, IsFlatNearByAndFallsWithTheSquareOfTheRangeFarAway) {
  Scanner s{.defocus_range = 9};
  EXPECT_NEAR(amplitude(s, 1, 1), 1, 1e-12);  // a white plate at 1 m
  EXPECT_NEAR(amplitude(s, 9, 1), 1 - std::exp(-1.0), 1e-15);
  // exp(-x) = 1 - x + x^2 / 2 ...: g falls short of (9 / R)^2 by half of (9 / R)^2 of itself.
  EXPECT_NEAR(amplitude(s, 900, 1) / 1e-4, 1, 0.51e-4);
  EXPECT_NEAR(amplitude(s, 20, 0.15), 0.15 * amplitude(s, 20, 1), 1e-15);
  double last = 2;
  for (double range = 1; range < 100; range *= 1.1) {
    EXPECT_LT(amplitude(s, range, 1), last);
    last = amplitude(s, range, 1) + 1e-15;
  }
  // Light passes the fog twice.
  const double clear = amplitude(s, 10, 1);
  s.fog_extinction = 0.05;
  EXPECT_NEAR(amplitude(s, 10, 1), clear * std::exp(-1.0), 1e-15);
}

TEST(Pulse, WithoutErrorsIsExact) {
  for (const double range : {0.5, 3.7, 99.0}) {
    const std::vector<Echo> echoes = exact(Scanner{}, {{1, range, 0.14}});
    ASSERT_EQ(echoes.size(), 1u);
    EXPECT_EQ(echoes[0].range, range);
    EXPECT_EQ(echoes[0].flags, flag_none);
    EXPECT_EQ(echoes[0].sub_ray, 0);
    EXPECT_FLOAT_EQ(echoes[0].amplitude, static_cast<float>(amplitude(Scanner{}, range, 0.14)));
  }
  EXPECT_TRUE(exact(Scanner{}, {}).empty());
}

TEST(Pulse, SpreadGrowsWithTheRangeUpToItsLimit) {
  const Scanner s{.range_noise = 0.0025, .range_noise_growth = 0.0004, .range_noise_max = 0.010};
  for (const double range : {2.0, 7.0, 40.0}) {
    const std::vector<Echo> echoes = measured(s, range, 0.3, 20000);
    ASSERT_EQ(echoes.size(), 20000u);
    const double sigma = std::min(0.010, 0.0025 + 0.0004 * range);
    const Spread spread = spread_of(echoes, range);
    EXPECT_NEAR(spread.mean, 0, 4 * sigma / std::sqrt(20000));
    EXPECT_NEAR(spread.sigma, sigma, 4 * sigma / std::sqrt(40000));
  }
}

TEST(Pulse, SystematicErrorsAddAndDigitsRound) {
  Scanner s{.range_bias = 0.012, .range_scale = 1e-3};
  EXPECT_NEAR(exact(s, {{1, 10, 0.3}}).at(0).range, 10.022, 1e-12);
  s.warm_up = 0.005;
  s.warm_up_time = 3600;
  EXPECT_NEAR(exact(s, {{1, 10, 0.3}}).at(0).range, 10.027, 1e-12);
  EXPECT_NEAR(exact(s, {{1, 10, 0.3}}, 3600).at(0).range, 10.022 + 0.005 / std::numbers::e, 1e-12);
  s = {.quantisation = 0.01};
  EXPECT_NEAR(exact(s, {{1, 10.0049, 0.3}}).at(0).range, 10.00, 1e-12);
  EXPECT_NEAR(exact(s, {{1, 10.0051, 0.3}}).at(0).range, 10.01, 1e-12);
}

// Two surfaces 1 m apart, the nearer with a quarter, the half and the whole of the light.
TEST(Pulse, NearSurfacesMergeAtTheirMeanUnlessOneOutshinesTheOther) {
  Scanner s{.defocus_range = 1000, .pulse_length = 2};  // the same amplitude at all ranges
  const auto edge = [](double share) -> std::vector<Facet> {
    return {{1 - share, 6, 0.4}, {share, 5, 0.4}};
  };
  const auto at = [&](double share) { return exact(s, edge(share)).at(0); };
  EXPECT_NEAR(at(0.25).range, 5.75, 1e-4);
  EXPECT_NEAR(at(0.5).range, 5.5, 1e-4);
  EXPECT_EQ(at(0.5).flags, flag_mixed_pixel);
  EXPECT_EQ(at(0.5).sub_ray, 0);
  s.pulse_capture = 0.7;
  EXPECT_NEAR(at(0.25).range, 6, 1e-12);
  EXPECT_EQ(at(0.25).sub_ray, 0);
  EXPECT_NEAR(at(0.5).range, 5.5, 1e-4);
  EXPECT_NEAR(at(0.75).range, 5, 1e-12);
  EXPECT_EQ(at(0.75).sub_ray, 1);  // whose truth belongs to it
  EXPECT_EQ(at(0.75).flags, flag_mixed_pixel);
  // Closer than surface_gap they are one surface, seen in the mean without a flag.
  const Echo smooth = exact(s, {{0.5, 5.05, 0.4}, {0.5, 5, 0.4}}).at(0);
  EXPECT_NEAR(smooth.range, 5.025, 1e-6);
  EXPECT_EQ(smooth.flags, flag_none);
}

TEST(Pulse, FarSurfacesAreSeveralReturnsByRange) {
  Scanner s{.defocus_range = 1000, .returns = 2, .pulse_length = 0.75};
  const std::vector<Facet> three = {{0.5, 20, 0.4}, {0.1, 2, 0.4}, {0.4, 5, 0.4}};
  std::vector<Echo> echoes = exact(s, three);
  ASSERT_EQ(echoes.size(), 2u);  // the strongest ones
  EXPECT_EQ(echoes[0].range, 5);
  EXPECT_EQ(echoes[0].sub_ray, 2);
  EXPECT_EQ(echoes[1].range, 20);
  EXPECT_EQ(echoes[1].sub_ray, 0);
  EXPECT_EQ(echoes[0].flags, flag_mixed_pixel);
  s.returns = 1;
  echoes = exact(s, three);
  ASSERT_EQ(echoes.size(), 1u);
  EXPECT_EQ(echoes[0].range, 20);
  s.returns = 3;
  s.min_amplitude = 0.1;  // two have more
  EXPECT_EQ(exact(s, three).size(), 2u);
}

TEST(Pulse, StrongSignalsAreCut) {
  const Scanner s{.saturation = 0.5};
  EXPECT_EQ(exact(s, {{1, 2, 0.9}}).at(0).amplitude, 0.5f);
  EXPECT_EQ(exact(s, {{1, 2, 0.9}}).at(0).flags, flag_saturated);
  EXPECT_EQ(exact(s, {{1, 2, 0.4}}).at(0).flags, flag_none);
}

TEST(Phase, WrapsAtTheAmbiguityIntervalAndSaysSo) {
  Scanner s = two_tones();
  s.max_range = 200;
  for (double range = 0.75; range < 200; range += 0.9) {
    const std::vector<Echo> echoes = exact(s, {{1, range, 0.4}});
    const double expected = std::fmod(range, 48);
    ASSERT_EQ(echoes.size(), expected >= 0.5 ? 1u : 0u) << range;
    if (echoes.empty()) continue;
    EXPECT_NEAR(echoes[0].range, expected, phase_rounding * 4.8);
    EXPECT_NEAR(echoes[0].amplitude / amplitude(s, range, 0.4), 1, 1e-6);  // single precision
    EXPECT_EQ(echoes[0].flags, range >= 48 ? flag_wrapped : flag_none);
  }
}

// The stated law far away, and more by amplitude_noise.
TEST(Phase, SpreadFollowsTheNoiseLaw) {
  Scanner s = two_tones();
  s.defocus_range = 0.5;
  s.range_noise = 0.003;
  s.range_noise_growth = 0.0004;
  for (const double extra : {0.0, 2e-6}) {
    s.amplitude_noise = extra;
    for (const double range : {5.0, 15.0})
      for (const double signal : {0.1, 0.9}) {
        const std::vector<Echo> echoes = measured(s, range, signal, 20000);
        ASSERT_EQ(echoes.size(), 20000u);
        const double added = 4.8 / (2 * pi) * extra / amplitude(s, range, signal);
        const double sigma =
            std::sqrt(0.003 * 0.003 + 0.0004 * 0.0004 * range * range / signal + added * added);
        const Spread spread = spread_of(echoes, range);
        EXPECT_NEAR(spread.mean, 0, 4 * sigma / std::sqrt(20000));
        // And (1 - exp(-x)) / x = 1 - x / 2, x = 0.01 at 5 m.
        EXPECT_NEAR(spread.sigma / sigma, 1, 4 / std::sqrt(40000) + 0.003);
      }
  }
}

// arg(A exp(j phi) + L) - phi is -L / A sin(phi) for small L.
TEST(Phase, LeakingLightGivesAnErrorThatRepeatsWithTheTone) {
  Scanner s = two_tones();
  s.leakage = 0.0008;
  for (double range = 1; range < 30; range += 0.3) {
    const double a = amplitude(s, range, 0.2);
    const double expected = -4.8 / (2 * pi) * s.leakage / a * std::sin(2 * pi * range / 4.8);
    // Of second order in L / A, below 0.09 here.
    EXPECT_NEAR(exact(s, {{1, range, 0.2}}).at(0).range - range, expected,
                0.1 * 4.8 / (2 * pi) * s.leakage / a + phase_rounding * 4.8);
  }
}

TEST(Phase, HarmonicsRepeatFourTimesPerPeriodAndBitsMakeSteps) {
  Scanner s = two_tones();
  s.harmonic = 0.002;
  for (double range = 1; range < 9; range += 0.1)
    EXPECT_NEAR(exact(s, {{1, range, 0.2}}).at(0).range - range,
                0.002 * std::sin(2 * pi * range / 1.2), phase_rounding * 4.8);
  s = two_tones();
  s.phase_bits = 12;
  for (double range = 1; range < 9; range += 0.1) {
    const double step = 4.8 / 4096;
    const double found = exact(s, {{1, range, 0.2}}).at(0).range;
    EXPECT_NEAR(found / step, std::round(found / step), 1e-9);
    EXPECT_NEAR(found, range, step / 2 + phase_rounding * 4.8);
  }
}

// Clipped at half of the amplitude: cos and sin beyond 1/2 are 1/2, so that phases between 30 and
// 60 degrees read 45, and 0 degrees reads 0. An error with four periods per turn.
TEST(Phase, StrongSignalsAreCutAndErrWithFourPeriods) {
  Scanner s{.min_range = 0,
            .defocus_range = 1000,
            .saturation = 0.2,
            .ranging = RangingKind::phase,
            .tones = {4.8}};
  const auto read = [&](double degrees) {
    return exact(s, {{1, 4.8 + degrees / 360 * 4.8, 0.4}}).at(0);
  };
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double turn = 90 * quarter;
    const auto error = [&](double degrees) {
      return std::remainder((read(turn + degrees).range) / 4.8 * 360 - turn - degrees, 360);
    };
    EXPECT_NEAR(error(0.01), 0.01, 0.02);  // sin is as it was, cos half: twice the angle
    EXPECT_NEAR(error(35), 10, 1e-3);
    EXPECT_NEAR(error(45), 0, 1e-3);
    EXPECT_NEAR(error(55), -10, 1e-3);
  }
  EXPECT_EQ(read(10).flags & flag_saturated, flag_saturated);
  s.saturation = 0.5;
  EXPECT_EQ(read(10).flags & flag_saturated, 0);
}

TEST(Phase, WeakSignalsDoNotReturn) {
  Scanner s = two_tones();
  s.min_amplitude = 0.01;
  // 0.3 * (9 / R)^2 = 0.01 at R = 49.3 m, to the second order in 1 / R^2: 48.9 m.
  s.tones = {10, 100};
  EXPECT_EQ(exact(s, {{1, 48.5, 0.3}}).size(), 1u);
  EXPECT_TRUE(exact(s, {{1, 49.5, 0.3}}).empty());
  EXPECT_TRUE(exact(s, {{1, 10, 0.009}}).empty());
  EXPECT_TRUE(exact(s, {}).empty());
}

// A signal of length s (in units of the noise) has its phase beyond +-L when it lies outside a
// wedge, two half-planes at distance s sin L: 2 Q(s sin L), less the part outside of both, below
// exp(-s^2 / 2). The coarse tone is 10 fine periods long, so L = pi / 10; the fine one has no noise
// to speak of.
TEST(Phase, TakesWrongPeriodsAsOftenAsThePhaseNoiseSays) {
  Scanner s = two_tones();
  s.min_range = 0;
  const std::uint64_t count = 100000;
  for (const double strength : {4.0, 6.0, 8.0}) {
    s.tone_depths = {1, 1e-4};
    s.amplitude_noise = 1e-4 * amplitude(s, 5, 1) / strength;
    int wrong = 0;
    for (const Echo& echo : measured(s, 5, 1, count)) {
      const double periods = std::remainder(echo.range - 5, 48) / 4.8;
      EXPECT_NEAR(periods, std::round(periods), 1e-3);
      EXPECT_EQ(std::abs(periods) > 0.5, (echo.flags & flag_outlier) != 0);
      if ((echo.flags & flag_outlier) != 0) ++wrong;
    }
    const double expected = std::erfc(strength * std::sin(pi / 10) / std::sqrt(2));
    const double n = static_cast<double>(count);
    EXPECT_NEAR(wrong / n, expected,
                4 * std::sqrt(expected / n) + std::exp(-strength * strength / 2));
  }
}

TEST(Phase, NoSignalGivesAnyRangeEquallyOften) {
  Scanner s = two_tones();
  s.min_range = 0;
  s.amplitude_noise = 1;
  std::map<int, int> tenths;
  const std::vector<Echo> echoes = measured(s, 2, 1e-9, 100000);
  ASSERT_EQ(echoes.size(), 100000u);
  for (const Echo& echo : echoes) ++tenths[static_cast<int>(echo.range / 4.8)];
  ASSERT_EQ(tenths.size(), 10u);
  // 100 000 draws of probability 1 / 10: one sigma is 95.
  for (const auto& [tenth, times] : tenths) EXPECT_NEAR(times, 10000, 4 * 95) << tenth;
}

TEST(Phase, AmplitudeIsRician) {
  Scanner s = two_tones();
  s.amplitude_noise = 0.02;
  double squares = 0;
  const std::vector<Echo> echoes = measured(s, 5, 0.1, 50000);
  for (const Echo& echo : echoes)
    squares += static_cast<double>(echo.amplitude) * static_cast<double>(echo.amplitude);
  const double A = amplitude(s, 5, 0.1);
  // E |A + n|^2 = A^2 + 2 sigma^2; its standard deviation is about 2 A sigma = 0.004.
  EXPECT_NEAR(squares / static_cast<double>(echoes.size()), A * A + 2 * 0.02 * 0.02,
              4 * 0.0042 / std::sqrt(50000));
}

// Two surfaces in one beam, each with a share of the light, against the sum of phasors.
TEST(Phase, TwoSurfacesGiveTheRangeOfTheirPhasorSum) {
  for (const double gap : {0.5, 2.0, 2.6, 7.0})
    for (const double share : {0.2, 0.5, 0.7}) {
      const double near = 6, far = 6 + gap;
      Scanner s = two_tones();
      const std::vector<Facet> facets = {{1 - share, far, 0.3}, {share, near, 0.3}};
      const auto tone_range = [&](double interval) {
        std::complex<double> sum = 0;
        for (const Facet& f : facets)
          sum += f.weight * amplitude(s, f.range, f.signal) *
                 std::polar(1.0, 2 * pi * f.range / interval);
        return std::arg(sum) / (2 * pi) * interval;
      };
      double expected = tone_range(4.8);
      expected += 4.8 * std::round((tone_range(48) - expected) / 4.8);
      const Echo echo = exact(s, facets).at(0);
      EXPECT_NEAR(echo.range, expected, 1e-4) << gap << " " << share;
      EXPECT_NE(echo.flags & flag_mixed_pixel, 0);
      if (gap < 2.4) {
        // Less than half a period apart: between the two.
        EXPECT_GT(echo.range, near);
        EXPECT_LT(echo.range, far);
      }
    }
}

// More than half a period apart, the sum lies outside of the two or a period away: averages of
// ranges never do.
TEST(Phase, FarSurfacesGiveRangesOutsideOfThem) {
  Scanner s = two_tones();
  int outside = 0;
  for (double share = 0.1; share < 0.95; share += 0.1) {
    const double range = exact(s, {{1 - share, 6, 0.3}, {share, 9, 0.3}}).at(0).range;
    if (range < 6 || range > 9) ++outside;
  }
  EXPECT_GE(outside, 5);
}

// One surface that slopes through the footprint is no mixed pixel.
TEST(Phase, SlopingSurfacesAreNotMixed) {
  std::vector<Facet> facets;
  for (int i = 0; i < 7; ++i) facets.push_back({1.0 / 7, 5 + 0.05 * (i - 3), 0.3});
  EXPECT_EQ(exact(two_tones(), facets).at(0).flags, flag_none);
  // The sum is symmetric but for the amplitudes, which fall by 1 % over the slope.
  EXPECT_NEAR(exact(two_tones(), facets).at(0).range, 5, 1e-3);
}

}  // namespace
}  // namespace minescan
