// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <iterator>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"

namespace minescan {

std::vector<Eigen::Vector3d> parse_xyz(std::string_view bytes, const std::string& name) {
  std::vector<Eigen::Vector3d> points;
  LineReader lines(bytes, name);
  std::vector<double> values;
  for (std::string_view line; lines.next(line);) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    read_columns(line, 3, values, lines);
    points.emplace_back(values[0], values[1], values[2]);
  }
  return points;
}

std::string print_xyz(const std::vector<Eigen::Vector3d>& points) {
  std::string text;
  for (const Eigen::Vector3d& p : points)
    fmt::format_to(std::back_inserter(text), "{} {} {}\n", p.x(), p.y(), p.z());
  return text;
}

}  // namespace minescan
