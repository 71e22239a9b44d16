// SPDX-License-Identifier: MIT
#include "eval/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "core/text.h"
#include "eval/metrics.h"
#include "eval/paired.h"

namespace minescan {
namespace {

constexpr std::size_t questions = 3;

// One trial in both: how it was and how it is.
struct Matched {
  const Outcome* before = nullptr;
  const Outcome* now = nullptr;
  bool changed = false;
};

using ById = std::map<std::string, const Outcome*>;

ById by_id(const std::vector<Outcome>& outcomes) {
  ById map;  // a trial that two studies share is one trial
  for (const Outcome& outcome : outcomes) map.try_emplace(trial_id(outcome.trial), &outcome);
  return map;
}

std::vector<Matched> match(const ById& before, const ById& now, const CheckOptions& options,
                           CheckResult& result) {
  std::vector<Matched> matched;
  for (const auto& [id, old] : before) {
    const auto found = now.find(id);
    if (found == now.end()) {
      ++result.missing;
      continue;
    }
    const Outcome& current = *found->second;
    const PoseError move = pose_error(old->result.T_target_source, current.result.T_target_source);
    const bool same =
        move.translation <= options.pose_tolerance && move.rotation <= options.pose_tolerance &&
        quality(*old) == quality(current) && old->message.empty() == current.message.empty();
    matched.push_back({old, &current, !same});
    result.changed += !same;
    result.largest_move = std::max(result.largest_move, move.translation);
    result.largest_turn = std::max(result.largest_turn, move.rotation);
  }
  result.common = matched.size();
  result.extra = now.size() - matched.size();
  return matched;
}

std::string level_text(const Trial& trial) {
  std::string text = fmt::format("{} m, {} rad", number_text(trial.initial_translation),
                                 number_text(trial.initial_rotation));
  for (const auto& [name, value] : trial.settings) text += fmt::format(", {}={}", name, value);
  return text;
}

using Groups = std::map<std::string, std::vector<Matched>>;

// From fine to coarse.
struct Grouping {
  std::string name = {};
  std::function<std::string(const Trial&)> key = {};
};
const std::vector<Grouping>& groupings() {
  static const std::vector<Grouping> list = {
      {"method, pair and level",
       [](const Trial& t) { return fmt::format("{}, {}, {}", t.method, t.pair, level_text(t)); }},
      {"method and pair", [](const Trial& t) { return fmt::format("{}, {}", t.method, t.pair); }},
      {"method", [](const Trial& t) { return t.method; }}};
  return list;
}

// The number of trials from which on a test can be significant among so many: 2^-n <= alpha /
// tests.
std::size_t trials_needed(std::size_t tests, double alpha) {
  std::size_t n = 1;
  while (smallest_p_value(n) > alpha / static_cast<double>(tests)) ++n;
  return n;
}

Groups group(const std::vector<Matched>& matched, const CheckOptions& options,
             CheckResult& result) {
  Groups groups;
  for (const Grouping& grouping : groupings()) {
    groups.clear();
    for (const Matched& m : matched) groups[grouping.key(m.before->trial)].push_back(m);
    result.grouping = grouping.name;
    result.needed =
        trials_needed(std::max<std::size_t>(1, questions * groups.size()), options.alpha);
    if (std::all_of(groups.begin(), groups.end(),
                    [&](const auto& g) { return g.second.size() >= result.needed; }))
      break;
  }
  return groups;
}

CheckTest test_errors(const std::vector<Matched>& group, Question question,
                      const CheckOptions& options) {
  const Metric& metric = find_metric(
      question == Question::translation_error ? "translation_error_m" : "rotation_error_rad");
  const double floor = options.error_floor * metric.good;
  std::vector<double> before, now, ratios, beyond;  // the last two as logarithms
  CheckTest test{.question = question};
  for (const Matched& m : group) {
    before.push_back(metric.value(*m.before));
    now.push_back(metric.value(*m.now));
    const double ratio =
        m.changed ? std::log(std::max(now.back(), floor) / std::max(before.back(), floor)) : 0;
    ratios.push_back(ratio);
    beyond.push_back(ratio - std::log(options.ratio_margin));
    test.worse += ratio > 0;
    test.better += ratio < 0;
  }
  const HodgesLehmann typical = hodges_lehmann(ratios);
  test.before = quantile(before, 0.5);
  test.now = quantile(now, 0.5);
  test.effect = std::exp(typical.estimate);
  test.interval = {std::exp(typical.interval.low), std::exp(typical.interval.high)};
  test.p = wilcoxon_signed_rank(beyond).greater;
  return test;
}

CheckTest test_failures(const std::vector<Matched>& group) {
  CheckTest test{.question = Question::failures};
  std::size_t before = 0, now = 0;
  for (const Matched& m : group) {
    const bool failed_before = quality(*m.before) == Quality::failed;
    const bool fails_now = quality(*m.now) == Quality::failed;
    before += failed_before;
    now += fails_now;
    test.worse += fails_now && !failed_before;
    test.better += failed_before && !fails_now;
  }
  const double n = static_cast<double>(group.size());
  test.before = static_cast<double>(before) / n;
  test.now = static_cast<double>(now) / n;
  test.effect = test.now - test.before;
  test.p = mcnemar(test.worse, test.better).greater;
  return test;
}

std::vector<CheckTest> test_groups(const Groups& groups, std::size_t needed,
                                   const CheckOptions& options) {
  std::vector<CheckTest> tests;
  for (const auto& [name, group] : groups) {
    const auto changed = static_cast<std::size_t>(
        std::count_if(group.begin(), group.end(), [](const Matched& m) { return m.changed; }));
    for (CheckTest test :
         {test_errors(group, Question::translation_error, options),
          test_errors(group, Question::rotation_error, options), test_failures(group)}) {
      test.group = name;
      test.trials = group.size();
      test.changed = changed;
      test.too_few = changed > 0 && group.size() < needed;
      tests.push_back(std::move(test));
    }
  }
  std::vector<double> p;
  for (const CheckTest& test : tests) p.push_back(test.p);
  const std::vector<double> adjusted = holm_adjusted(p);
  for (std::size_t i = 0; i < tests.size(); ++i) {
    CheckTest& test = tests[i];
    test.p_adjusted = adjusted[i];
    // The margin of the errors is part of their test.
    const bool beyond_margin =
        test.question != Question::failures || test.effect > options.failure_margin;
    test.regression = test.p_adjusted <= options.alpha && beyond_margin;
  }
  return tests;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

void conclude(CheckResult& result) {
  const auto regressions = static_cast<std::size_t>(std::count_if(
      result.tests.begin(), result.tests.end(), [](const CheckTest& t) { return t.regression; }));
  const auto broken = static_cast<std::size_t>(std::count_if(
      result.limits.begin(), result.limits.end(), [](const LimitResult& l) { return !l.holds; }));
  const auto too_few = std::find_if(result.tests.begin(), result.tests.end(),
                                    [](const CheckTest& t) { return t.too_few; });
  std::vector<std::string> reasons;
  if (regressions > 0)
    reasons.push_back(counted(regressions, "significant change") + " for the worse");
  if (broken > 0) reasons.push_back(counted(broken, "limit") + " broken");
  if (!reasons.empty()) {
    result.verdict = Verdict::regression;
  } else {
    if (result.common == 0)
      reasons.push_back("no trial is both in the results and in the baseline");
    else if (result.missing > 0)
      reasons.push_back(fmt::format("{} of the baseline's {} missing in the results",
                                    result.missing,
                                    counted(result.common + result.missing, "trial")));
    if (too_few != result.tests.end())
      reasons.push_back(fmt::format("{} has changed and has {}, a verdict needs {}", too_few->group,
                                    counted(too_few->trials, "trial"), result.needed));
    result.verdict = reasons.empty() ? Verdict::ok : Verdict::cannot_tell;
  }
  if (reasons.empty())
    reasons.push_back(
        result.changed == 0
            ? fmt::format("all poses of {} are the same", counted(result.common, "trial"))
            : fmt::format("{} of {} changed, none of it significantly worse", result.changed,
                          counted(result.common, "trial")));
  constexpr const char* names[] = {"no regression", "REGRESSION", "cannot tell"};
  result.summary =
      fmt::format("{}: {}", names[static_cast<std::size_t>(result.verdict)], join(reasons, "; "));
}

}  // namespace

CheckResult check(const std::vector<Outcome>& results, const Baseline& baseline,
                  const std::vector<Limit>& limits, const CheckOptions& options) {
  CheckResult result;
  result.limits = check_limits(results, limits);
  const ById before = by_id(baseline.outcomes), now = by_id(results);
  const std::vector<Matched> matched = match(before, now, options, result);
  const Groups groups = group(matched, options, result);
  if (result.changed > 0) result.tests = test_groups(groups, result.needed, options);
  conclude(result);
  return result;
}

}  // namespace minescan
