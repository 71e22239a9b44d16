// SPDX-License-Identifier: MIT
#include "formats/data_set.h"

#include <fmt/format.h>

#include <bit>
#include <iterator>
#include <stdexcept>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/columns.h"

namespace minescan {
namespace {

// One property of the vertices of a scan's file and how its bytes are appended.
struct Column {
  const char* type;
  const char* name;
  void (*append)(std::string& bytes, const Scan& scan, std::size_t i);
};

template <class T>
void put(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

constexpr Column columns[] = {
    {"float", "x",
     [](auto& b, auto& s, auto i) { put(b, static_cast<float>(s.cloud.points[i].x())); }},
    {"float", "y",
     [](auto& b, auto& s, auto i) { put(b, static_cast<float>(s.cloud.points[i].y())); }},
    {"float", "z",
     [](auto& b, auto& s, auto i) { put(b, static_cast<float>(s.cloud.points[i].z())); }},
    {"float", "intensity", [](auto& b, auto& s, auto i) { put(b, s.intensity[i]); }},
    {"double", "time", [](auto& b, auto& s, auto i) { put(b, s.time[i]); }},
    {"uint", "ring", [](auto& b, auto& s, auto i) { put(b, s.ring[i]); }},
    {"uint", "column", [](auto& b, auto& s, auto i) { put(b, s.column[i]); }},
    {"double", "true_range", [](auto& b, auto& s, auto i) { put(b, s.true_range[i]); }},
    {"double", "range", [](auto& b, auto& s, auto i) { put(b, s.range[i]); }},
    {"float", "incidence", [](auto& b, auto& s, auto i) { put(b, s.incidence[i]); }},
    {"float", "nx", [](auto& b, auto& s, auto i) { put(b, s.true_normal[i].x()); }},
    {"float", "ny", [](auto& b, auto& s, auto i) { put(b, s.true_normal[i].y()); }},
    {"float", "nz", [](auto& b, auto& s, auto i) { put(b, s.true_normal[i].z()); }},
    {"uint", "triangle", [](auto& b, auto& s, auto i) { put(b, s.triangle[i]); }},
    {"uchar", "material", [](auto& b, auto& s, auto i) { put(b, s.material[i]); }},
    {"uchar", "flags", [](auto& b, auto& s, auto i) { put(b, s.flags[i]); }},
};

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
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment scene {}\ncomment scanner {}\ncomment metres, "
      "scanner frame: x forward, y left, z up\nelement vertex {}\n",
      scan.scene, scan.scanner, scan.cloud.points.size());
  for (const Column& column : columns)
    fmt::format_to(std::back_inserter(bytes), "property {} {}\n", column.type, column.name);
  bytes += "end_header\n";
  for (std::size_t i = 0; i < scan.cloud.points.size(); ++i)
    for (const Column& column : columns) column.append(bytes, scan, i);
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
