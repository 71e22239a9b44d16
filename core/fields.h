// SPDX-License-Identifier: MIT
// Options by name. Each options struct lists its members once, in a function `fields` beside it:
//
//   template <class Visitor>
//   void fields(SamplingOptions& o, Visitor&& field) {
//     field("sample-ratio", o.ratio, ratio, "", "part of the source points that is kept");
//     field("sampling", o.sampling, "how they are drawn");
//   }
//
// Command line, YAML, --help, range checks, sweeps and the text in result tables are derived from
// that list. Members may be double, int, std::uint64_t (all with a Range and a unit), bool,
// std::string, std::vector<double>, std::vector<std::string>, Eigen::Vector3d ("x y z"),
// std::vector<Eigen::Vector3d> (points, "x y z, x y z"), and enums whose names are given by
//
//   constexpr auto names_of(Sampling) { return std::to_array<std::string_view>({"uniform",
//   "spatial"}); }
//
// in the order of the enumerators 0, 1, 2, ... Options nest: fields(o.sampling, field).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/text.h"

namespace minescan {

/// Which numbers a field takes; infinity and NaN never.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  // whether `low` itself is excluded
};
inline constexpr Range any_number{};
inline constexpr Range positive{.low = 0, .low_open = true};
inline constexpr Range not_negative{.low = 0};
inline constexpr Range ratio{.low = 0, .high = 1, .low_open = true};
constexpr Range between(double low, double high) { return {.low = low, .high = high}; }
constexpr Range above_up_to(double low, double high) {
  return {.low = low, .high = high, .low_open = true};
}

/// Values by name, in canonical text: those that differ from the defaults, or all.
using Settings = std::map<std::string, std::string>;

/// All that is known of one option without knowing its struct.
struct Field {
  std::string name = {};
  std::string unit = {};      // "" where there is none
  std::string expected = {};  // "a number in (0, 1]", "uniform or spatial", ...
  std::string help = {};
  std::string value = {};  // the default, canonical
  bool number = false;     // whether the text of a value is a number
  /// The canonical text of a value; throws std::invalid_argument "expected ..., found ...".
  std::function<std::string(std::string_view)> canonical = {};
};

// What kinds of members there are: how each is read, written and described.
std::string expected_number(const Range& range, bool whole);
double read_number(std::string_view text, const Range& range, bool whole);
bool read_bool(std::string_view text);
std::vector<Eigen::Vector3d> read_points(std::string_view text, const Range& range);
Eigen::Vector3d read_vector(std::string_view text, const Range& range);
[[noreturn]] void throw_expected(const std::string& expected, std::string_view found);

template <class T>
concept NamedEnum = std::is_enum_v<T> && requires(T value) {
  names_of(value);
};

inline std::string value_text(double v) { return number_text(v); }
inline std::string value_text(int v) { return std::to_string(v); }
inline std::string value_text(std::uint64_t v) { return std::to_string(v); }
inline std::string value_text(bool v) { return v ? "true" : "false"; }
inline std::string value_text(const std::string& v) { return v; }
std::string value_text(const std::vector<double>& v);
std::string value_text(const std::vector<std::string>& v);
std::string value_text(const Eigen::Vector3d& v);
std::string value_text(const std::vector<Eigen::Vector3d>& v);
template <NamedEnum T>
std::string value_text(T v) {
  return std::string(names_of(v).at(static_cast<std::size_t>(v)));
}

template <class T>
std::string value_expected(const T& v, const Range& range) {
  if constexpr (NamedEnum<T>) {
    const auto names = names_of(v);
    return join({names.begin(), names.end()}, " | ");
  } else if constexpr (std::is_same_v<T, bool>) {
    return "true | false";
  } else if constexpr (std::is_arithmetic_v<T>) {
    return expected_number(range, std::is_integral_v<T>);
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    return "numbers with commas between, each " + expected_number(range, false);
  } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    return "names with commas between";
  } else if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
    return "'x y z', each " + expected_number(range, false);
  } else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector3d>>) {
    return "points 'x y' or 'x y z' with commas between, each " + expected_number(range, false);
  } else {
    return "text";
  }
}

template <class T>
void read_value(std::string_view text, const Range& range, T& v) {
  if constexpr (NamedEnum<T>) {
    const auto names = names_of(v);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] != text) continue;
      v = static_cast<T>(i);
      return;
    }
    throw_expected(value_expected(v, range), text);
  } else if constexpr (std::is_same_v<T, bool>) {
    v = read_bool(text);
  } else if constexpr (std::is_arithmetic_v<T>) {
    // A whole number must fit its member, whatever the range says.
    Range fitting = range;
    if constexpr (std::is_integral_v<T>) {
      fitting.low = std::max(range.low, static_cast<double>(std::numeric_limits<T>::min()));
      fitting.high = std::min(range.high, static_cast<double>(std::numeric_limits<T>::max()));
    }
    v = static_cast<T>(read_number(text, fitting, std::is_integral_v<T>));
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    v.clear();
    for (const std::string& part : split(text, ',')) v.push_back(read_number(part, range, false));
  } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    v = split(text, ',');
  } else if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
    v = read_vector(text, range);
  } else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector3d>>) {
    v = read_points(text, range);
  } else {
    v = std::string(text);
  }
}

/// What `fields` calls for every member: `action` gets (name, member, range, unit, help).
template <class Action>
struct FieldVisitor {
  Action action;
  template <class T>
  void operator()(const char* name, T& v, const Range& range, const char* unit, const char* help) {
    action(name, v, range, unit, help);
  }
  template <class T>
  void operator()(const char* name, T& v, const char* help) {
    action(name, v, any_number, "", help);
  }
};
template <class Action>
FieldVisitor(Action) -> FieldVisitor<Action>;

/// `field` under longer names: "width" becomes "drifts.main.width" for "drifts.main.".
template <class Visitor>
auto under(std::string prefix, Visitor& field) {
  return FieldVisitor{[&field, prefix = std::move(prefix)](const char* name, auto& v,
                                                           const Range& range, const char* unit,
                                                           const char* help) {
    field((prefix + name).c_str(), v, range, unit, help);
  }};
}

/// Every field of `defaults`, in the order listed.
template <class Options>
std::vector<Field> fields_of(Options defaults) {
  std::vector<Field> list;
  fields(defaults, FieldVisitor{[&]<class T>(const char* name, const T& v, const Range& range,
                                             const char* unit, const char* help) {
           list.push_back({.name = name,
                           .unit = unit,
                           .expected = value_expected(v, range),
                           .help = help,
                           .value = value_text(v),
                           .number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>,
                           .canonical = [range](std::string_view text) {
                             T parsed{};
                             read_value(text, range, parsed);
                             return value_text(parsed);
                           }});
         }});
  return list;
}

/// Throws std::invalid_argument unless every name of `settings` is a field's.
void check_names(const Settings& settings, const std::vector<Field>& known);

/// "key 'cell-size' = '-1': expected ..." around what `read` throws.
void read_named(std::string_view name, std::string_view text, const std::function<void()>& read);

/// `options` with the named values replaced. Throws std::invalid_argument for an unknown name (with
/// the known ones) or a value out of range.
template <class Options>
Options with_settings(Options options, const Settings& settings) {
  check_names(settings, fields_of(options));
  fields(options, FieldVisitor{[&]<class T>(const char* name, T& v, const Range& range, const char*,
                                            const char*) {
           const auto found = settings.find(name);
           if (found != settings.end())
             read_named(name, found->second, [&] { read_value(found->second, range, v); });
         }});
  return options;
}

/// The field called `name`, or null.
const Field* find_field(const std::vector<Field>& list, std::string_view name);

/// The same fields under longer names: "edge-length" becomes "scene.edge-length" for "scene.".
std::vector<Field> prefixed(const std::string& prefix, std::vector<Field> list);

/// The settings whose names begin with `prefix`, without it.
Settings without_prefix(const std::string& prefix, const Settings& settings);

/// Help text: one line per field with unit, what is expected, default and meaning.
std::string fields_help(const std::vector<Field>& list);

}  // namespace minescan
