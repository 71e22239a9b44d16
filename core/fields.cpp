// SPDX-License-Identifier: MIT
#include "core/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace minescan {

void throw_expected(const std::string& expected, std::string_view found) {
  throw std::invalid_argument(fmt::format("expected {}, found '{}'", expected, found));
}

std::string expected_number(const Range& range, bool whole) {
  const char* kind = whole ? "a whole number" : "a number";
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high)
    return fmt::format("{} in {}{}, {}]", kind, range.low_open ? '(' : '[', range.low, range.high);
  if (low) return fmt::format("{} {} {}", kind, range.low_open ? ">" : ">=", range.low);
  if (high) return fmt::format("{} <= {}", kind, range.high);
  return kind;
}

double read_number(std::string_view text, const Range& range, bool whole) {
  const auto in_range = [&](double v) {
    return (range.low_open ? v > range.low : v >= range.low) && v <= range.high;
  };
  try {
    const double v = whole ? static_cast<double>(parse_integer(text)) : parse_number(text);
    if (in_range(v)) return v;
  } catch (const std::invalid_argument&) {
    // told below, together with the range
  }
  throw_expected(expected_number(range, whole), text);
}

bool read_bool(std::string_view text) {
  if (text == "true") return true;
  if (text == "false") return false;
  throw_expected("true | false", text);
}

std::vector<Eigen::Vector3d> read_points(std::string_view text, const Range& range) {
  std::vector<Eigen::Vector3d> points;
  for (const std::string& part : split(text, ',')) {
    std::vector<std::string> numbers;
    for (const std::string& number : split(part, ' '))
      if (!number.empty()) numbers.push_back(number);
    if (numbers.size() != 2 && numbers.size() != 3) throw_expected("'x y' or 'x y z'", part);
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < numbers.size(); ++i)
      point[static_cast<Eigen::Index>(i)] = read_number(numbers[i], range, false);
    points.push_back(point);
  }
  return points;
}

Eigen::Vector3d read_vector(std::string_view text, const Range& range) {
  const std::vector<Eigen::Vector3d> points = read_points(text, range);
  if (points.size() != 1) throw_expected("'x y z'", text);
  return points.front();
}

std::string value_text(const Eigen::Vector3d& v) {
  return fmt::format("{} {} {}", number_text(v.x()), number_text(v.y()), number_text(v.z()));
}

std::string value_text(const std::vector<Eigen::Vector3d>& v) {
  std::vector<std::string> parts;
  for (const Eigen::Vector3d& p : v) parts.push_back(value_text(p));
  return join(parts, ", ");
}

std::string value_text(const std::vector<double>& v) {
  std::vector<std::string> parts;
  for (const double x : v) parts.push_back(number_text(x));
  return join(parts, ", ");
}

std::string value_text(const std::vector<std::string>& v) { return join(v, ", "); }

void check_names(const Settings& settings, const std::vector<Field>& known) {
  for (const auto& [name, text] : settings) {
    if (find_field(known, name)) continue;
    std::vector<std::string> names;
    for (const Field& field : known) names.push_back(field.name);
    throw std::invalid_argument(unknown_name("key", name, names));
  }
}

void read_named(std::string_view name, std::string_view text, const std::function<void()>& read) {
  try {
    read();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("{} = '{}': {}", name, text, error.what()));
  }
}

const Field* find_field(const std::vector<Field>& list, std::string_view name) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const Field& f) { return f.name == name; });
  return found == list.end() ? nullptr : &*found;
}

std::vector<Field> prefixed(const std::string& prefix, std::vector<Field> list) {
  for (Field& field : list) field.name = prefix + field.name;
  return list;
}

Settings without_prefix(const std::string& prefix, const Settings& settings) {
  Settings inner;
  for (const auto& [name, text] : settings)
    if (name.starts_with(prefix)) inner[name.substr(prefix.size())] = text;
  return inner;
}

std::string fields_help(const std::vector<Field>& list) {
  std::size_t width = 0;
  for (const Field& field : list) width = std::max(width, field.name.size());
  std::string text;
  for (const Field& field : list) {
    text += fmt::format("  {:<{}}  {}{}; {}; default {}\n", field.name, width, field.help,
                        field.unit.empty() ? "" : ", " + field.unit, field.expected,
                        field.value.empty() ? "none" : field.value);
  }
  return text;
}

}  // namespace minescan
