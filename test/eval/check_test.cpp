// SPDX-License-Identifier: MIT
#include "eval/check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "eval/check_report.h"
#include "eval/check_self_test.h"
#include "small_values.h"

namespace minescan {
namespace {

// A table with two methods and two levels; `change` is applied to every row, given its number
// within the method and level.
std::vector<Outcome> table(int starts, const std::function<void(Outcome&, int)>& change = {}) {
  std::vector<Outcome> rows;
  for (const char* method : {"icp", "ndt"})
    for (const double level : {1.0, 2.0})
      for (int i = 0; i < starts; ++i) {
        Random random(41, rows.size());
        Outcome o;
        o.trial = {.study = "gate",
                   .pair = "junction",
                   .method = method,
                   .axes = {{"initial-translation", level}},
                   .initial_translation = level,
                   .start = i,
                   .starts = starts};
        o.result.status = Status::converged;
        o.error = {.translation = 0.02 * std::exp(0.5 * random.normal()),
                   .rotation = 0.001 * std::exp(0.5 * random.normal())};
        if (change) change(o, i);
        o.result.T_target_source =
            displaced(Pose::Identity(), {o.error.translation, 0, 0}, {0, 0, 1}, o.error.rotation);
        rows.push_back(o);
      }
  return rows;
}

CheckResult compare(const std::vector<Outcome>& now, int starts = 20,
                    const CheckOptions& options = {}) {
  return check(now, {.outcomes = table(starts)}, {}, options);
}

bool alarmed(const CheckResult& result, const std::string& group, Question question) {
  for (const CheckTest& test : result.tests)
    if (test.group.starts_with(group) && test.question == question) return test.regression;
  ADD_FAILURE() << "no test of " << group;
  return false;
}

TEST(Check, PassesTheSameResultsAtOnce) {
  const CheckResult result = compare(table(20));
  EXPECT_EQ(result.verdict, Verdict::ok);
  EXPECT_EQ(result.common, 80u);
  EXPECT_EQ(result.changed, 0u);
  EXPECT_TRUE(result.tests.empty());
}

TEST(Check, TakesPosesWithinTheToleranceForTheSame) {
  const auto moved = [](double by) {
    return table(20, [by](Outcome& o, int) { o.error.translation += by; });
  };
  EXPECT_EQ(compare(moved(0.9e-9)).changed, 0u);
  EXPECT_EQ(compare(moved(1.1e-9)).changed, 80u);
  EXPECT_EQ(compare(moved(1.1e-9)).verdict, Verdict::ok);
  // Even one trial is enough for a verdict when nothing has changed.
  EXPECT_EQ(compare(table(1), 1).verdict, Verdict::ok);
}

TEST(Check, SeesErrorsThatDoubled) {
  const CheckResult result = compare(table(20, [](Outcome& o, int) {
    if (o.trial.method == "ndt") o.error.translation *= 2;
  }));
  EXPECT_EQ(result.verdict, Verdict::regression);
  EXPECT_EQ(result.grouping, "method, pair and level");
  EXPECT_TRUE(alarmed(result, "ndt, junction, 1 m", Question::translation_error));
  EXPECT_TRUE(alarmed(result, "ndt, junction, 2 m", Question::translation_error));
  EXPECT_FALSE(alarmed(result, "ndt, junction, 1 m", Question::rotation_error));
  EXPECT_FALSE(alarmed(result, "icp, junction, 1 m", Question::translation_error));
  for (const CheckTest& test : result.tests)
    if (test.regression) {
      EXPECT_NEAR(test.effect, 2, 1e-12);
    }  // every ratio is 2
}

TEST(Check, SeesOneLevelThatBecameWorse) {
  const CheckResult result = compare(table(20, [](Outcome& o, int) {
    if (o.trial.method == "icp" && o.trial.initial_translation == 2) o.error.rotation *= 1.5;
  }));
  EXPECT_EQ(result.verdict, Verdict::regression);
  EXPECT_TRUE(alarmed(result, "icp, junction, 2 m", Question::rotation_error));
}

TEST(Check, IsNotAlarmedByChangesWithinTheMarginOrForTheBetter) {
  for (const double factor : {0.5, 1.05, 1.099}) {
    const CheckResult result =
        compare(table(100, [&](Outcome& o, int) { o.error.translation *= factor; }), 100);
    EXPECT_EQ(result.verdict, Verdict::ok) << factor;
    EXPECT_EQ(result.changed, 400u);
  }
  // The margin is an option.
  EXPECT_EQ(compare(table(100, [](Outcome& o, int) { o.error.translation *= 1.05; }), 100,
                    {.ratio_margin = 1.01})
                .verdict,
            Verdict::regression);
}

TEST(Check, IsNotAlarmedByErrorsTooSmallToMatter) {
  // Both far below a thousandth of 0.10 m and 0.005 rad.
  const auto tiny = [](double factor) {
    return table(20, [=](Outcome& o, int) {
      o.error = {.translation = factor * 1e-6, .rotation = factor * 1e-7};
    });
  };
  EXPECT_EQ(check(tiny(10), {.outcomes = tiny(1)}).verdict, Verdict::ok);
  EXPECT_EQ(check(tiny(10), {.outcomes = tiny(0)}).verdict, Verdict::ok);
}

TEST(Check, SeesFailures) {
  const auto failing = [](int count) {
    return table(40, [=](Outcome& o, int i) {
      if (o.trial.method == "ndt" && i < count) o.result.status = Status::max_iterations;
    });
  };
  const CheckResult many = compare(failing(20), 40);
  EXPECT_EQ(many.verdict, Verdict::regression);
  EXPECT_TRUE(alarmed(many, "ndt, junction, 1 m", Question::failures));
  EXPECT_FALSE(alarmed(many, "ndt, junction, 1 m", Question::translation_error));
  EXPECT_EQ(compare(failing(2), 40).verdict, Verdict::ok);  // chance could do that: p = 1/4
  EXPECT_EQ(check(table(40), {.outcomes = failing(20)}).verdict, Verdict::ok);  // mended
}

TEST(Check, CountsATrialThatThrewAsAFailure) {
  const CheckResult result = compare(table(40, [](Outcome& o, int) { o.message = "threw"; }), 40);
  EXPECT_EQ(result.verdict, Verdict::regression);
  EXPECT_EQ(result.changed, 160u);
}

TEST(Check, CannotTellWithoutTheTrialsOfTheBaseline) {
  std::vector<Outcome> part = table(20);
  part.pop_back();
  const CheckResult missing = compare(part);
  EXPECT_EQ(missing.verdict, Verdict::cannot_tell);
  EXPECT_EQ(missing.missing, 1u);
  EXPECT_NE(missing.summary.find("1 of the baseline's 80 trials"), std::string::npos);

  const CheckResult nothing = compare(table(20, [](Outcome& o, int) { o.trial.seed = 9; }));
  EXPECT_EQ(nothing.verdict, Verdict::cannot_tell);
  EXPECT_EQ(nothing.common, 0u);
  EXPECT_EQ(nothing.extra, 80u);
  EXPECT_EQ(compare({}).verdict, Verdict::cannot_tell);
  EXPECT_EQ(check(table(3), {}).verdict, Verdict::cannot_tell);

  // A regression among those that are there is one all the same.
  std::vector<Outcome> worse = table(20, [](Outcome& o, int) { o.error.translation *= 3; });
  worse.pop_back();
  EXPECT_EQ(compare(worse).verdict, Verdict::regression);
}

TEST(Check, IgnoresTrialsThatAreNew) {
  std::vector<Outcome> more = table(20);
  Outcome extra = more.back();
  extra.trial.seed = 77;
  more.push_back(extra);
  const CheckResult result = compare(more);
  EXPECT_EQ(result.verdict, Verdict::ok);
  EXPECT_EQ(result.extra, 1u);
}

TEST(Check, SaysHowManyTrialsItNeeds) {
  const auto worse = [](Outcome& o, int) { o.error.translation *= 3; };
  // 3 trials a level, 6 a method: pooled over levels, then pairs, 2 groups, 6 questions; the
  // smallest n with 2^-n <= 0.01 / 6 is 10.
  const CheckResult result = compare(table(3, worse), 3);
  EXPECT_EQ(result.verdict, Verdict::cannot_tell);
  EXPECT_EQ(result.needed, 10u);
  EXPECT_EQ(result.grouping, "method");
  EXPECT_NE(result.summary.find("needs 10"), std::string::npos) << result.summary;
  // 5 a level, 10 a method and pair: enough when pooled.
  const CheckResult pooled = compare(table(5, worse), 5);
  EXPECT_EQ(pooled.verdict, Verdict::regression);
  EXPECT_EQ(pooled.grouping, "method and pair");
}

TEST(Check, CountsATrialOfTwoStudiesOnce) {
  std::vector<Outcome> twice = table(20);
  for (const Outcome& o : table(20)) {
    twice.push_back(o);
    twice.back().trial.study = "other";
  }
  EXPECT_EQ(compare(twice).common, 80u);
  EXPECT_EQ(compare(twice).extra, 0u);
}

TEST(Limits, AreMeasuredOnTheResults) {
  const std::vector<Limit> limits = {
      {.name = "holds",
       .metric = "translation_error_m",
       .method = "ndt",
       .quantile = 0.5,
       .max = 0.1,
       .reason = "r"},
      {.name = "broken",
       .metric = "translation_error_m",
       .method = "ndt",
       .pair = "junction",
       .quantile = 1,
       .max = 0.001,
       .reason = "r"},
      {.name = "failures", .metric = "failure_rate", .method = "icp", .max = 0, .reason = "r"}};
  const CheckResult result = check(table(20), {.outcomes = table(20)}, limits);
  ASSERT_EQ(result.limits.size(), 3u);
  EXPECT_TRUE(result.limits[0].holds);
  EXPECT_EQ(result.limits[0].rows, 40u);
  EXPECT_FALSE(result.limits[1].holds);
  EXPECT_TRUE(result.limits[2].holds);
  EXPECT_EQ(result.limits[2].measured, 0);
  EXPECT_EQ(result.verdict, Verdict::regression);
  EXPECT_THROW(check(table(1), {}, {{.name = "x", .metric = "time_s", .method = "ndtt"}}),
               std::invalid_argument);
}

// Simulated results whose truth is known. With alpha = 0.01 and 300 checks, 3 false alarms are
// expected at most; 10 or more would have a chance of 0.1 %.
TEST(CheckSelfTest, FalseAlarmsAreRarerThanAlphaAndHarmIsFound) {
  for (const SelfTestRow& row : check_self_test(50, 300, 1)) {
    const double share = static_cast<double>(row.regressions) / 300;
    const std::string& name = row.simulated.name;
    if (!row.simulated.is_regression) {
      EXPECT_LE(row.regressions, 9u) << name;
    }
    if (row.simulated.error_factor >= 1.5) {
      EXPECT_GE(share, 0.99) << name;
    }
    if (row.simulated.more_failures >= 0.5) {
      EXPECT_GE(share, 0.99) << name;
    }
  }
}

TEST(CheckSelfTest, GivesTheSameNumbersAgain) {
  EXPECT_EQ(self_test_text(check_self_test(12, 20, 3)), self_test_text(check_self_test(12, 20, 3)));
  EXPECT_THROW(check_self_test(0, 1, 1), std::invalid_argument);
}

CheckResult result_with_every_kind_of_row() {
  CheckResult result = compare(table(20, [](Outcome& o, int) {
    o.trial.pair = "a<b>&\"c\" | d";
    if (o.trial.method == "ndt") o.error.translation *= 2;
  }));
  result = check(table(20,
                       [](Outcome& o, int) {
                         o.trial.pair = "a<b>&\"c\" | d";
                         if (o.trial.method == "ndt") o.error.translation *= 2;
                       }),
                 {.outcomes = table(20, [](Outcome& o, int) { o.trial.pair = "a<b>&\"c\" | d"; })},
                 {{.name = "l<1>",
                   .metric = "rotation_error_rad",
                   .method = "icp",
                   .max = 1e-9,
                   .reason = "because \"x\" < y"}});
  return result;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

TEST(CheckReport, JunitCountsAndEscapes) {
  const std::string xml = check_junit(result_with_every_kind_of_row());
  // 4 groups of 3 questions, one limit, one case for completeness.
  EXPECT_NE(xml.find("tests=\"14\" failures=\"3\" errors=\"0\""), std::string::npos) << xml;
  EXPECT_EQ(count_of(xml, "<testcase "), 14u);
  EXPECT_EQ(count_of(xml, "<failure "), 3u);
  EXPECT_NE(xml.find("a&lt;b&gt;&amp;&quot;c&quot; | d"), std::string::npos);
  EXPECT_EQ(xml.find("a<b"), std::string::npos);
  EXPECT_NE(check_junit(compare({})).find("errors=\"1\""), std::string::npos);
}

TEST(CheckReport, MarkdownHasAlarmsFirstAndEscapesCells) {
  const std::string text = check_markdown(result_with_every_kind_of_row());
  EXPECT_LT(text.find("| WORSE |"), text.find("| ok |"));
  EXPECT_NE(text.find("a&lt;b>&\"c\" \\| d"), std::string::npos) << text;
  EXPECT_NE(text.find("| BROKEN | l&lt;1> |"), std::string::npos) << text;
}

TEST(CheckReport, TextAndJsonTellTheVerdict) {
  const CheckResult result = result_with_every_kind_of_row();
  EXPECT_EQ(
      check_text(result).find("REGRESSION: 2 significant changes for the worse; 1 limit broken"),
      0u)
      << check_text(result);
  const std::string json = check_json(result);
  EXPECT_NE(json.find("\"verdict\": \"regression\""), std::string::npos);
  EXPECT_EQ(count_of(json, "\"question\""), 12u);
  EXPECT_NE(check_json(compare(table(1), 1)).find("\"verdict\": \"ok\""), std::string::npos);
}

}  // namespace
}  // namespace minescan
