// SPDX-License-Identifier: MIT
#include "eval/method_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include "core/text.h"
#include "eval/statistics.h"

namespace minescan {
namespace {

struct Row {
  std::string pair = {}, method = {}, point = {};
  std::size_t good = 0;
  std::vector<double> translation = {}, rotation = {}, cpu = {}, bytes = {};
};

/// The start error, the axes of the study and the settings that differ from the method's defaults.
std::string point_of(const Trial& trial) {
  std::string text = fmt::format("{} m, {} rad", number_text(trial.initial_translation),
                                 number_text(trial.initial_rotation));
  const auto add = [&](const std::string& name, const std::string& value) {
    if (!name.starts_with("initial-")) text += fmt::format(", {} {}", name, value);
  };
  for (const auto& [name, value] : trial.axes) add(name, number_text(value));
  for (const auto& [name, value] : trial.settings)
    if (!trial.axes.contains(name)) add(name, value);
  return text;
}

}  // namespace

std::string method_table(const std::vector<Outcome>& outcomes) {
  std::vector<Row> rows;
  std::map<std::array<std::string, 3>, std::size_t> number;
  for (const Outcome& outcome : outcomes) {
    const Trial& trial = outcome.trial;
    const std::string point = point_of(trial);
    const auto [at, is_new] = number.try_emplace({trial.pair, trial.method, point}, rows.size());
    if (is_new) rows.push_back({.pair = trial.pair, .method = trial.method, .point = point});
    Row& row = rows[at->second];
    row.good += quality(outcome) == Quality::good;
    row.translation.push_back(outcome.error.translation);
    row.rotation.push_back(outcome.error.rotation);
    row.cpu.push_back(outcome.result.cpu);
    row.bytes.push_back(static_cast<double>(outcome.result.target_bytes));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return std::tie(a.pair, a.method) < std::tie(b.pair, b.method);
  });
  const auto median = [](const std::vector<double>& values) {
    return box_statistics(values).median;
  };
  std::string text =
      "| pair | method | point | good | 95 % | median error, mm | mrad | processor, ms | target, "
      "kB |"
      "\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Row& row : rows) {
    const std::size_t count = row.translation.size();
    const Interval interval = wilson_interval(row.good, count);
    text += fmt::format(
        "| {} | {} | {} | {} of {} | {:.0f}-{:.0f} % | {:.3g} | {:.3g} | {:.3g} | {} |\n", row.pair,
        row.method, row.point, row.good, count, 100 * interval.low, 100 * interval.high,
        1e3 * median(row.translation), 1e3 * median(row.rotation), 1e3 * median(row.cpu),
        median(row.bytes) > 0 ? fmt::format("{:.0f}", median(row.bytes) / 1e3) : "");
  }
  return text;
}

}  // namespace minescan
