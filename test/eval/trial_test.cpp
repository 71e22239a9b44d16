// SPDX-License-Identifier: MIT
#include "eval/trial.h"

#include <gtest/gtest.h>

#include <set>

#include "eval/metrics.h"
#include "small_values.h"

namespace minescan {
namespace {

Trial small_trial(const std::string& method) {
  return {.study = "s", .pair = "pair", .origin = "two points", .method = method};
}

Outcome converged(double translation, double rotation) {
  Outcome outcome;
  outcome.result.status = Status::converged;
  outcome.error = {.translation = translation, .rotation = rotation};
  return outcome;
}

TEST(TrialId, ChangesWithEverythingThatDecidesTheResult) {
  const Trial trial = small_trial("ndt");
  const std::vector<std::function<void(Trial&)>> changes = {
      [](Trial&) {}, [](Trial& t) { t.pair = "other"; }, [](Trial& t) { t.origin = "other"; },
      [](Trial& t) { t.method = "icp"; }, [](Trial& t) { t.settings["cell-size"] = "2"; },
      [](Trial& t) { t.settings["cell-size"] = "3"; },
      [](Trial& t) { t.settings["cell"] = "-size2"; },
      [](Trial& t) { t.initial_translation = 1.0000000000000002; },
      [](Trial& t) { t.initial_rotation = 0; }, [](Trial& t) { t.start = 1; },
      [](Trial& t) { t.starts = 101; }, [](Trial& t) { t.seed = 2; },
      // text that wanders from one field to the next
      [](Trial& t) { t.pair = "pairtwo", t.origin = " points"; }};
  std::set<std::string> ids;
  for (const auto& change : changes) {
    Trial changed = trial;
    change(changed);
    ids.insert(trial_id(changed));
  }
  EXPECT_EQ(ids.size(), changes.size());
}

TEST(TrialId, DoesNotChangeWithLabels) {
  Trial trial = small_trial("ndt");
  const std::string id = trial_id(trial);
  trial.study = "other";
  trial.axes["cell-size"] = 1;
  trial.initial_rotation = 0;
  const std::string plus_zero = trial_id(trial);
  trial.initial_rotation = -0.0;
  EXPECT_EQ(trial_id(trial), plus_zero);
  trial.initial_rotation = 0.1;
  EXPECT_EQ(trial_id(trial), id);
}

// A result table written last year must be found again. The expectation was computed in Python 3.11
// (FNV-1a and Philox4x32-10 written from their papers) from the text "4:pair,10:two points,...".
TEST(TrialId, IsTheSameOnEveryMachine) {
  EXPECT_EQ(trial_id(small_trial("ndt")).size(), 16u);
  EXPECT_EQ(trial_id(small_trial("ndt")), "14a0298a1aa0bd36");
}

TEST(Quality, HasTheLimitsOfThePaper) {
  EXPECT_EQ(quality(converged(0.10, 0.005)), Quality::good);
  EXPECT_EQ(quality(converged(0.1001, 0.005)), Quality::acceptable);
  EXPECT_EQ(quality(converged(0.10, 0.0051)), Quality::acceptable);
  EXPECT_EQ(quality(converged(0.20, 0.010)), Quality::acceptable);
  EXPECT_EQ(quality(converged(0.2001, 0)), Quality::failed);
  EXPECT_EQ(quality(converged(0, 0.0101)), Quality::failed);
  EXPECT_EQ(quality(converged(NAN, 0)), Quality::failed);
}

TEST(Quality, NeedsConvergence) {
  for (const Status status :
       {Status::not_run, Status::max_iterations, Status::no_overlap, Status::degenerate}) {
    Outcome outcome = converged(0, 0);
    outcome.result.status = status;
    EXPECT_EQ(quality(outcome), Quality::failed);
  }
  Outcome threw = converged(0, 0);
  threw.message = "bad";
  EXPECT_EQ(quality(threw), Quality::failed);
  EXPECT_EQ(quality(Outcome{}), Quality::failed);
}

TEST(RunTrial, MeasuresTheErrorsOfTheResult) {
  const ScanPair pair = small_pair();
  Method method{.name = "fixed"};
  // 0.3 m further along the line of the scanners, 0.4 m across, turned by 0.02 rad.
  const Eigen::Vector3d along = pair.T_target_source.translation().normalized();
  const Eigen::Vector3d across = along.unitOrthogonal();
  method.run = [&](const PointCloud&, const PointCloud&, const Pose&, const Settings&) {
    RegistrationResult result;
    result.status = Status::converged;
    result.T_target_source = Eigen::Translation3d(0.3 * along + 0.4 * across) *
                             pair.T_target_source * Eigen::AngleAxisd(0.02, across);
    return result;
  };
  const Outcome outcome = run_trial(small_trial("fixed"), pair, method);
  // rounding
  EXPECT_NEAR(outcome.error.translation, 0.5, 1e-14);
  EXPECT_NEAR(outcome.error.rotation, 0.02, 1e-14);
  EXPECT_NEAR(outcome.axial_error, 0.3, 1e-14);
  EXPECT_EQ(outcome.message, "");
}

TEST(RunTrial, StartsWithTheStatedError) {
  const ScanPair pair = small_pair();
  Method echo{.name = "echo"};
  echo.run = [](const PointCloud&, const PointCloud&, const Pose& guess, const Settings&) {
    RegistrationResult result;
    result.T_target_source = guess;
    return result;
  };
  Trial trial = small_trial("echo");
  trial.initial_translation = 2.5;
  trial.initial_rotation = 0.35;
  const Outcome outcome = run_trial(trial, pair, echo);
  EXPECT_NEAR(outcome.error.translation, 2.5, 1e-14);  // rounding
  EXPECT_NEAR(outcome.error.rotation, 0.35, 1e-14);
  EXPECT_EQ(outcome.result.T_target_source.matrix(), start_pose(trial, pair).matrix());
}

TEST(RunTrial, KeepsWhatAMethodThrows) {
  const ScanPair pair = small_pair();
  const Trial trial = small_trial("bad");
  const Outcome outcome = run_trial(trial, pair, throwing_method("bad"));
  EXPECT_EQ(outcome.message, "cannot, ever: \"quoted\"");
  EXPECT_EQ(outcome.result.status, Status::not_run);
  EXPECT_NEAR(outcome.error.translation, trial.initial_translation, 1e-14);
  Method odd{.name = "bad"};
  odd.run = [](const PointCloud&, const PointCloud&, const Pose&,
               const Settings&) -> RegistrationResult { throw 7; };
  EXPECT_NE(run_trial(trial, pair, odd).message, "");
  odd.run = [](const PointCloud&, const PointCloud&, const Pose&, const Settings&) {
    RegistrationResult result;
    result.status = Status::converged;
    result.T_target_source.translation().x() = NAN;
    return result;
  };
  const Outcome not_finite = run_trial(trial, pair, odd);
  EXPECT_NE(not_finite.message, "");
  EXPECT_EQ(quality(not_finite), Quality::failed);
}

TEST(RunTrial, RefusesAForeignPairOrMethodAndBadErrors) {
  EXPECT_THROW(run_trial(small_trial("bad"), small_pair("other"), throwing_method("bad")),
               std::invalid_argument);
  EXPECT_THROW(run_trial(small_trial("bad"), small_pair(), throwing_method("good")),
               std::invalid_argument);
  EXPECT_THROW(run_trial(small_trial("no such method"), small_pair()), std::invalid_argument);
  Trial trial = small_trial("bad");
  trial.initial_rotation = 4;
  EXPECT_THROW(run_trial(trial, small_pair(), throwing_method("bad")), std::invalid_argument);
}

TEST(RunSettings, DrawSamplesByStartPoseAlone) {
  const Method method = shrinking_method("a", 0.1);
  Trial trial = small_trial("a");
  const std::string first = run_settings(trial, method).at("sample-seed");
  trial.initial_translation = 4;
  trial.settings["cell-size"] = "2";
  EXPECT_EQ(run_settings(trial, method).at("sample-seed"), first);
  trial.start = 1;
  EXPECT_NE(run_settings(trial, method).at("sample-seed"), first);
  EXPECT_NO_THROW(method.fields[1].canonical(run_settings(trial, method).at("sample-seed")));
  trial.settings["sample-seed"] = "5";
  EXPECT_EQ(run_settings(trial, method).at("sample-seed"), "5");
  EXPECT_FALSE(run_settings(small_trial("b"), throwing_method("b")).contains("sample-seed"));
}

TEST(Metrics, MeasureTheirColumn) {
  Outcome o;
  o.error = {.translation = 1, .rotation = 2};
  o.result.time = {.target = 3, .source = 30, .align = 300};
  o.axial_error = 4;
  o.result.iterations = 5;
  o.result.cpu = 6;
  o.result.target_bytes = 7;
  const std::vector<std::pair<std::string, double>> expected = {
      {"translation_error_m", 1}, {"rotation_error_rad", 2}, {"time_s", 333},
      {"axial_error_m", 4},       {"iterations", 5},         {"cpu_s", 6},
      {"target_bytes", 7}};
  ASSERT_EQ(metrics().size(), expected.size());
  for (const auto& [name, value] : expected) {
    EXPECT_EQ(find_metric(name).value(o), value) << name;
    EXPECT_FALSE(find_metric(name).description.empty());
    EXPECT_FALSE(find_metric(name).label.empty());
  }
  EXPECT_THROW(find_metric("speed"), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
