// SPDX-License-Identifier: MIT
// The measurements of a validation, on scanners where the answer is known, and on wrong ones, which
// must not pass.
#include "sim/validation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "test/sim/shapes.h"

namespace minescan {
namespace {

const Expectation& expected(const std::string& name) {
  for (const ValidationRow& row : validation_rows())
    if (row.expected.name == name) return row.expected;
  throw std::invalid_argument("no row is called " + name);
}

Verdict verdict_of(const std::string& name, double measured) {
  return verdict({expected(name), measured});
}

// A scanner without errors.
Scanner exact() {
  Scanner s = find_scanner("ideal-yawing");
  s.plane_beams = 1;
  return s;
}

TEST(Verdict, IsPassWithinWhatIsAcceptedAndFailForWhatIsNoNumber) {
  const Expectation range{.name = "a", .accepted = Interval{1, 2}};
  EXPECT_EQ(verdict({range, 1}), Verdict::pass);
  EXPECT_EQ(verdict({range, 2}), Verdict::pass);
  EXPECT_EQ(verdict({range, 0.999}), Verdict::fail);
  EXPECT_EQ(verdict({range, 2.001}), Verdict::fail);
  EXPECT_EQ(verdict({range, std::numeric_limits<double>::quiet_NaN()}), Verdict::fail);
  EXPECT_EQ(verdict({{.name = "b"}, 7}), Verdict::reported);
}

TEST(ValidationRows, SayWhatTheyMeasureAndWhereFiguresAreFrom) {
  EXPECT_GE(validation_rows().size(), 20U);
  for (const ValidationRow& row : validation_rows()) {
    EXPECT_NE(row.expected.what, "") << row.expected.name;
    EXPECT_NE(row.expected.source, "") << row.expected.name;
    ASSERT_TRUE(row.expected.accepted.has_value()) << row.expected.name;
    EXPECT_LE(row.expected.accepted->low, row.expected.accepted->high) << row.expected.name;
  }
}

// 40 000 readings: one sigma of the measured sigma is 0.35 %; four of these.
TEST(RangeSigma, IsTheNoiseWithoutTheRounding) {
  Scanner s = exact();
  s.range_noise = 0.004;
  EXPECT_NEAR(range_sigma(s, {3, 5}, 0.4, 1), 0.004, 0.000056);
  s.quantisation = 0.005;  // alone 1.4 mm
  EXPECT_NEAR(range_sigma(s, {3, 5}, 0.4, 1), 0.004, 0.00007);
  EXPECT_EQ(range_sigma(s, {3, 5}, 0.4, 1), range_sigma(s, {3, 5}, 0.4, 1));
  EXPECT_NE(range_sigma(s, {3, 5}, 0.4, 1), range_sigma(s, {3, 5}, 0.4, 2));
}

TEST(RangeSigma, TellsAWrongScanner) {
  const std::string near = "LMS 200: range noise, 1 to 2 m";
  Scanner s = find_scanner("sick-lms200-ptu");
  EXPECT_EQ(verdict_of(near, 1e3 * range_sigma(s, {1, 2}, 0.35, 1)), Verdict::pass);
  s.range_noise *= 2;
  EXPECT_EQ(verdict_of(near, 1e3 * range_sigma(s, {1, 2}, 0.35, 1)), Verdict::fail);

  const std::string dark = "Focus 120: range noise at 25 m on 10 %";
  Scanner tls = find_scanner("tls-phase");
  EXPECT_EQ(verdict_of(dark, 1e3 * range_sigma(tls, {24.9, 25.1}, 0.1, 1)), Verdict::pass);
  tls.range_noise_growth *= 1.5;
  EXPECT_EQ(verdict_of(dark, 1e3 * range_sigma(tls, {24.9, 25.1}, 0.1, 1)), Verdict::fail);
}

// Two readings d apart round to the same step q with probability 1 - |d| / q, where d is normal
// with s = sqrt(2) sigma: erf(q / (sqrt(2) s)) - sqrt(2 / pi) s / q (1 - exp(-q^2 / (2 s^2))).
TEST(EqualReadings, AreAsManyAsTheNoiseSays) {
  Scanner s = exact();
  EXPECT_EQ(equal_readings(s, {1, 2}, 0.01, 1), 1);
  for (const double sigma : {0.002, 0.005, 0.02}) {
    s.range_noise = sigma;
    const double spread = std::sqrt(2.0) * sigma, q = 0.01;
    const double share = std::erf(q / (std::sqrt(2.0) * spread)) -
                         std::sqrt(2 / std::numbers::pi) * spread / q *
                             (1 - std::exp(-q * q / (2 * spread * spread)));
    // 50 000 pairs, neighbours of which share a reading: about 0.003; and the places.
    EXPECT_NEAR(equal_readings(s, {1, 2}, q, 1), share, 0.015) << sigma;
  }
}

TEST(EqualReadings, TellAWrongScanner) {
  const std::string near = "LMS 200: equal readings, 1 to 2 m";
  Scanner s = find_scanner("sick-lms200-ptu");
  EXPECT_EQ(verdict_of(near, equal_readings(s, {1, 2}, 0.01, 1)), Verdict::pass);
  s.range_noise *= 2;
  EXPECT_EQ(verdict_of(near, equal_readings(s, {1, 2}, 0.01, 1)), Verdict::fail);
}

Scan plane_of(const std::vector<double>& ranges) {
  Scan scan;
  scan.range = ranges;
  for (std::size_t i = 0; i < ranges.size(); ++i)
    scan.ring.push_back(static_cast<std::uint32_t>(i));
  return scan;
}

TEST(Jumps, AreCountedAsInALog) {
  const auto counted = [](const Scan& scan) {
    Jumps jumps;
    count_jumps(scan, jumps);
    return jumps;
  };
  EXPECT_EQ(counted(plane_of({5, 5, 5.9, 5.9})).all, 0U) << "below 1 m";
  Jumps jumps = counted(plane_of({5, 5, 7, 7}));
  EXPECT_EQ(jumps.all, 1U);
  EXPECT_TRUE(jumps.positions.empty());
  EXPECT_TRUE(std::isnan(jumps.median_position()));
  // Half-way in a step of 4 m, where both its neighbours are more than 1 m away: one jump.
  jumps = counted(plane_of({5, 5, 7, 9, 9}));
  EXPECT_EQ(jumps.all, 1U);
  ASSERT_EQ(jumps.positions.size(), 1U);
  EXPECT_NEAR(jumps.positions[0], 0.5, 1e-12);
  EXPECT_EQ(jumps.intermediate_share(), 1);
  // Down again, a quarter of the way from the nearer side.
  jumps = counted(plane_of({9, 9, 6, 5, 5}));
  ASSERT_EQ(jumps.positions.size(), 1U);
  EXPECT_NEAR(jumps.positions[0], 0.25, 1e-12);
  EXPECT_TRUE(counted(plane_of({5, 5, 5.1, 7, 7})).positions.empty()) << "within 0.15 m of a side";
  // A beam without return is no neighbour.
  Scan gap = plane_of({5, 5, 7, 7});
  gap.ring = {0, 1, 3, 4};
  EXPECT_EQ(counted(gap).all, 0U);
}

Scanner half_degree_lms() {
  Scanner s = find_scanner("sick-lms200-ptu");
  s.motion = Motion::none;
  s.plane_beams = 361;
  s.planes = 1;
  s.plane_field = 180.5 * Scanner::degree;
  return s;
}

// Of 12 screens of 15 degrees, turned by up to 15, 11 or 12 edges lie in 180 degrees of beams.
TEST(ScreenJumps, FollowTheShareThatTakesAPulse) {
  const std::string row = "LMS 200: mixed pixels per jump";
  Scanner s = half_degree_lms();
  // One of two surfaces always has half of the light.
  s.pulse_capture = 0.5;
  const Jumps none = screen_jumps(s, 1);
  EXPECT_GT(none.all, 10000U);
  EXPECT_LT(none.all, 12000U);
  EXPECT_LT(none.intermediate_share(), 0.001);  // a corner's beams, now and then
  EXPECT_EQ(verdict_of(row, none.intermediate_share()), Verdict::fail);
  s.pulse_capture = 1;
  const Jumps all = screen_jumps(s, 1);
  EXPECT_EQ(verdict_of(row, all.intermediate_share()), Verdict::fail);
  EXPECT_GT(all.intermediate_share(), 0.29);
  // The nearer surface is the brighter one, a little.
  EXPECT_NEAR(all.median_position(), 0.48, 0.04);
}

TEST(AmbiguityInterval, IsTheTonesAndTellsAWrongOne) {
  Scanner s = find_scanner("tls-phase");
  s.tones[0] = 1.3;
  EXPECT_NEAR(ambiguity_interval(s, 0, 1), 1.3, 1e-4);
  EXPECT_EQ(verdict_of("phase scanner: ambiguity at 125 MHz", ambiguity_interval(s, 0, 1)),
            Verdict::fail);
}

TEST(TwoSurfaces, AreTheSumOfPhasorsAndTellACoarsePhase) {
  Scanner s = find_scanner("tls-phase");
  for (const double separation : {0.2, 0.4, 0.5}) {
    EXPECT_LT(two_surfaces(s, separation).worst_difference, 1.83e-5) << separation;
    EXPECT_EQ(two_surfaces(s, separation).between, 1) << separation;
  }
  for (const double separation : {0.7, 0.8, 1.0})
    EXPECT_EQ(two_surfaces(s, separation).between, 0) << separation;
  s.phase_bits = 8;
  const double coarse = two_surfaces(s, 0.4).worst_difference;
  EXPECT_NEAR(coarse, 1.2 / 512, 1.2 / 1024);  // half a step, or nearly
  EXPECT_EQ(verdict_of("two surfaces 0.4 m apart: closed form", 1e3 * coarse), Verdict::fail);
}

TEST(PhaseNoise, IsOneOverTheSignalAndTellsOtherNoise) {
  const std::string row = "phase noise over signal";
  Scanner s = find_scanner("optab-yawing");
  s.range_noise = s.range_noise_growth = s.leakage = 0;
  s.phase_bits = 0;
  EXPECT_EQ(verdict_of(row, phase_noise_slope(s, 3)), Verdict::pass);
  s.amplitude_noise /= 2;  // the slope is of ratios
  EXPECT_EQ(verdict_of(row, phase_noise_slope(s, 3)), Verdict::pass);
  s.range_noise = 0.02;
  EXPECT_EQ(verdict_of(row, phase_noise_slope(s, 3)), Verdict::fail);
}

TEST(BruteForce, FindsTheDistancesOfTheRayCaster) {
  EXPECT_LT(brute_force_difference(RayCaster(cave(5, 3, 0.2)), {0.3, -0.2, 0.1}, 2000, 1), 1e-12);
  // Open at one side: both see nothing there.
  TriangleMesh open = box({2, 3, 4});
  open.triangles.resize(10);
  open.material.resize(10);
  EXPECT_LT(brute_force_difference(RayCaster(open), {0.3, -0.2, 0.1}, 2000, 1), 1e-12);
}

TEST(BeamShares, AreOfBeamsAndOfPoints) {
  Scan scan;
  scan.beams = 8;
  scan.echo = {1, 1, 2, 1};
  scan.flags = {flag_none, flag_mixed_pixel, flag_mixed_pixel, flag_wrapped | flag_outlier};
  const BeamShares shares = beam_shares(scan);
  EXPECT_EQ(shares.returned, 3.0 / 8);
  EXPECT_EQ(shares.mixed, 0.5);
  EXPECT_EQ(shares.wrapped, 0.25);
  EXPECT_EQ(shares.outliers, 0.25);
}

}  // namespace
}  // namespace minescan
