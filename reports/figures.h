// SPDX-License-Identifier: MIT
// Outcomes -> what the figures show, as plain numbers: no drawing here.
//
// A study gives one figure per metric and data set ("junction" of the pairs "junction/0",
// "junction/1", ...). The axis of the study that takes most values is on x; methods, and whatever
// else differs between the trials of one method, are the series.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "eval/statistics.h"
#include "eval/trial.h"
#include "reports/report.h"

namespace minescan {

/// One box: the trials of one series at one level of x.
struct FigureBox {
  std::size_t level = 0;   // index into Figure::levels
  std::size_t trials = 0;  // all of them, those that give no number too
  /// Of the trials that give a number: the method returned, and the metric is finite.
  BoxStatistics statistics = {};
  std::size_t good = 0;
  std::size_t acceptable = 0;   // acceptable or good
  Interval good_interval = {};  // Wilson, 95 %, of the rates good / trials and acceptable / trials
  Interval acceptable_interval = {};
};

/// A method and the settings that tell it apart from its neighbours.
struct Series {
  std::string name = {};    // "ndt, cell-size 2"
  std::string method = {};  // "ndt"
  std::string settings =
      {};                  // all that differ from the defaults: "cell-size = 2, sampling = uniform"
  std::size_t colour = 0;  // the same for this name in every study, different from its neighbours'
  std::size_t trials = 0;
  std::array<std::size_t, names_of(Status{}).size()> statuses = {};  // trials by Status
};

struct FigureSeries {
  std::size_t series = 0;  // index into StudyFigures::series
  std::vector<FigureBox> boxes = {};
};

struct Figure {
  std::string name = {};     // for a file: "fig16-translation_error_m"
  std::string title = {};    // "Translation error, fig16"
  std::string x_label = {};  // "Initial translation error [m]"; empty where the series are on x
  std::string y_label = {};  // "Translation error [m]"
  std::string unit = {};     // "m"
  std::vector<std::string> levels = {};  // of x, ascending; one, empty, where the series are on x
  double good = 0;                       // limits of the metric, 0 where there is none
  double acceptable = 0;
  bool logarithmic = false;  // numbers and limits span too much for a linear axis
  std::vector<FigureSeries> series = {};
};

/// One study: its figures and what was run.
struct StudyFigures {
  std::string name = {};
  std::string description = {};  // of the study known by this name, or empty
  std::size_t trials = 0;
  std::vector<std::string> pairs = {};
  std::vector<std::uint64_t> seeds = {};
  Interval initial_translation = {};       // smallest and largest, m
  Interval initial_rotation = {};          // rad
  std::vector<std::string> messages = {};  // what methods threw, each once, at most ten
  std::vector<Series> series = {};
  std::vector<Figure> figures = {};
};

/// The figures of every study, by name of the study: translation_error_m, rotation_error_rad,
/// time_s.
std::vector<StudyFigures> make_figures(const std::vector<Outcome>& outcomes);

/// Figures and runs as JSON, ASCII only, for the scripts in reports/web.
std::string figures_json(const std::vector<StudyFigures>& studies,
                         const std::vector<RunInfo>& runs);

}  // namespace minescan
