// SPDX-License-Identifier: MIT
// How often the check is wrong, measured on simulated results whose truth is known.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "eval/check.h"

namespace minescan {

/// What is done to the results of one of two methods before they are compared.
struct SelfTestCase {
  std::string name = {};       // "errors x 1.5"
  double error_factor = 1;     // on all errors
  double more_failures = 0;    // part of all trials that fail in addition
  bool is_regression = false;  // whether the check should say so
};

struct SelfTestRow {
  SelfTestCase simulated = {};
  std::size_t trials = 0;  // of each of the two methods
  std::size_t repetitions = 0;
  std::size_t regressions = 0;  // verdicts
  Interval rate = {};           // of regressions, 95 % (Clopper-Pearson)
};

/// Unchanged distributions and several sizes of harm, as the rows of the table.
const std::vector<SelfTestCase>& self_test_cases();

/// Simulates `repetitions` comparisons of every case: errors are log-normal with one part that a
/// start pose gives to both results (hard starts are hard for both: sigma 0.5) and one that each
/// result has for itself (sigma 0.3); 5 % fail. The sizes are assumed.
std::vector<SelfTestRow> check_self_test(std::size_t trials, std::size_t repetitions,
                                         std::uint64_t seed, const CheckOptions& options = {});

/// One line per row.
std::string self_test_text(const std::vector<SelfTestRow>& rows);

}  // namespace minescan
