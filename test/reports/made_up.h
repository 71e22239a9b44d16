// SPDX-License-Identifier: MIT
// Outcomes with chosen numbers, for the tests of the reports.
#pragma once

#include <string>

#include "eval/trial.h"

namespace minescan {

/// A converged trial of `study` with these errors.
inline Outcome outcome(const std::string& study, const std::string& method, double translation,
                       double rotation = 0.001) {
  Outcome row;
  row.trial.study = study;
  row.trial.pair = "junction";
  row.trial.method = method;
  row.error = {.translation = translation, .rotation = rotation};
  row.result.status = Status::converged;
  row.result.time = {.target = 0.01, .source = 0.02, .align = 0.03};
  return row;
}

/// The same at one value of an axis.
inline Outcome outcome_at(const std::string& study, const std::string& method,
                          const std::string& axis, double value, double translation) {
  Outcome row = outcome(study, method, translation);
  row.trial.axes[axis] = value;
  return row;
}

}  // namespace minescan
