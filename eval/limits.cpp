// SPDX-License-Identifier: MIT
#include "eval/limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "core/config.h"
#include "core/text.h"
#include "eval/metrics.h"
#include "eval/statistics.h"

namespace minescan {
namespace {

constexpr const char* failure_rate = "failure_rate";

Limit read_limit(const std::string& name, const Config& entries) {
  const auto has = [&](const char* key) {
    return std::any_of(entries.begin(), entries.end(),
                       [&](const ConfigEntry& entry) { return entry.key == key; });
  };
  const std::string& where = entries.front().where;
  for (const char* key : {"metric", "method", "max", "reason"})
    if (!has(key))
      throw std::invalid_argument(fmt::format("{}: limit '{}' has no '{}'", where, name, key));
  Limit limit = with_settings(Limit{.name = name}, resolve(entries, fields_of(Limit{})));
  if (limit.metric != failure_rate) {
    try {
      find_metric(limit.metric);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(
          fmt::format("{}: limit '{}': {}, {}", where, name, error.what(), failure_rate));
    }
  } else if (has("quantile")) {
    throw std::invalid_argument(
        fmt::format("{}: limit '{}': a failure rate has no quantile", where, name));
  }
  return limit;
}

}  // namespace

std::vector<Limit> read_limits(const std::filesystem::path& path) {
  std::vector<std::pair<std::string, Config>> groups;  // in the order of the file
  for (ConfigEntry entry : read_config(path)) {
    const std::size_t dot = entry.key.rfind('.');
    if (dot == std::string::npos)
      throw std::invalid_argument(fmt::format(
          "{}: expected a limit with keys metric, method, max and reason, found '{}: {}'",
          entry.where, entry.key, entry.text));
    const std::string name = entry.key.substr(0, dot);
    entry.key = entry.key.substr(dot + 1);
    if (groups.empty() || groups.back().first != name) groups.push_back({name, {}});
    groups.back().second.push_back(std::move(entry));
  }
  std::vector<Limit> limits;
  for (const auto& [name, entries] : groups) limits.push_back(read_limit(name, entries));
  return limits;
}

std::vector<LimitResult> check_limits(const std::vector<Outcome>& outcomes,
                                      const std::vector<Limit>& limits) {
  std::vector<LimitResult> results;
  for (const Limit& limit : limits) {
    std::vector<double> values;
    for (const Outcome& outcome : outcomes) {
      if (outcome.trial.method != limit.method) continue;
      if (!limit.pair.empty() && outcome.trial.pair != limit.pair) continue;
      values.push_back(limit.metric == failure_rate
                           ? (quality(outcome) == Quality::failed ? 1.0 : 0.0)
                           : find_metric(limit.metric).value(outcome));
    }
    if (values.empty())
      throw std::invalid_argument(
          fmt::format("no row matches limit '{}': method '{}'{}", limit.name, limit.method,
                      limit.pair.empty() ? "" : fmt::format(", pair '{}'", limit.pair)));
    LimitResult result{.limit = limit, .rows = values.size()};
    if (limit.metric == failure_rate) {
      for (const double failed : values) result.measured += failed;
      result.measured /= static_cast<double>(values.size());
    } else {
      result.measured = quantile(values, limit.quantile);
    }
    result.holds = result.measured <= limit.max;  // false for NaN
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace minescan
