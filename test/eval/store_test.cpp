// SPDX-License-Identifier: MIT
#include "eval/store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>

#include <cmath>
#include <csignal>
#include <fstream>

#include "small_values.h"

namespace minescan {
namespace {

Outcome full_outcome(std::uint64_t stream) {
  Random random(21, stream);
  const auto number = [&] { return random.normal() / 3; };  // no short decimal form
  Outcome o;
  o.trial = {.study = "fig16",
             .pair = "junction/3",
             .origin = "survey: junction, \"seed\": 1\n",
             .method = "ndt",
             .settings = {{"cell-size", "1.5"}, {"name", "a, \"b\""}},
             .axes = {{"cell-size", 1.5}, {"initial-translation", number()}},
             .initial_translation = number(),
             .initial_rotation = number(),
             .start = static_cast<int>(stream),
             .starts = 50,
             .seed = 0xffff'ffff'ffff'fff0u + stream};
  o.result.T_target_source =
      displaced(Pose::Identity(), {number(), number(), number()}, {number(), number(), 1}, 0.3);
  o.result.status = Status::max_iterations;
  o.result.iterations = 17;
  o.result.evaluations = 23;
  o.result.score = number();
  o.result.target_points = 72417;
  o.result.source_points = 139642;
  o.result.used_points = 13964;
  o.result.empty_points = 311;
  o.result.outside_points = 29;
  o.result.time = {.target = number(), .source = number(), .align = number()};
  o.result.cpu = number();
  o.result.target_bytes = 5'000'000'000;
  for (double& x : o.result.covariance.reshaped()) x = number();
  o.error = {.translation = number(), .rotation = number()};
  o.axial_error = number();
  o.message = "it's \"bad\", very\nbad; \xc3\xa4";
  return o;
}

void expect_same(const Outcome& a, const Outcome& b) {
  EXPECT_EQ(a.trial.study, b.trial.study);
  EXPECT_EQ(a.trial.pair, b.trial.pair);
  EXPECT_EQ(a.trial.origin, b.trial.origin);
  EXPECT_EQ(a.trial.method, b.trial.method);
  EXPECT_EQ(a.trial.settings, b.trial.settings);
  EXPECT_EQ(a.trial.axes, b.trial.axes);
  EXPECT_EQ(a.trial.initial_translation, b.trial.initial_translation);
  EXPECT_EQ(a.trial.initial_rotation, b.trial.initial_rotation);
  EXPECT_EQ(a.trial.start, b.trial.start);
  EXPECT_EQ(a.trial.starts, b.trial.starts);
  EXPECT_EQ(a.trial.seed, b.trial.seed);
  EXPECT_EQ(a.result.T_target_source.matrix(), b.result.T_target_source.matrix());
  EXPECT_EQ(a.result.status, b.result.status);
  EXPECT_EQ(a.result.iterations, b.result.iterations);
  EXPECT_EQ(a.result.evaluations, b.result.evaluations);
  EXPECT_EQ(a.result.score, b.result.score);
  EXPECT_EQ(a.result.target_points, b.result.target_points);
  EXPECT_EQ(a.result.source_points, b.result.source_points);
  EXPECT_EQ(a.result.used_points, b.result.used_points);
  EXPECT_EQ(a.result.empty_points, b.result.empty_points);
  EXPECT_EQ(a.result.outside_points, b.result.outside_points);
  EXPECT_EQ(a.result.time.target, b.result.time.target);
  EXPECT_EQ(a.result.time.source, b.result.time.source);
  EXPECT_EQ(a.result.time.align, b.result.time.align);
  EXPECT_EQ(a.result.cpu, b.result.cpu);
  EXPECT_EQ(a.result.target_bytes, b.result.target_bytes);
  EXPECT_EQ(a.result.covariance, b.result.covariance);
  EXPECT_EQ(a.error.translation, b.error.translation);
  EXPECT_EQ(a.error.rotation, b.error.rotation);
  EXPECT_EQ(a.axial_error, b.axial_error);
  EXPECT_EQ(a.message, b.message);
}

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void put(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// A file with `rows` rows of full_outcome.
std::filesystem::path store_with(const std::filesystem::path& path, std::uint64_t rows) {
  ResultStore store = ResultStore::create_or_resume(path);
  std::vector<Outcome> outcomes;
  for (std::uint64_t i = 0; i < rows; ++i) outcomes.push_back(full_outcome(i));
  store.write(outcomes, store.begin_run({.version = "1"}));
  return path;
}

// The same as a file of version 1, which lacks three columns.
std::filesystem::path old_store_with(const std::filesystem::path& path, std::uint64_t rows) {
  store_with(path, rows);
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database,
                         "ALTER TABLE trials DROP COLUMN evaluations;"
                         "ALTER TABLE trials DROP COLUMN empty_points;"
                         "ALTER TABLE trials DROP COLUMN outside_points;"
                         "PRAGMA user_version = 1",
                         nullptr, nullptr, nullptr),
            SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
  return path;
}

// What such a file gives back.
Outcome old_outcome(std::uint64_t stream) {
  Outcome outcome = full_outcome(stream);
  outcome.result.evaluations = 0;
  outcome.result.empty_points = outcome.result.outside_points = 0;
  return outcome;
}

TEST(ResultStore, GivesBackEveryBit) {
  const auto path = store_with(fresh_folder("store-bits") / "r.db", 20);
  const std::vector<Outcome> rows = ResultStore::open(path).read();
  ASSERT_EQ(rows.size(), 20u);
  for (const Outcome& row : rows)
    expect_same(row, full_outcome(static_cast<std::uint64_t>(row.trial.start)));
  for (std::size_t i = 1; i < rows.size(); ++i)
    EXPECT_LT(trial_id(rows[i - 1].trial), trial_id(rows[i].trial));
}

TEST(ResultStore, KeepsNumbersThatAreNotFinite) {
  const auto path = fresh_folder("store-nan") / "r.db";
  Outcome outcome = full_outcome(0);
  outcome.error.translation = NAN;
  outcome.result.score = INFINITY;
  outcome.result.covariance(2, 3) = NAN;
  ResultStore store = ResultStore::create_or_resume(path);
  store.write({outcome}, store.begin_run({}));
  const Outcome row = store.read().at(0);
  EXPECT_TRUE(std::isnan(row.error.translation));
  EXPECT_EQ(row.result.score, INFINITY);
  EXPECT_TRUE(std::isnan(row.result.covariance(2, 3)));
  EXPECT_EQ(row.result.covariance(3, 2), outcome.result.covariance(3, 2));
}

TEST(ResultStore, KeepsRuns) {
  const auto path = fresh_folder("store-runs") / "r.db";
  {
    ResultStore store = ResultStore::create_or_resume(path);
    const int first = store.begin_run({.version = "1.2",
                                       .command_line = "minescan sweep fig16",
                                       .machine = "a 'b'",
                                       .threads = 4,
                                       .started = "s"});
    store.begin_run({.version = "1.3"});
    store.end_run(first, "f");
    EXPECT_THROW(store.end_run(7, "f"), std::runtime_error);
  }
  const std::vector<RunInfo> runs = ResultStore::open(path).runs();
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].version, "1.2");
  EXPECT_EQ(runs[0].command_line, "minescan sweep fig16");
  EXPECT_EQ(runs[0].machine, "a 'b'");
  EXPECT_EQ(runs[0].threads, 4);
  EXPECT_EQ(runs[0].started, "s");
  EXPECT_EQ(runs[0].finished, "f");
  EXPECT_EQ(runs[1].finished, "");
}

TEST(ResultStore, ReplacesARowOfTheSameTrialAndStudyOnly) {
  const auto path = fresh_folder("store-replace") / "r.db";
  ResultStore store = ResultStore::create_or_resume(path);
  const int run = store.begin_run({});
  Outcome outcome = full_outcome(1);
  store.write({outcome}, run);
  outcome.message.clear();
  store.write({outcome}, run);
  ASSERT_EQ(store.read().size(), 1u);
  EXPECT_EQ(store.read()[0].message, "");
  outcome.trial.study = "other";
  store.write({outcome}, run);
  EXPECT_EQ(store.read().size(), 2u);
  EXPECT_EQ(store.read("other").size(), 1u);
  EXPECT_EQ(store.ids(true).size(), 1u);  // one registration
}

TEST(ResultStore, TellsFailedIdsApart) {
  ResultStore store = ResultStore::create_or_resume(fresh_folder("store-ids") / "r.db");
  Outcome good = full_outcome(1), bad = full_outcome(2);
  good.message.clear();
  store.write({good, bad}, store.begin_run({}));
  EXPECT_EQ(store.ids(true).size(), 2u);
  EXPECT_EQ(store.ids(false), std::unordered_set<std::string>{trial_id(good.trial)});
  EXPECT_TRUE(store.ids(true, "no such study").empty());
}

TEST(ResultStore, MergesShardsOnce) {
  const auto folder = fresh_folder("store-merge");
  store_with(folder / "a.db", 3);
  {
    ResultStore b = ResultStore::create_or_resume(folder / "b.db");
    Outcome mended = full_outcome(2), added = full_outcome(9);
    mended.message.clear();
    b.write({mended, added}, b.begin_run({.version = "b"}));
  }
  ResultStore a = ResultStore::create_or_resume(folder / "a.db");
  a.merge(folder / "b.db");
  const std::vector<Outcome> rows = a.read();
  ASSERT_EQ(rows.size(), 4u);
  for (const Outcome& row : rows)
    EXPECT_EQ(row.message.empty(), row.trial.start == 2) << row.trial.start;
  ASSERT_EQ(a.runs().size(), 2u);
  EXPECT_EQ(a.runs()[1].version, "b");
  a.merge(folder / "b.db");
  EXPECT_EQ(a.read().size(), 4u);
  EXPECT_NE(message_of([&] { a.merge(folder / "none.db"); }).find("none.db"), std::string::npos);
}

TEST(ResultStore, ReadsFilesOfVersionOneUntouched) {
  const auto path = old_store_with(fresh_folder("store-old") / "r.db", 5);
  const std::string bytes = content(path);
  const ResultStore store = ResultStore::open(path);
  const std::vector<Outcome> rows = store.read();
  ASSERT_EQ(rows.size(), 5u);
  for (const Outcome& row : rows)
    expect_same(row, old_outcome(static_cast<std::uint64_t>(row.trial.start)));
  const std::string csv = store.csv();
  EXPECT_NE(csv.find(",iterations,evaluations,score,"), std::string::npos);
  EXPECT_NE(csv.find(",17,,"), std::string::npos);  // not known is an empty field
  EXPECT_EQ(csv.find("NULL"), std::string::npos);
  EXPECT_EQ(store.runs().size(), 1u);
  EXPECT_EQ(content(path), bytes);
}

TEST(ResultStore, ResumesAndMergesFilesOfVersionOne) {
  const auto folder = fresh_folder("store-upgrade");
  const auto check = [](const ResultStore& store) {
    const std::vector<Outcome> rows = store.read();
    ASSERT_EQ(rows.size(), 5u);
    for (const Outcome& row : rows) {
      const auto stream = static_cast<std::uint64_t>(row.trial.start);
      expect_same(row, stream < 3 ? old_outcome(stream) : full_outcome(stream));
    }
  };
  const std::vector<Outcome> added = {full_outcome(3), full_outcome(4)};
  {
    ResultStore resumed = ResultStore::create_or_resume(old_store_with(folder / "a.db", 3));
    resumed.write(added, resumed.begin_run({}));
    check(resumed);
  }
  check(ResultStore::create_or_resume(folder / "a.db"));  // which is of today's version by now

  ResultStore merged = ResultStore::create_or_resume(folder / "b.db");
  merged.write(added, merged.begin_run({}));
  merged.merge(old_store_with(folder / "old.db", 3));
  check(merged);
}

TEST(ResultStore, ExportsTheColumnsOfTheContract) {
  const auto path = fresh_folder("store-csv") / "r.db";
  ResultStore store = ResultStore::create_or_resume(path);
  Outcome outcome = full_outcome(0);
  outcome.error.rotation = NAN;
  outcome.error.translation = 0.1;
  store.write({outcome}, store.begin_run({}));
  const std::string csv = store.csv();
  const std::string head = "," + csv.substr(0, csv.find('\n')) + ",";
  for (const char* column : {"trial_id",
                             "study",
                             "pair",
                             "method",
                             "settings",
                             "axes",
                             "initial_translation_m",
                             "initial_rotation_rad",
                             "start",
                             "seed",
                             "status",
                             "translation_error_m",
                             "rotation_error_rad",
                             "axial_error_m",
                             "iterations",
                             "evaluations",
                             "score",
                             "target_points",
                             "source_points",
                             "used_points",
                             "empty_points",
                             "outside_points",
                             "target_s",
                             "source_s",
                             "align_s",
                             "cpu_s",
                             "target_bytes",
                             "T_target_source",
                             "message"})
    EXPECT_NE(head.find(std::string(",") + column + ","), std::string::npos) << column;
  EXPECT_NE(csv.find(",max_iterations,0.1,,"), std::string::npos);  // NaN is an empty field
  EXPECT_NE(csv.find("\"it's \"\"bad\"\", very\nbad; \xc3\xa4\""), std::string::npos);
  EXPECT_EQ(csv.substr(csv.find('\n') + 1, 16), trial_id(outcome.trial));
}

TEST(ResultStore, RefusesForeignFilesUntouched) {
  const auto folder = fresh_folder("store-foreign");
  const std::string page = content(store_with(folder / "own.db", 3));
  std::string foreign = page;
  foreign.replace(68, 4, "abcd");  // the application id in SQLite's header
  std::string newer = page;
  newer[63] = 99;  // the last byte of user_version
  const std::vector<std::pair<std::string, std::string>> files = {
      {"text.db", "not a database, rather a sentence"},
      {"long.db", std::string(100'000, 'x')},
      {"foreign.db", foreign},
      {"newer.db", newer},
      {"cut.db", page.substr(0, page.size() / 2)}};
  for (const auto& [name, bytes] : files) {
    const auto path = folder / name;
    put(path, bytes);
    for (const bool writing : {true, false}) {
      const std::string message = message_of(
          [&] { writing ? ResultStore::create_or_resume(path) : ResultStore::open(path); });
      EXPECT_EQ(message.find(path.string() + ": "), 0u) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
    EXPECT_EQ(content(path), bytes) << name;
    EXPECT_FALSE(std::filesystem::exists(path.string() + "-journal"));
  }
}

TEST(ResultStore, NamesFoldersThatAreInTheWayOrMissing) {
  const auto folder = fresh_folder("store-folder");
  const auto create = [](const std::filesystem::path& path) {
    return message_of([&] { ResultStore::create_or_resume(path); });
  };
  const auto open = [](const std::filesystem::path& path) {
    return message_of([&] { ResultStore::open(path); });
  };
  EXPECT_NE(create(folder).find("is a folder"), std::string::npos);
  EXPECT_NE(create(folder / "none" / "r.db").find("there is no folder"), std::string::npos);
  EXPECT_NE(open(folder / "r.db").find("does not exist"), std::string::npos);
  put(folder / "empty.db", "");
  EXPECT_NE(open(folder / "empty.db").find("is empty"), std::string::npos);
  EXPECT_EQ(create(folder / "empty.db"), "nothing was thrown");  // left by a killed program
  EXPECT_EQ(create("/dev/full").find("/dev/full: "), 0u);
}

TEST(ResultStore, KeepsWhatWasWrittenWhenTheProgramIsKilled) {
  const auto path = fresh_folder("store-kill") / "r.db";
  const pid_t child = fork();
  if (child == 0) {
    // Rows one by one for ever, until the parent kills us in the middle of it.
    ResultStore store = ResultStore::create_or_resume(path);
    const int run = store.begin_run({.version = "killed"});
    for (std::uint64_t i = 0;; ++i) store.write({full_outcome(i)}, run);
  }
  std::size_t before = 0;
  while (before < 5) {
    usleep(20'000);
    if (std::filesystem::exists(path) && std::filesystem::file_size(path) > 0) {
      try {
        before = ResultStore::open(path).ids(true).size();
      } catch (const std::runtime_error&) {
        // the tables are not there yet
      }
    }
  }
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));

  std::vector<Outcome> rows = ResultStore::open(path).read();
  EXPECT_GE(rows.size(), before);
  for (const Outcome& row : rows)
    expect_same(row, full_outcome(static_cast<std::uint64_t>(row.trial.start)));
  ResultStore resumed = ResultStore::create_or_resume(path);
  resumed.write({full_outcome(1'000'000)}, resumed.begin_run({}));
  EXPECT_EQ(resumed.read().size(), rows.size() + 1);
}

}  // namespace
}  // namespace minescan
