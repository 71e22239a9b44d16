// SPDX-License-Identifier: MIT
#include "eval/check_self_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/parallel.h"
#include "core/random.h"

namespace minescan {
namespace {

constexpr double shared_sigma = 0.5, own_sigma = 0.3, failure_rate = 0.05;

// `shared` is the start pose's, `own` the result's; `harm` is what was done to the method.
Outcome simulated(const Trial& trial, Random& shared, Random& own, const SelfTestCase& harm) {
  Outcome outcome;
  outcome.trial = trial;
  const double hardness = std::exp(shared_sigma * shared.normal());
  const bool fails = shared.uniform() < failure_rate || own.uniform() < harm.more_failures;
  const auto error = [&](double typical) {
    return typical * hardness * harm.error_factor * std::exp(own_sigma * own.normal());
  };
  // Typical errors far within the limits of a good match, so that only `fails` decides on failure.
  const double translation = error(0.01), rotation = error(0.0005);
  outcome.error = {.translation = translation, .rotation = rotation};
  outcome.result.status = fails ? Status::max_iterations : Status::converged;
  outcome.result.T_target_source =
      displaced(Pose::Identity(), {translation, 0, 0}, {0, 0, 1}, std::min(3.0, rotation));
  return outcome;
}

Verdict one_comparison(const SelfTestCase& harm, std::size_t trials, std::uint64_t seed,
                       const CheckOptions& options) {
  Baseline before;
  std::vector<Outcome> now;
  std::uint64_t stream = 0;
  for (const bool harmed : {false, true})
    for (std::size_t i = 0; i < trials; ++i, ++stream) {
      const Trial trial{.pair = "simulated",
                        .method = harmed ? "harmed" : "untouched",
                        .start = static_cast<int>(i),
                        .starts = static_cast<int>(trials)};
      Random shared(derived_seed(seed, "shared"), stream), again = shared;
      Random own_before(derived_seed(seed, "before"), stream);
      Random own_now(derived_seed(seed, "now"), stream);
      before.outcomes.push_back(simulated(trial, shared, own_before, {}));
      now.push_back(simulated(trial, again, own_now, harmed ? harm : SelfTestCase{}));
    }
  return check(now, before, {}, options).verdict;
}

}  // namespace

const std::vector<SelfTestCase>& self_test_cases() {
  static const std::vector<SelfTestCase> table = {
      {.name = "nothing but chance"},
      {.name = "errors x 1.1", .error_factor = 1.1},  // the margin itself
      {.name = "errors x 1.25", .error_factor = 1.25, .is_regression = true},
      {.name = "errors x 1.5", .error_factor = 1.5, .is_regression = true},
      {.name = "errors x 2", .error_factor = 2, .is_regression = true},
      {.name = "10 % more failures", .more_failures = 0.10, .is_regression = true},
      {.name = "20 % more failures", .more_failures = 0.20, .is_regression = true},
      {.name = "50 % more failures", .more_failures = 0.50, .is_regression = true},
  };
  return table;
}

std::vector<SelfTestRow> check_self_test(std::size_t trials, std::size_t repetitions,
                                         std::uint64_t seed, const CheckOptions& options) {
  if (trials == 0 || repetitions == 0)
    throw std::invalid_argument("self-test: expected at least one trial and one repetition");
  std::vector<SelfTestRow> rows;
  for (const SelfTestCase& harm : self_test_cases()) {
    std::vector<Verdict> verdicts(repetitions);
    parallel_for(repetitions, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        verdicts[i] = one_comparison(
            harm, trials, derived_seed(seed, fmt::format("{} {}", harm.name, i)), options);
    });
    const auto regressions =
        static_cast<std::size_t>(std::count(verdicts.begin(), verdicts.end(), Verdict::regression));
    rows.push_back({.simulated = harm,
                    .trials = trials,
                    .repetitions = repetitions,
                    .regressions = regressions,
                    .rate = clopper_pearson_interval(regressions, repetitions)});
  }
  return rows;
}

std::string self_test_text(const std::vector<SelfTestRow>& rows) {
  std::string text;
  for (const SelfTestRow& row : rows)
    text += fmt::format(
        "{:<20} {} trials: {} in {:5.1f} % of {} checks [{:.1f}, {:.1f}]\n", row.simulated.name,
        row.trials, row.simulated.is_regression ? "detected" : "false alarm",
        100.0 * static_cast<double>(row.regressions) / static_cast<double>(row.repetitions),
        row.repetitions, 100 * row.rate.low, 100 * row.rate.high);
  return text;
}

}  // namespace minescan
