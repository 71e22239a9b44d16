// SPDX-License-Identifier: MIT
// What is measured of one outcome, by name.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "eval/trial.h"

namespace minescan {

/// One row of the table of metrics.
struct Metric {
  std::string name = {};         // with the unit, as in column heads: translation_error_m
  std::string description = {};  // "distance between estimated and true position"
  std::string label = {};        // for axes of figures: "Translation error [m]"
  double good = 0;               // limit of a good result, 0 where there is none
  double acceptable = 0;         // limit of an acceptable result, 0 where there is none
  std::function<double(const Outcome&)> value = {};
};

/// translation_error_m, rotation_error_rad, time_s (target + source + align), axial_error_m,
/// iterations, cpu_s, target_bytes.
const std::vector<Metric>& metrics();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Metric& find_metric(const std::string& name);

}  // namespace minescan
