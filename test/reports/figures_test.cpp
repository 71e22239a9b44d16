// SPDX-License-Identifier: MIT
#include "reports/figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "reports/axis_label.h"
#include "test/reports/made_up.h"

namespace minescan {
namespace {

std::vector<std::string> names_of_series(const StudyFigures& study) {
  std::vector<std::string> names;
  for (const Series& series : study.series) names.push_back(series.name);
  return names;
}

TEST(Figures, BoxesHoldHandComputedNumbers) {
  // Good: 0.05 and 0.08; acceptable also 0.15; the other two are failures.
  std::vector<Outcome> rows;
  for (const double error : {3.0, 0.05, 0.15, 0.08, 1.0})
    rows.push_back(outcome_at("fig16", "ndt", "initial-translation", 2, error));
  rows.push_back(outcome_at("fig16", "ndt", "initial-translation", 0.5, 0.01));

  const std::vector<StudyFigures> studies = make_figures(rows);
  ASSERT_EQ(studies.size(), 1u);
  ASSERT_EQ(studies[0].figures.size(), 3u);
  const Figure& figure = studies[0].figures[0];
  EXPECT_EQ(figure.name, "fig16-translation_error_m");
  EXPECT_EQ(figure.title, "Translation error, fig16");
  EXPECT_EQ(figure.x_label, "Initial translation error [m]");
  EXPECT_EQ(figure.y_label, "Translation error [m]");
  EXPECT_EQ(figure.unit, "m");
  EXPECT_EQ(figure.good, 0.10);
  EXPECT_EQ(figure.acceptable, 0.20);
  EXPECT_EQ(figure.levels, (std::vector<std::string>{"0.5", "2"}));
  ASSERT_EQ(figure.series.size(), 1u);
  ASSERT_EQ(figure.series[0].boxes.size(), 2u);

  const FigureBox& box = figure.series[0].boxes[1];
  EXPECT_EQ(box.level, 1u);
  EXPECT_EQ(box.trials, 5u);
  EXPECT_EQ(box.statistics.count, 5u);
  EXPECT_EQ(box.statistics.minimum, 0.05);
  EXPECT_EQ(box.statistics.lower_quartile, 0.08);
  EXPECT_EQ(box.statistics.median, 0.15);
  EXPECT_EQ(box.statistics.upper_quartile, 1.0);
  EXPECT_EQ(box.statistics.maximum, 3.0);
  EXPECT_EQ(box.good, 2u);
  EXPECT_EQ(box.acceptable, 3u);
  // Wilson's interval of 2 in 5, by hand to six digits.
  EXPECT_NEAR(box.good_interval.low, 0.117621, 1e-6);
  EXPECT_NEAR(box.good_interval.high, 0.769276, 1e-6);
}

TEST(Figures, TimeIsThatOfAllStages) {
  const std::vector<StudyFigures> studies = make_figures({outcome("a", "ndt", 0.01)});
  const Figure& figure = studies[0].figures[2];
  EXPECT_EQ(figure.name, "a-time_s");
  EXPECT_EQ(figure.good, 0);
  EXPECT_DOUBLE_EQ(figure.series[0].boxes[0].statistics.median, 0.06);
}

TEST(Figures, LevelsAreInOrderOfNumbersWhateverTheOrderOfRows) {
  std::vector<Outcome> rows;
  for (const double x : {10.0, 0.25, 2.0, 0.5})
    rows.push_back(outcome_at("s", "ndt", "cell-size", x, x));
  rows.push_back(outcome_at("s", "icp", "cell-size", 2, 1));
  const std::string sorted = figures_json(make_figures(rows), {});
  EXPECT_EQ(make_figures(rows)[0].figures[0].levels,
            (std::vector<std::string>{"0.25", "0.5", "2", "10"}));
  std::mt19937 shuffler(1);
  for (int i = 0; i < 10; ++i) {
    std::ranges::shuffle(rows, shuffler);
    EXPECT_EQ(figures_json(make_figures(rows), {}), sorted);
  }
}

TEST(Figures, WithoutAnAxisTheMethodsAreOnX) {
  const auto studies = make_figures({outcome("s", "ndt", 0.1), outcome("s", "icp", 0.2)});
  const Figure& figure = studies[0].figures[0];
  EXPECT_EQ(figure.x_label, "");
  EXPECT_EQ(figure.levels, std::vector<std::string>{""});
  EXPECT_EQ(names_of_series(studies[0]), (std::vector<std::string>{"icp", "ndt"}));
}

TEST(Figures, AnAxisWithOneValueIsNotOnX) {
  const auto studies = make_figures({outcome_at("s", "ndt", "cell-size", 1, 0.1)});
  EXPECT_EQ(studies[0].figures[0].x_label, "");
}

TEST(Figures, SettingsThatDifferTellSeriesApart) {
  std::vector<Outcome> rows;
  for (const char* sampling : {"uniform", "spatial"})
    for (const char* cell : {"1", "2"}) {
      rows.push_back(outcome_at("s", "ndt", "cell-size", std::stod(cell), 0.1));
      rows.back().trial.settings = {
          {"sampling", sampling}, {"cell-size", cell}, {"max-step", "0.05"}};
    }
  const StudyFigures study = make_figures(rows)[0];
  // Neither cell-size, which is on x, nor max-step, which is the same for all.
  EXPECT_EQ(names_of_series(study),
            (std::vector<std::string>{"ndt, sampling spatial", "ndt, sampling uniform"}));
  EXPECT_EQ(study.series[0].settings, "cell-size = varied, max-step = 0.05, sampling = spatial");
}

TEST(Figures, ASecondAxisTellsSeriesApart) {
  std::vector<Outcome> rows;
  for (const double x : {1.0, 2.0, 3.0})
    for (const double rotation : {0.1, 0.2}) {
      rows.push_back(outcome_at("s", "ndt", "cell-size", x, 0.1));
      rows.back().trial.axes["initial-rotation"] = rotation;
    }
  const StudyFigures study = make_figures(rows)[0];
  EXPECT_EQ(study.figures[0].x_label, "Cell size [m]");
  EXPECT_EQ(names_of_series(study),
            (std::vector<std::string>{"ndt, initial-rotation 0.1", "ndt, initial-rotation 0.2"}));
}

TEST(Figures, AMethodWithoutTheAxisStandsAtALevelOfItsOwn) {
  const StudyFigures study =
      make_figures({outcome_at("s", "ndt", "cell-size", 1, 0.1),
                    outcome_at("s", "ndt", "cell-size", 2, 0.1), outcome("s", "icp", 0.1)})[0];
  EXPECT_EQ(study.figures[0].levels, (std::vector<std::string>{"default", "1", "2"}));
  EXPECT_EQ(names_of_series(study), (std::vector<std::string>{"icp", "ndt"}));
}

TEST(Figures, DataSetsHaveFiguresOfTheirOwnAndPairsOfOneDoNot) {
  std::vector<Outcome> rows(3, outcome("s", "ndt", 0.1));
  rows[0].trial.pair = "loop/0";
  rows[1].trial.pair = "loop/1";
  EXPECT_EQ(make_figures({rows[0], rows[1]})[0].figures.size(), 3u);
  const StudyFigures study = make_figures(rows)[0];
  ASSERT_EQ(study.figures.size(), 6u);
  EXPECT_EQ(study.figures[0].name, "s-junction-translation_error_m");
  EXPECT_EQ(study.figures[0].series[0].boxes[0].trials, 1u);
  EXPECT_EQ(study.figures[3].title, "Translation error, s, loop");
  EXPECT_EQ(study.figures[3].series[0].boxes[0].trials, 2u);
}

// A trial that threw has error 0 in its row: in the box it would look perfect.
TEST(Figures, TrialsThatThrewCountAsFailedAndAreNotDrawn) {
  std::vector<Outcome> rows(4, outcome("s", "ndt", 0.05));
  rows[1] = outcome("s", "ndt", 0);
  rows[1].result.status = Status::not_run;
  rows[1].message = "no points";
  rows[2].error.translation = std::numeric_limits<double>::quiet_NaN();
  const StudyFigures study = make_figures(rows)[0];
  const FigureBox& box = study.figures[0].series[0].boxes[0];
  EXPECT_EQ(box.trials, 4u);
  EXPECT_EQ(box.statistics.count, 2u);
  EXPECT_EQ(box.statistics.minimum, 0.05);
  EXPECT_EQ(box.good, 2u);
  EXPECT_EQ(study.messages, std::vector<std::string>{"ndt: no points"});
}

TEST(Figures, NoneConvergedIsShownWithNoneGood) {
  std::vector<Outcome> rows(3, outcome("s", "ndt", 0.05));
  for (Outcome& row : rows) row.result.status = Status::max_iterations;
  const StudyFigures study = make_figures(rows)[0];
  const FigureBox& box = study.figures[0].series[0].boxes[0];
  EXPECT_EQ(box.statistics.count, 3u);
  EXPECT_EQ(box.good, 0u);
  EXPECT_EQ(study.series[0].statuses[static_cast<std::size_t>(Status::max_iterations)], 3u);
}

TEST(Figures, AllThrownLeavesBoxesWithoutNumbers) {
  std::vector<Outcome> rows(2, outcome("s", "ndt", 0));
  for (Outcome& row : rows) row.message = "no points";
  const StudyFigures study = make_figures(rows)[0];
  EXPECT_EQ(study.figures[0].series[0].boxes[0].statistics.count, 0u);
  EXPECT_FALSE(study.figures[0].logarithmic);
}

TEST(Figures, NothingGivesNothing) { EXPECT_TRUE(make_figures({}).empty()); }

TEST(Figures, LogarithmicWhereValuesAndLimitsSpanMoreThanTwoDecades) {
  const auto logarithmic = [](double low, double high) {
    return make_figures({outcome("s", "ndt", low), outcome("s", "ndt", high)})[0]
        .figures[0]
        .logarithmic;
  };
  EXPECT_TRUE(logarithmic(0.01, 1.01));
  EXPECT_FALSE(logarithmic(0.01, 0.99));
  EXPECT_TRUE(logarithmic(0.0019, 0.0019));  // the limit is at 0.2
  EXPECT_FALSE(logarithmic(0, 0.5));         // zeros have no decade
}

TEST(Figures, NamesKeepTheirColourAndNeighboursDiffer) {
  std::vector<Outcome> rows;
  for (const char* method : {"b", "c"}) rows.push_back(outcome("1", method, 0.1));
  for (const char* method : {"a", "b"}) rows.push_back(outcome("2", method, 0.1));
  for (int i = 0; i < 12; ++i) rows.push_back(outcome("3", "m" + std::to_string(i), 0.1));
  const auto studies = make_figures(rows);
  EXPECT_EQ(studies[0].series[0].colour, studies[1].series[1].colour);  // b
  for (const StudyFigures& study : studies)
    for (const Series& one : study.series)
      for (const Series& other : study.series)
        if (&one != &other) {
          EXPECT_NE(one.colour, other.colour) << one.name << " and " << other.name;
        }
}

TEST(Figures, FileNamesAreSafeAndUnique) {
  EXPECT_EQ(file_stem("fig16"), "fig16");
  EXPECT_EQ(file_stem("../../etc/passwd"), "etc-passwd");
  EXPECT_EQ(file_stem("a, b"), "a-b");
  EXPECT_EQ(file_stem("\xc3\xa9"), "unnamed");
  const auto studies = make_figures({outcome("a b", "ndt", 0.1), outcome("a/b", "ndt", 0.1)});
  EXPECT_EQ(studies[0].figures[0].name, "a-b-translation_error_m");
  EXPECT_EQ(studies[1].figures[0].name, "a-b-translation_error_m-2");
}

TEST(Figures, LabelsOfAxesCarryTheUnit) {
  EXPECT_EQ(axis_label("initial-rotation"), "Initial rotation error [rad]");
  EXPECT_EQ(axis_label("initial_rotation"), "Initial rotation error [rad]");
  EXPECT_EQ(axis_label("my-option"), "My option");
}

}  // namespace
}  // namespace minescan
