// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <iterator>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"

namespace minescan {
namespace {

// The parts of a line; several blanks or tabs count as one separator, other separators each.
std::vector<std::string_view> fields_of(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  const auto add = [&](std::string_view field) {
    field = trimmed(field);
    if (separator != ' ' || !field.empty()) fields.push_back(field);
  };
  std::size_t at = 0;
  for (std::size_t end; (end = line.find(separator, at)) != std::string_view::npos; at = end + 1)
    add(line.substr(at, end - at));
  add(line.substr(at));
  return fields;
}

bool is_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0;
  const char* last = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), last, value);
  return error == std::errc() && stop == last;
}

// "//X", "# x" and "\"x\"" are all called x.
std::string column_name(std::string_view field) {
  std::string name;
  for (const char c : field)
    if (std::string_view("/#\" ").find(c) == std::string_view::npos)
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

}  // namespace

std::vector<Eigen::Vector3d> parse_csv(std::string_view bytes, const std::string& name) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  if (bytes.starts_with(byte_order_mark)) bytes.remove_prefix(byte_order_mark.size());
  std::vector<Eigen::Vector3d> points;
  LineReader lines(bytes, name);
  std::size_t columns[3] = {0, 1, 2};
  char separator = '\0';  // until the first line
  for (std::string_view line; lines.next(line);) {
    if (trimmed(line).empty()) continue;
    const bool first = separator == '\0';
    if (first) {
      const std::size_t at = line.find_first_of(",;\t");
      separator = at == std::string_view::npos ? ' ' : line[at];
    }
    const std::vector<std::string_view> fields = fields_of(line, separator);
    if (first && !std::all_of(fields.begin(), fields.end(), is_number)) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::string wanted(1, "xyz"[axis]);
        const auto found = std::find_if(fields.begin(), fields.end(), [&](std::string_view field) {
          return column_name(field) == wanted;
        });
        if (found == fields.end())
          lines.fail(fmt::format("expected numbers or columns x, y and z, found '{}'",
                                 line.substr(0, 40)));
        columns[axis] = static_cast<std::size_t>(found - fields.begin());
      }
      continue;
    }
    Eigen::Vector3d point;
    for (int axis = 0; axis < 3; ++axis) {
      if (columns[axis] >= fields.size())
        lines.fail(
            fmt::format("expected at least {} fields, found {}", columns[axis] + 1, fields.size()));
      point[axis] = read_number(fields[columns[axis]], lines);
    }
    points.push_back(point);
  }
  return points;
}

std::string print_csv(const std::vector<Eigen::Vector3d>& points) {
  std::string text = "x,y,z\n";
  for (const Eigen::Vector3d& p : points)
    fmt::format_to(std::back_inserter(text), "{},{},{}\n", p.x(), p.y(), p.z());
  return text;
}

}  // namespace minescan
