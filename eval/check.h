// SPDX-License-Identifier: MIT
// Did the results become worse? New results against kept ones, on the same start poses.
//
// Trials are matched by their id. If all poses agree within a tolerance, there is nothing to test.
// Otherwise each group of trials (see CheckResult::grouping) is asked three questions:
//
// - translation and rotation errors: is the typical ratio new / old above the margin? Wilcoxon's
//   signed-rank test on log(ratio) - log(margin), one-sided, with the Hodges-Lehmann ratio;
// - failures: did more trials go from success to failure than the other way? McNemar's exact test,
//   one-sided, and more failures than the margin allows.
//
// p-values are adjusted (Holm) over all questions, so that the chance of a false alarm is at most
// alpha for the check as a whole, however many groups there are.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/fields.h"
#include "eval/baseline.h"
#include "eval/limits.h"
#include "eval/statistics.h"
#include "eval/trial.h"

namespace minescan {

struct CheckOptions {
  double alpha = 0.01;         // assumed: one false alarm in a hundred changes that do change poses
  double ratio_margin = 1.10;  // assumed, of the errors
  double failure_margin = 0.03;  // assumed, of all trials
  double pose_tolerance = 1e-9;  // what compilers and processors may differ by; metres and radians
  double error_floor = 0.001;    // assumed: a thousandth of a good match's limit is as good as zero
};

template <class Visitor>
void fields(CheckOptions& o, Visitor&& field) {
  field("alpha", o.alpha, above_up_to(0, 0.5), "", "chance of a false alarm of the whole check");
  field("ratio-margin", o.ratio_margin, between(1, 100), "",
        "errors may grow by this factor before it is a regression");
  field("failure-margin", o.failure_margin, between(0, 1), "",
        "part of all trials that may fail in addition before it is a regression");
  field("pose-tolerance", o.pose_tolerance, not_negative, "m and rad",
        "poses closer than this are the same");
  field("error-floor", o.error_floor, positive, "",
        "errors below this part of the limit of a good match count as equal to it");
}

enum class Verdict { ok, regression, cannot_tell };
constexpr auto names_of(Verdict) {
  return std::to_array<std::string_view>({"ok", "regression", "cannot_tell"});
}

enum class Question { translation_error, rotation_error, failures };
constexpr auto names_of(Question) {
  return std::to_array<std::string_view>({"translation_error", "rotation_error", "failures"});
}

/// One question to one group.
struct CheckTest {
  std::string group = {};  // "junction, ndt, 1 m, 0.1 rad"
  Question question = Question::translation_error;
  std::size_t trials = 0;
  std::size_t changed = 0;  // trials whose pose or quality is another
  double before = 0;        // median error (m or rad), or share of failures
  double now = 0;
  double effect = 1;       // typical ratio of errors, or difference of the shares
  Interval interval = {};  // 95 % of a ratio; unused for failures
  std::size_t worse = 0;   // trials that became worse, and better: errors, or success and failure
  std::size_t better = 0;
  double p = 1;
  double p_adjusted = 1;
  bool regression = false;
  bool too_few = false;  // even if all trials became worse, chance could not be excluded
};

struct CheckResult {
  Verdict verdict = Verdict::cannot_tell;
  std::string summary = {};   // the verdict and why, one sentence
  std::string grouping = {};  // "method, pair and level", "method and pair", or "method"
  std::size_t common = 0;     // trials in both
  std::size_t missing = 0;    // only in the baseline
  std::size_t extra = 0;      // only in the results; not looked at, but for limits
  std::size_t changed = 0;    // of the common ones
  double largest_move = 0;    // of a pose, m
  double largest_turn = 0;    // rad
  std::size_t needed = 0;     // trials that a group needs at least
  std::vector<CheckTest> tests = {};
  std::vector<LimitResult> limits = {};
};

/// Compares `results` with the baseline. Groups are as fine as the numbers of trials allow: method,
/// pair and level (start error and settings) apart, else levels pooled, else pairs too.
///
/// - regression: a question is answered with yes, or a limit is broken
/// - cannot_tell: otherwise, if there are no common trials, trials of the baseline are missing, or
/// a
///   group that has changed is too small
/// - ok: otherwise
///
/// Throws std::invalid_argument if a limit matches no row.
CheckResult check(const std::vector<Outcome>& results, const Baseline& baseline,
                  const std::vector<Limit>& limits = {}, const CheckOptions& options = {});

}  // namespace minescan
