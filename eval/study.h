// SPDX-License-Identifier: MIT
// Studies: which registrations make up an experiment. A study and its scan pairs give a list of
// trials.
#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/config.h"
#include "core/fields.h"
#include "eval/trial.h"

namespace minescan {

/// One thing that is varied, and its values in the order of the figure.
struct Axis {
  std::string name = {};  // initial-translation, initial-rotation, or an option of all methods
  std::vector<double> values = {};
};

struct Study {
  std::string name = {};
  std::string description = {};
  // A survey's name, its YAML file or its folder, or several with commas between; "NAME:12" is its
  // pair 12 alone.
  std::string survey = "junction";
  Settings survey_settings = {};  // "scene.length" = "30"; whoever makes the scans knows them
  std::vector<std::string> methods = {"icp", "ndt"};  // or "all" alone
  Settings settings = {};  // "cell-size": of all methods that have it; "ndt.cell-size": of ndt
  std::vector<Axis> axes = {};
  int trials = 100;                  // start poses of every point
  double initial_translation = 1.0;  // error of the start pose where it is not an axis, m
  double initial_rotation = 0.1;     // rad
};

template <class Visitor>
void fields(Study& s, Visitor&& field) {
  field("name", s.name, "what the rows are labelled with");
  field("description", s.description, "what it is about");
  field(
      "survey", s.survey,
      "which scans: names of surveys, their YAML files or folders, with commas between; NAME:12 is "
      "pair 12 alone");
  field("methods", s.methods, "which methods are compared, or all");
  field("trials", s.trials, between(1, 1e6), "", "start poses of every point");
  field("initial-translation", s.initial_translation, not_negative, "m",
        "error of the start position");
  field("initial-rotation", s.initial_rotation, between(0, std::numbers::pi), "rad",
        "error of the start orientation");
}

/// All studies known by name: the experiments of the paper, and a small one for continuous
/// integration.
const std::vector<Study>& studies();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Study& find_study(const std::string& name);

// `methods` below are those that a study may name: methods(), or others as well.

/// `base` with the entries of a configuration: the fields above, "axes.NAME" with a list of numbers
/// (an empty list takes the axis away), "settings.OPTION" or "settings.METHOD.OPTION", and
/// "survey-settings.KEY". Throws std::invalid_argument with the place for an unknown key, method or
/// option, or a value out of range; keys of survey-settings are checked by whoever makes the scans.
Study with_config(Study base, const Config& config, const std::vector<Method>& methods);

/// YAML that read_config and with_config turn back into the study.
std::string study_yaml(const Study& study);

/// Everything that could be wrong with the study itself. Throws std::invalid_argument.
void check_study(const Study& study, const std::vector<Method>& methods);

/// The trials of a study: for every pair, every combination of axis values (the first axis varies
/// slowest), every method and every start pose, in this order. Start poses are the same for all
/// methods and values. Throws as check_study.
std::vector<Trial> trials(const Study& study, const std::vector<ScanPair>& pairs,
                          const std::vector<Method>& methods, std::uint64_t seed);

}  // namespace minescan
