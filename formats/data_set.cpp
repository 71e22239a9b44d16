// SPDX-License-Identifier: MIT
#include "formats/data_set.h"

#include <fmt/format.h>

#include <iterator>
#include <stdexcept>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"
#include "formats/scan_columns.h"
#include "formats/uos.h"

namespace minescan {
namespace {

// Names of the types of numbers in PLY files.
std::string_view ply_type(NumberType type) {
  switch (type) {
    case NumberType::float32:
      return "float";
    case NumberType::float64:
      return "double";
    case NumberType::uint32:
      return "uint";
    case NumberType::uint8:
      return "uchar";
    default:
      throw std::invalid_argument("ply_type: no column of a scan is of this type");
  }
}

constexpr std::string_view pairs_header =
    "target,source,overlap,"
    "truth_tx,truth_ty,truth_tz,truth_qx,truth_qy,truth_qz,truth_qw,"
    "guess_tx,guess_ty,guess_tz,guess_qx,guess_qy,guess_qz,guess_qw";

Pose pose_of(const std::vector<double>& values, std::size_t first) {
  std::string text;
  for (std::size_t i = first; i < first + 7; ++i) text += number_text(values[i]) + ",";
  return parse_pose(text);
}

}  // namespace

std::filesystem::path scan_file(std::size_t index) { return fmt::format("scans/{:04}.ply", index); }

std::string print_scan(const Scan& scan) {
  const std::vector<ScanColumn> columns = scan_columns(scan);
  const std::size_t points = scan.cloud.points.size();
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment scene {}\ncomment scanner {}\ncomment metres, "
      "scanner frame: x forward, y left, z up\n",
      scan.scene, scan.scanner);
  if (scan.rings != 0 && scan.columns != 0)
    fmt::format_to(std::back_inserter(bytes), "obj_info num_cols {}\nobj_info num_rows {}\n",
                   scan.columns, scan.rings);
  fmt::format_to(std::back_inserter(bytes), "element vertex {}\n", points);
  for (const ScanColumn& column : columns)
    fmt::format_to(std::back_inserter(bytes), "property {} {}\n", ply_type(column.type),
                   column.name);
  bytes += "end_header\n";
  const std::size_t header = bytes.size(), stride = row_size(columns);
  bytes.resize(header + points * stride);
  for (std::size_t i = 0; i < points; ++i)
    write_row(columns, scan, i, bytes.data() + header + i * stride);
  return bytes;
}

std::string print_tum(const std::vector<double>& times, const std::vector<Pose>& poses) {
  std::string text = "# time tx ty tz qx qy qz qw\n";
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d t = poses[i].translation();
    const Eigen::Quaterniond q(poses[i].linear());
    fmt::format_to(std::back_inserter(text),
                   "{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", times.at(i),
                   t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::pair<std::vector<double>, std::vector<Pose>> parse_tum(std::string_view text,
                                                            const std::string& name) {
  LineReader lines(text, name);
  std::string_view line;
  std::pair<std::vector<double>, std::vector<Pose>> result;
  std::vector<double> values;
  while (lines.next(line)) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    read_columns(line, 8, values, lines);
    try {
      result.first.push_back(values[0]);
      result.second.push_back(pose_of(values, 1));
    } catch (const std::invalid_argument& error) {
      lines.fail(error.what());
    }
  }
  if (result.first.empty()) throw std::runtime_error(name + ": expected poses, found none");
  return result;
}

std::string print_pairs(const std::vector<DataSetPair>& pairs) {
  std::string text = fmt::format("{}\n", pairs_header);
  for (const DataSetPair& pair : pairs)
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{}\n", pair.target, pair.source,
                   pair.overlap, pose_text(pair.truth), pose_text(pair.guess));
  return text;
}

std::vector<DataSetPair> parse_pairs(std::string_view text, const std::string& name) {
  LineReader lines(text, name);
  std::string_view line;
  if (!lines.next(line) || trimmed(line) != pairs_header)
    throw std::runtime_error(fmt::format("{}: expected the first line '{}'", name, pairs_header));
  std::vector<DataSetPair> pairs;
  std::vector<double> values;
  while (lines.next(line)) {
    if (trimmed(line).empty()) continue;
    read_columns(line, 17, values, lines);
    try {
      pairs.push_back({.target = static_cast<std::size_t>(parse_integer(number_text(values[0]))),
                       .source = static_cast<std::size_t>(parse_integer(number_text(values[1]))),
                       .overlap = values[2],
                       .truth = pose_of(values, 3),
                       .guess = pose_of(values, 10)});
    } catch (const std::invalid_argument& error) {
      lines.fail(error.what());
    }
  }
  if (pairs.empty()) throw std::runtime_error(name + ": expected pairs, found none");
  return pairs;
}

Pose read_pose(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  if (lower_extension(path) == ".pose") return parse_uos_pose(text, path.string());
  LineReader lines(text, path.string());
  std::string numbers;
  for (std::string_view line; lines.next(line);)
    numbers += std::string(line.substr(0, line.find('#'))) + "\n";
  try {
    const std::vector<double> values = parse_numbers(numbers);
    return values.size() == 7 ? pose_of(values, 0) : pose_from_matrix(values);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

}  // namespace minescan
