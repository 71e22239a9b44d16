// SPDX-License-Identifier: MIT
// Simulated scanners measured as real ones are, beside the figures published of these.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/interval.h"
#include "sim/raycaster.h"
#include "sim/scanner.h"

namespace minescan {

/// What is known of an instrument, or must hold of any.
struct Expectation {
  std::string name = {};
  std::string what = {};                  // what is measured, and how
  std::string unit = {};                  // "" where there is none
  std::optional<Interval> accepted = {};  // none: nothing is known, the figure is only reported
  std::string source = {};                // of the accepted figures, with their tolerance
};

/// An expectation with what came out.
struct Finding {
  Expectation expected = {};
  double measured = 0;
};

enum class Verdict { pass, fail, reported };
constexpr auto names_of(Verdict) {
  return std::to_array<std::string_view>({"pass", "fail", "reported"});
}

/// A figure that is not a number fails where anything is expected.
Verdict verdict(const Finding& finding);

/// One row of a table of measurements.
struct ValidationRow {
  Expectation expected = {};
  std::function<double(std::uint64_t seed)> measure = {};
};

/// All measurements that need no mine: range noise, mixed pixels, phases, distances.
const std::vector<ValidationRow>& validation_rows();

// The measurements, each of any scanner.

/// How ranges to a still plate scatter about their mean at each place, one sigma, metres, with the
/// variance of rounding to `quantisation` removed. 20 places spread over `ranges`, 2000 readings
/// each; the plate is met head-on by a scanner that has warmed up and stands still.
double range_sigma(const Scanner& scanner, const Interval& ranges, double reflectance,
                   std::uint64_t seed);

/// The share of readings of such a plate, reflectance 0.35, that equal the reading before, ranges
/// being rounded to `step` metres. 100 places that lie anywhere between two steps.
double equal_readings(const Scanner& scanner, const Interval& ranges, double step,
                      std::uint64_t seed);

/// Jumps in the scans of single planes, counted as in a log without truth. Beam k holds an
/// intermediate return if those before and after it differ by more than 1 m and its range lies
/// between theirs, more than 0.15 m from each. Two neighbours that differ by more than 1 m, none of
/// them intermediate, are a jump without one. Beams without return take part in neither.
struct Jumps {
  std::size_t all = 0;
  std::vector<double> positions =
      {};  // of the intermediate returns, 0 on the nearer surface, 1 far

  double intermediate_share() const;
  double median_position() const;
};

/// Adds those of a scan of one plane.
void count_jumps(const Scan& scan, Jumps& jumps);

/// Those of a scanner in the middle of screens of 15 degrees each, at 2 to 10 m, whose ranges
/// differ by 1 to 4 m from one to the next; reflectances between 0.2 and 0.5. 1000 such places.
Jumps screen_jumps(const Scanner& scanner, std::uint64_t seed);

/// The distance after which ranges repeat when only tone `tone` is there, metres: what is missing
/// from the range of a plate one and a half intervals away.
double ambiguity_interval(const Scanner& scanner, std::size_t tone, std::uint64_t seed);

/// A footprint on two plates, one `separation` metres behind the other, that 40 beams move across.
struct TwoSurfaces {
  double worst_difference = 0;  // metres, to the closed form
  double between = 0;  // share of those beams that see both whose range lies between the plates
};
/// The noise and the systematic errors of `scanner` are left out. The closed form is the sum of the
/// phasors of 19 places of a Gaussian beam, in double precision, for each tone, and the periods
/// from coarse to fine.
TwoSurfaces two_surfaces(const Scanner& scanner, double separation);

/// The slope of sigma_R 4 pi f / c over 1 / sqrt(2 SNR), fitted through the origin over signals
/// of many strengths, with SNR = A^2 / (2 sigma_n^2), A the mean amplitude and sigma_n the noise of
/// each component: 1 if sigma_phi = sigma_n / A. By the finest tone alone.
double phase_noise_slope(const Scanner& scanner, std::uint64_t seed);

/// The largest relative difference between the ranges of `count` rays from `origin` and those that
/// a test of every triangle in double precision finds; infinite if one is hit by only one of them.
double brute_force_difference(const RayCaster& caster, const Eigen::Vector3d& origin,
                              std::uint64_t count, std::uint64_t seed);

/// What became of the beams of a scan.
struct BeamShares {
  double returned = 0;  // of the beams
  double mixed = 0;     // of the points, as the others
  double wrapped = 0;
  double outliers = 0;
};
BeamShares beam_shares(const Scan& scan);

}  // namespace minescan
