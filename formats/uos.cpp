// SPDX-License-Identifier: MIT
#include "formats/uos.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <numbers>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"

namespace minescan {
namespace {

constexpr double centimetre = 0.01, degree = std::numbers::pi / 180;

// Our coordinates of a direction with their coordinates.
Eigen::Matrix3d ours_of_theirs() {
  return (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, 1, 0).finished();
}

}  // namespace

std::vector<Eigen::Vector3d> parse_uos(std::string_view bytes, const std::string& name) {
  // 3DTK skips up to ten lines before the first point: "361 x 300", a number of points, ...
  constexpr int longest_header = 10;
  std::vector<Eigen::Vector3d> points;
  LineReader lines(bytes, name);
  std::vector<double> values;
  int header = 0;
  for (std::string_view line; lines.next(line);) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    try {
      read_columns(line, 3, values, lines);
    } catch (const std::runtime_error&) {
      if (!points.empty() || ++header > longest_header) throw;
      continue;
    }
    points.emplace_back(centimetre * values[2], -centimetre * values[0], centimetre * values[1]);
  }
  return points;
}

std::string print_uos(const std::vector<Eigen::Vector3d>& points,
                      const std::vector<float>& intensity) {
  std::string text;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = points[i] / centimetre;
    fmt::format_to(std::back_inserter(text), "{:.4f} {:.4f} {:.4f}", -p.y(), p.z(), p.x());
    if (!intensity.empty()) fmt::format_to(std::back_inserter(text), " {}", intensity.at(i));
    text += '\n';
  }
  return text;
}

Pose parse_uos_pose(std::string_view text, const std::string& name) {
  std::vector<double> values;
  try {
    values = parse_numbers(text);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(name + ": " + error.what());
  }
  if (values.size() != 6)
    throw std::runtime_error(
        fmt::format("{}: expected x y z (cm) and three angles (degrees), found {} numbers", name,
                    values.size()));
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix3d rotation = (AngleAxisd(degree * values[3], Vector3d::UnitX()) *
                                    AngleAxisd(degree * values[4], Vector3d::UnitY()) *
                                    AngleAxisd(degree * values[5], Vector3d::UnitZ()))
                                       .toRotationMatrix();
  const Eigen::Matrix3d ours = ours_of_theirs();
  Pose pose = Pose::Identity();
  pose.linear() = ours * rotation * ours.transpose();
  pose.translation() = centimetre * (ours * Vector3d(values[0], values[1], values[2]));
  return pose;
}

std::string print_uos_pose(const Pose& T_world_scanner) {
  const Eigen::Matrix3d ours = ours_of_theirs();
  const Eigen::Matrix3d R = ours.transpose() * T_world_scanner.linear() * ours;
  const Eigen::Vector3d t = ours.transpose() * T_world_scanner.translation() / centimetre;
  // From R = Rx Ry Rz; theta_z from Ry Rz = Rx^-1 R, which is exact at theta_y = 90 degrees too,
  // where any theta_x will do.
  const double x = std::atan2(-R(1, 2), R(2, 2));
  const double y = std::atan2(R(0, 2), std::hypot(R(0, 0), R(0, 1)));
  const double z = std::atan2(std::cos(x) * R(1, 0) + std::sin(x) * R(2, 0),
                              std::cos(x) * R(1, 1) + std::sin(x) * R(2, 1));
  // Adding 0 turns -0 into 0.
  return fmt::format("{} {} {}\n{} {} {}\n", t.x() + 0, t.y() + 0, t.z() + 0, x / degree + 0,
                     y / degree + 0, z / degree + 0);
}

}  // namespace minescan
