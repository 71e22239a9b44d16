// SPDX-License-Identifier: MIT
// Hard limits on results: what must hold whatever the baseline says.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/fields.h"
#include "eval/trial.h"

namespace minescan {

/// "The `quantile` of `metric` over all rows of `method` (and `pair`) is at most `max`."
struct Limit {
  std::string name = {};
  std::string metric = {};  // a row of metrics(), or failure_rate
  std::string method = {};
  std::string pair = {};  // empty: all pairs together
  double quantile = 0.5;  // of no meaning for failure_rate
  double max = 0;
  std::string reason = {};  // where the limit comes from
};

template <class Visitor>
void fields(Limit& l, Visitor&& field) {
  field("metric", l.metric, "what is limited: a metric, or failure_rate");
  field("method", l.method, "of which method");
  field("pair", l.pair, "of which pair of scans; all together if left out");
  field("quantile", l.quantile, between(0, 1), "", "which quantile: 0.5 is the median");
  field("max", l.max, any_number, "", "the largest value that holds");
  field("reason", l.reason, "where the limit comes from");
}

struct LimitResult {
  Limit limit = {};
  std::size_t rows = 0;
  double measured = 0;
  bool holds = false;
};

/// Reads limits from YAML:
///
///   ndt-median:
///     metric: translation_error_m
///     method: ndt
///     quantile: 0.5
///     max: 0.10
///     reason: a good match, section 5.2.2 of the paper
///
/// with `pair` as a further key. Throws std::runtime_error if the file cannot be read,
/// std::invalid_argument with file and line for a missing or unknown key or metric or a bad number.
std::vector<Limit> read_limits(const std::filesystem::path& path);

/// Measures each limit. Throws std::invalid_argument if a limit matches no row: it would hold for
/// ever after a method is renamed.
std::vector<LimitResult> check_limits(const std::vector<Outcome>& outcomes,
                                      const std::vector<Limit>& limits);

}  // namespace minescan
