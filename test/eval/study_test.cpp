// SPDX-License-Identifier: MIT
#include "eval/study.h"

#include <gtest/gtest.h>

#include <set>

#include "small_values.h"

namespace minescan {
namespace {

const std::vector<Method>& test_methods() {
  static const std::vector<Method> list = {shrinking_method("a", 0.01), shrinking_method("b", 0.1),
                                           throwing_method("bad")};
  return list;
}

Study small_study() {
  return {.name = "small", .methods = {"a", "b"}, .axes = {{"cell-size", {1, 2}}}, .trials = 3};
}

std::string message_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

Study configured(const std::string& yaml, const Study& base = small_study()) {
  return with_config(base, parse_config(yaml, "my.yaml"), test_methods());
}

TEST(Studies, OfTheTableAreSound) {
  std::set<std::string> names;
  for (const Study& study : studies()) {
    EXPECT_NO_THROW(check_study(study, methods())) << study.name;
    EXPECT_FALSE(study.description.empty()) << study.name;
    EXPECT_TRUE(names.insert(study.name).second) << study.name;
    EXPECT_EQ(&find_study(study.name), &study);
  }
  EXPECT_THROW(find_study("fig99"), std::invalid_argument);
}

TEST(Studies, OfThePaperVaryOneStartErrorAlone) {
  ScanPair pair = small_pair();
  const std::vector<Trial> fig16 = trials(find_study("fig16"), {pair}, methods(), 1);
  EXPECT_EQ(fig16.size(), 8u * 2 * 100);
  for (const Trial& trial : fig16) {
    EXPECT_EQ(trial.initial_rotation, 0);
    EXPECT_EQ(trial.axes.at("initial-translation"), trial.initial_translation);
  }
  for (const Trial& trial : trials(find_study("fig17"), {pair}, methods(), 1)) {
    EXPECT_EQ(trial.initial_translation, 0);
    EXPECT_EQ(trial.axes.at("initial-rotation"), trial.initial_rotation);
  }
  EXPECT_EQ(trials(find_study("gate"), {pair}, methods(), 1).size(), 60u);
}

TEST(Trials, AreAllCombinationsInAFixedOrder) {
  Study study = small_study();
  study.axes.push_back({"initial-translation", {0.5, 1, 2}});
  const std::vector<Trial> list =
      trials(study, {small_pair("p"), small_pair("q")}, test_methods(), 5);
  ASSERT_EQ(list.size(), 2u * 2 * 3 * 2 * 3);
  std::size_t i = 0;
  for (const char* pair : {"p", "q"})
    for (const double cell : {1, 2})
      for (const double translation : {0.5, 1.0, 2.0})
        for (const char* method : {"a", "b"})
          for (int start = 0; start < 3; ++start, ++i) {
            EXPECT_EQ(list[i].pair, pair);
            EXPECT_EQ(list[i].origin, "two points");
            EXPECT_EQ(list[i].axes.at("cell-size"), cell);
            EXPECT_EQ(list[i].initial_translation, translation);
            EXPECT_EQ(list[i].initial_rotation, 0.1);
            EXPECT_EQ(list[i].method, method);
            EXPECT_EQ(list[i].start, start);
            EXPECT_EQ(list[i].starts, 3);
            EXPECT_EQ(list[i].seed, 5u);
            // The default is not written down, so that the trial is the same with and without it.
            EXPECT_EQ(list[i].settings.contains("cell-size"), cell == 2);
          }
  std::set<std::string> ids;
  for (const Trial& trial : list) ids.insert(trial_id(trial));
  EXPECT_EQ(ids.size(), list.size());
}

TEST(Trials, StartAlikeForAllMethodsAndLevels) {
  const ScanPair pair = small_pair();
  const std::vector<Trial> list = trials(small_study(), {pair}, test_methods(), 5);
  for (const Trial& trial : list)
    EXPECT_EQ(start_pose(trial, pair).matrix(),
              start_pose(list[static_cast<std::size_t>(trial.start)], pair).matrix());
}

TEST(Trials, HaveTheSettingsMeantForTheirMethod) {
  Study study = small_study();
  study.axes = {};
  study.settings = {{"cell-size", "2"}, {"a.cell-size", "3"}};
  for (const Trial& trial : trials(study, {small_pair()}, test_methods(), 1))
    EXPECT_EQ(trial.settings.at("cell-size"), trial.method == "a" ? "3" : "2");
  study.settings = {{"cell-size", "2"}, {"a.cell-size", "1"}};  // back to the default
  for (const Trial& trial : trials(study, {small_pair()}, test_methods(), 1))
    EXPECT_EQ(trial.settings.contains("cell-size"), trial.method == "b");
}

TEST(Study, ComesBackFromItsYaml) {
  Study study = small_study();
  study.description = "what: it \"is\", # about";
  study.survey = "my survey.yaml";
  study.survey_settings = {{"scene.length", "30"}};
  study.settings = {{"a.cell-size", "3"}, {"sample-seed", "4"}};
  study.axes = {{"cell-size", {1, 0.1, 2.5}}, {"initial-rotation", {0.3}}};
  study.initial_translation = 0.25;
  const Study read = configured(study_yaml(study), Study{.name = "x", .methods = {"a", "b"}});
  EXPECT_EQ(study_yaml(read), study_yaml(study));
  EXPECT_EQ(read.description, study.description);
  EXPECT_EQ(read.survey_settings, study.survey_settings);
  EXPECT_EQ(read.settings, study.settings);
  EXPECT_EQ(read.axes[0].values, study.axes[0].values);
  EXPECT_EQ(read.trials, 3);
  for (const Study& row : studies())
    EXPECT_EQ(study_yaml(with_config(Study{}, parse_config(study_yaml(row), "row"), methods())),
              study_yaml(row));
}

TEST(Study, TakesAxesAndSettingsFromAConfiguration) {
  const Study study = configured(
      "trials: 7\nmethods: [b]\naxes: {initial-translation: [0.5, 1], cell-size: []}\n"
      "settings: {b: {cell-size: 4}}\n");
  EXPECT_EQ(study.trials, 7);
  EXPECT_EQ(study.methods, std::vector<std::string>{"b"});
  ASSERT_EQ(study.axes.size(), 1u);
  EXPECT_EQ(study.axes[0].name, "initial-translation");
  EXPECT_EQ(study.axes[0].values, (std::vector<double>{0.5, 1}));
  EXPECT_EQ(study.settings.at("b.cell-size"), "4");
}

TEST(Study, SaysWhereAndWhatIsWrong) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> wrong = {
      {"trails: 5", {"my.yaml:1", "trails", "trials"}},
      {"trials: 0", {"my.yaml:1", "trials", ">= 1|[1,"}},
      {"methods: [ndd]", {"my.yaml:1", "ndd", "a, b, bad"}},
      {"methods: [a, a]", {"my.yaml:1", "twice"}},
      {"axes: {cell: [1]}", {"my.yaml:1", "cell", "initial-translation", "cell-size"}},
      {"axes: {cell-size: [1, -1]}", {"my.yaml:1", "cell-size", "-1", "unit: m"}},
      {"axes: {cell-size: [1, 1]}", {"my.yaml:1", "twice"}},
      {"axes: {initial-rotation: [4]}", {"my.yaml:1", "initial-rotation", "4"}},
      {"axes: {cell-size: [1, x]}", {"my.yaml:1", "x"}},
      {"settings: {cell: 1}", {"my.yaml:1", "cell", "cell-size"}},
      {"settings: {c.cell-size: 1}", {"my.yaml:1", "c.cell-size"}},
      {"settings: {cell-size: 0}", {"my.yaml:1", "cell-size", "> 0"}},
      // an option that one of the methods lacks is no axis
      {"methods: [a, bad]", {"cell-size", "initial-translation"}}};
  for (const auto& [yaml, parts] : wrong) {
    const std::string message = message_of([&, &text = yaml] { configured(text); });
    for (const std::string& part : parts) {
      const std::vector<std::string> choices = split(part, '|');
      EXPECT_TRUE(std::any_of(
          choices.begin(), choices.end(),
          [&](const std::string& choice) { return message.find(choice) != std::string::npos; }))
          << yaml << "\n  gave: " << message << "\n  without: " << part;
    }
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace minescan
