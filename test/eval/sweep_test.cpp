// SPDX-License-Identifier: MIT
#include "eval/sweep.h"

#include <gtest/gtest.h>

#include <mutex>
#include <set>

#include "core/parallel.h"
#include "eval/study.h"
#include "small_values.h"

namespace minescan {
namespace {

const std::vector<Method>& test_methods() {
  static const std::vector<Method> list = {shrinking_method("a", 0.01),
                                           shrinking_method("b", 0.1, 2), throwing_method("bad")};
  return list;
}

Study small_study() {
  return {.name = "small",
          .methods = {"a", "b"},
          .axes = {{"initial-translation", {0.5, 1, 3}}},
          .trials = 10};
}

std::vector<Trial> small_trials() {
  return trials(small_study(), {small_pair()}, test_methods(), 1);
}

SweepCounts sweep(const std::vector<Trial>& list, ResultStore& store,
                  const SweepOptions& options = {},
                  const std::function<void(const SweepCounts&)>& progress = {}) {
  return run_sweep(list, {small_pair()}, test_methods(), store, options, progress);
}

// All of a row but its times.
std::string row_text(const Outcome& o) {
  std::string text = trial_id(o.trial) + o.trial.study + value_text(o.result.status) + o.message;
  for (const double x : o.result.T_target_source.matrix().reshaped()) text += number_text(x) + " ";
  return text + number_text(o.error.translation) + " " + number_text(o.error.rotation);
}

std::vector<std::string> rows_of(const ResultStore& store) {
  std::vector<std::string> rows;
  for (const Outcome& o : store.read()) rows.push_back(row_text(o));
  return rows;
}

std::vector<std::string> rows_of_one_run() {
  ResultStore store = ResultStore::create_or_resume(fresh_folder("sweep-whole") / "r.db");
  sweep(small_trials(), store);
  return rows_of(store);
}

TEST(Sweep, RunsEveryTrialOnce) {
  ResultStore store = ResultStore::create_or_resume(fresh_folder("sweep-once") / "r.db");
  std::size_t calls = 0;
  const SweepCounts counts =
      sweep(small_trials(), store, {.run = {.version = "v"}}, [&](const SweepCounts& c) {
        EXPECT_EQ(c.trials, 60u);
        EXPECT_EQ(c.finished, ++calls);
      });
  EXPECT_EQ(calls, 60u);
  EXPECT_EQ(counts.finished, 60u);
  EXPECT_EQ(counts.done_before, 0u);
  EXPECT_EQ(counts.threw, 0u);
  EXPECT_EQ(store.read().size(), 60u);
  ASSERT_EQ(store.runs().size(), 1u);
  EXPECT_EQ(store.runs()[0].version, "v");
  EXPECT_EQ(store.runs()[0].finished.size(), std::string("2026-01-31T12:00:00Z").size());

  const SweepCounts again = sweep(small_trials(), store);
  EXPECT_EQ(again.done_before, 60u);
  EXPECT_EQ(again.finished, 0u);
  EXPECT_EQ(store.runs().size(), 1u);  // nothing was run
}

TEST(Sweep, GivesTheSameRowsForAnyNumberOfThreads) {
  std::vector<std::string> rows[2];
  for (const int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    rows[threads == 4] = rows_of_one_run();
  }
  EXPECT_EQ(rows[0].size(), 60u);
  EXPECT_EQ(rows[0], rows[1]);
}

TEST(Sweep, ResumesWhereItWasStopped) {
  const std::vector<std::string> whole = rows_of_one_run();
  const auto path = fresh_folder("sweep-resume") / "r.db";
  std::size_t total = 0;
  for (int part = 0; part < 10; ++part) {
    ResultStore store = ResultStore::create_or_resume(path);
    const auto stop = [](const SweepCounts& c) {
      if (c.finished == 7) throw std::runtime_error("stop");
    };
    const std::size_t before = store.ids(true).size();
    EXPECT_EQ(before, total);
    try {
      sweep(small_trials(), store, {}, stop);
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "stop");
    }
    total = store.ids(true).size();
    EXPECT_GE(total, std::min<std::size_t>(60, before + 7));
  }
  EXPECT_EQ(rows_of(ResultStore::open(path)), whole);
}

TEST(Sweep, ShardsMakeUpTheWhole) {
  const auto folder = fresh_folder("sweep-shards");
  ResultStore joined = ResultStore::create_or_resume(folder / "all.db");
  for (int shard = 1; shard <= 7; ++shard) {
    const auto path = folder / (std::to_string(shard) + ".db");
    ResultStore store = ResultStore::create_or_resume(path);
    const SweepCounts counts = sweep(small_trials(), store, {.shard = shard, .shards = 7});
    EXPECT_EQ(counts.finished, shard <= 60 % 7 ? 9u : 8u);
    joined.merge(path);
  }
  EXPECT_EQ(rows_of(joined), rows_of_one_run());
}

TEST(Sweep, RefusesShardsOutOfRange) {
  ResultStore store = ResultStore::create_or_resume(fresh_folder("sweep-range") / "r.db");
  for (const auto& [shard, shards] : {std::pair{0, 3}, {4, 3}, {1, 0}, {-1, 3}})
    EXPECT_THROW(remaining_trials(small_trials(), store, {.shard = shard, .shards = shards}),
                 std::invalid_argument);
}

TEST(Sweep, GoesOnAfterATrialThatThrew) {
  Study study = small_study();
  study.methods = {"a", "bad"};
  const std::vector<Trial> list = trials(study, {small_pair()}, test_methods(), 1);
  ResultStore store = ResultStore::create_or_resume(fresh_folder("sweep-threw") / "r.db");
  const SweepCounts counts = sweep(list, store);
  EXPECT_EQ(counts.finished, 60u);
  EXPECT_EQ(counts.threw, 30u);
  EXPECT_EQ(sweep(list, store).finished, 0u);

  // Mended since.
  const std::vector<Method> mended = {shrinking_method("a", 0.01), shrinking_method("bad", 0.1)};
  const SweepCounts retried =
      run_sweep(list, {small_pair()}, mended, store, {.retry_failed = true});
  EXPECT_EQ(retried.finished, 30u);
  EXPECT_EQ(retried.threw, 0u);
  EXPECT_EQ(store.ids(false).size(), 60u);
}

TEST(Sweep, SharesTrialsBetweenStudies) {
  ResultStore store = ResultStore::create_or_resume(fresh_folder("sweep-shared") / "r.db");
  sweep(small_trials(), store);
  Study other = small_study();
  other.name = "other";
  other.axes = {{"cell-size", {0.5, 1}}};  // at the start error of 1 m, which "small" has too
  const SweepCounts counts = sweep(trials(other, {small_pair()}, test_methods(), 1), store);
  EXPECT_EQ(counts.trials, 40u);
  EXPECT_EQ(counts.done_before, 20u);  // cell-size 1 is the default
  const std::vector<Outcome> rows = store.read("other");
  EXPECT_EQ(rows.size(), 40u);
  for (const Outcome& row : rows) EXPECT_TRUE(row.trial.axes.contains("cell-size"));
  EXPECT_EQ(store.read("small").size(), 60u);
}

TEST(Sweep, RefusesMissingPairsAndMethodsBeforeAnythingIsRun) {
  ResultStore store = ResultStore::create_or_resume(fresh_folder("sweep-missing") / "r.db");
  EXPECT_THROW(run_sweep(small_trials(), {}, test_methods(), store), std::invalid_argument);
  EXPECT_THROW(run_sweep(small_trials(), {small_pair()}, {test_methods()[0]}, store),
               std::invalid_argument);
  EXPECT_TRUE(store.read().empty());
  EXPECT_TRUE(store.runs().empty());
}

}  // namespace
}  // namespace minescan
