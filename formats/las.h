// SPDX-License-Identifier: MIT
// ASPRS LAS files ("LAS Specification Version 1.2", 2008; for reading also 1.4, 2013).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace minescan {

/// What point format 1 says of a point.
struct LasPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // metres
  std::uint16_t intensity = 0;
  std::uint8_t echo = 1;       // which return of its beam, 1 to 7
  std::uint8_t echoes = 1;     // of that beam, 1 to 7
  std::uint8_t user_data = 0;  // means what the writer wants
  double time = 0;             // seconds
};

/// A LAS 1.2 file of point format 1. Coordinates are rounded to 0.01 mm, so they are off by at most
/// 0.005 mm; the offset is the middle of the points in whole metres. The same points give the same
/// bytes: the file has no date. `system` (at most 32 characters are kept) says what measured them.
///
/// throws  std::invalid_argument for a coordinate that is not finite or more than 21 km from the
///         middle, or more than 2^32 - 1 points
std::string print_las(const std::vector<LasPoint>& points, std::string_view system);

}  // namespace minescan
