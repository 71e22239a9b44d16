// SPDX-License-Identifier: MIT
#include "eval/baseline.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "eval/limits.h"
#include "small_values.h"

namespace minescan {
namespace {

std::vector<Outcome> outcomes(int count) {
  std::vector<Outcome> list;
  for (int i = 0; i < count; ++i) {
    Trial trial{.study = "s",
                .pair = "pair",
                .origin = "two points",
                .method = "a",
                .settings = {{"cell-size", "2"}},
                .axes = {{"cell-size", 2}},
                .start = i};
    list.push_back(run_trial(trial, small_pair(), shrinking_method("a", 0.1)));
  }
  return list;
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string put(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
  return path.string();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  return text.replace(text.find(from), from.size(), to);
}

template <class Error>
std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Baseline, ComesBackBitForBit) {
  const auto path = fresh_folder("baseline") / "b.json";
  write_baseline(path, outcomes(5), "  first \"release\"\n", "1.2.3");
  const Baseline baseline = read_baseline(path);
  EXPECT_EQ(baseline.reason, "first \"release\"");
  EXPECT_EQ(baseline.version, "1.2.3");
  ASSERT_EQ(baseline.outcomes.size(), 5u);
  for (const Outcome& o : baseline.outcomes) {
    const Outcome expected = outcomes(5)[static_cast<std::size_t>(o.trial.start)];
    EXPECT_EQ(trial_id(o.trial), trial_id(expected.trial));
    EXPECT_EQ(o.trial.axes, expected.trial.axes);
    EXPECT_EQ(o.result.T_target_source.matrix(), expected.result.T_target_source.matrix());
    EXPECT_EQ(o.result.status, expected.result.status);
    EXPECT_EQ(o.result.iterations, expected.result.iterations);
    EXPECT_EQ(o.error.translation, expected.error.translation);
    EXPECT_EQ(o.error.rotation, expected.error.rotation);
  }
}

TEST(Baseline, HasTheSameBytesForTheSameResults) {
  const auto folder = fresh_folder("baseline-bytes");
  std::vector<Outcome> list = outcomes(5);
  write_baseline(folder / "a.json", list, "r", "v");
  std::reverse(list.begin(), list.end());
  list.push_back(list.front());  // as a second study would have it
  list.back().trial.study = "t";
  for (Outcome& o : list) o.result.time.align = 17;  // times are no part of it
  write_baseline(folder / "b.json", list, "r", "v");
  EXPECT_EQ(content(folder / "a.json"), content(folder / "b.json"));
}

TEST(Baseline, NeedsAReasonAndResults) {
  const auto path = fresh_folder("baseline-reason") / "b.json";
  EXPECT_THROW(write_baseline(path, outcomes(1), " ", "v"), std::invalid_argument);
  EXPECT_THROW(write_baseline(path, {}, "r", "v"), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(write_baseline(path / "b.json", outcomes(1), "r", "v"), std::runtime_error);
}

TEST(Baseline, RefusesWhatIsNotOne) {
  const auto folder = fresh_folder("baseline-bad");
  write_baseline(folder / "good.json", outcomes(3), "r", "v");
  const std::string good = content(folder / "good.json");
  const std::vector<std::string> bad = {
      "", "garbage", "{}", "[1, 2]", good.substr(0, good.size() / 2),
      replaced(good, "\"minescan_baseline\": 1", "\"minescan_baseline\": 99"),
      replaced(good, "\"reason\"", "\"raeson\""), replaced(good, "converged", "konvergiert"),
      // an edited trial is not the one that was run
      replaced(good, "\"start\":0", "\"start\":5"), replaced(good, "\"seed\":1", "\"seed\":\"x\"")};
  for (const std::string& text : bad) {
    const std::string path = put(folder / "bad.json", text);
    const std::string message = message_of<std::runtime_error>([&] { read_baseline(path); });
    EXPECT_EQ(message.find(path + ": "), 0u) << message << "\n" << text;
  }
  EXPECT_THROW(read_baseline(folder), std::runtime_error);
  EXPECT_THROW(read_baseline(folder / "none.json"), std::runtime_error);
}

TEST(Limits, AreReadFromYaml) {
  const auto folder = fresh_folder("limits");
  const std::vector<Limit> limits = read_limits(
      put(folder / "l.yaml",
          "ndt-median:\n  metric: translation_error_m\n  method: ndt\n  max: 0.1\n  reason: paper\n"
          "icp:\n  metric: failure_rate\n  method: icp\n  pair: junction\n  max: 0.05\n"
          "  reason: 'a, b'\n"));
  ASSERT_EQ(limits.size(), 2u);
  EXPECT_EQ(limits[0].name, "ndt-median");
  EXPECT_EQ(limits[0].metric, "translation_error_m");
  EXPECT_EQ(limits[0].quantile, 0.5);
  EXPECT_EQ(limits[0].max, 0.1);
  EXPECT_EQ(limits[0].reason, "paper");
  EXPECT_EQ(limits[1].pair, "junction");
  EXPECT_EQ(limits[1].reason, "a, b");
}

TEST(Limits, SayWhereTheyAreWrong) {
  const auto folder = fresh_folder("limits-bad");
  const std::string start = "a:\n  metric: time_s\n  method: ndt\n";
  const std::vector<std::pair<std::string, std::string>> bad = {
      {start + "  max: 1\n", "l.yaml:2: limit 'a' has no 'reason'"},
      {start + "  max: x\n  reason: r\n", "l.yaml:4: max"},
      {start + "  max: 1\n  reason: r\n  colour: red\n", "l.yaml:6: unknown key 'colour'"},
      {start + "  max: 1\n  reason: r\n  quantile: 2\n", "l.yaml:6: quantile"},
      {"a:\n  metric: speed\n  method: ndt\n  max: 1\n  reason: r\n", "unknown metric 'speed'"},
      {"a:\n  metric: failure_rate\n  method: n\n  max: 1\n  reason: r\n  quantile: 0.5\n",
       "no quantile"},
      {"max: 1\n", "l.yaml:1: expected a limit"}};
  for (const auto& [text, part] : bad) {
    const std::string path = put(folder / "l.yaml", text);
    const std::string message = message_of<std::invalid_argument>([&] { read_limits(path); });
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace minescan
