// SPDX-License-Identifier: MIT
#include "reports/axis_label.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace minescan {
namespace {

/// The axes of the paper's experiments.
const std::vector<std::pair<std::string, std::string>>& labels() {
  static const std::vector<std::pair<std::string, std::string>> table = {
      {"initial-translation", "Initial translation error [m]"},
      {"initial-rotation", "Initial rotation error [rad]"},
      {"sample-ratio", "Part of the source points used"},
      {"cell-size", "Cell size [m]"},
      {"max-distance", "Largest distance of a pair [m]"},
  };
  return table;
}

bool plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-';
}

}  // namespace

std::string axis_label(std::string_view axis) {
  std::string name(axis);
  std::ranges::replace(name, '_', '-');
  for (const auto& [known, label] : labels())
    if (name == known) return label;
  std::ranges::replace(name, '-', ' ');
  if (!name.empty() && name[0] >= 'a' && name[0] <= 'z')
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
  return name;
}

std::string file_stem(std::string_view name) {
  std::string stem(name);
  std::ranges::replace_if(
      stem, [](char c) { return !plain(c); }, '-');
  if (stem.empty() || stem[0] == '.') stem.insert(0, 1, '-');
  return stem;
}

}  // namespace minescan
