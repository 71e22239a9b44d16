// SPDX-License-Identifier: MIT
#include "reports/axis_label.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "eval/trial.h"

namespace minescan {
namespace {

/// Axes that read better than their names do.
const std::vector<std::pair<std::string, std::string>>& labels() {
  static const std::vector<std::pair<std::string, std::string>> table = {
      {"initial-translation", "Initial translation error [m]"},
      {"initial-rotation", "Initial rotation error [rad]"},
      {"sample-ratio", "Part of the source points used"},
  };
  return table;
}

/// The unit of an option, from the first method that has it.
std::string unit_of_option(const std::string& name) {
  for (const Method& method : methods())
    if (const Field* field = find_field(method.fields, name)) return field->unit;
  return {};
}

bool plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

}  // namespace

std::string axis_label(std::string_view axis) {
  std::string label(axis);
  std::ranges::replace(label, '_', '-');
  for (const auto& [known, better] : labels())
    if (label == known) return better;
  const std::string unit = unit_of_option(label);
  std::ranges::replace(label, '-', ' ');
  if (!label.empty() && label[0] >= 'a' && label[0] <= 'z')
    label[0] = static_cast<char>(label[0] - 'a' + 'A');
  return unit.empty() ? label : label + " [" + unit + "]";
}

std::string file_stem(std::string_view name) {
  std::string stem;
  bool gap = false;
  for (const char c : name) {
    const bool keep = plain(c) && !(c == '.' && stem.empty());
    if (keep && gap && !stem.empty()) stem += '-';
    if (keep) stem += c;
    gap = !keep;
  }
  return stem.empty() ? "unnamed" : stem;
}

}  // namespace minescan
