// SPDX-License-Identifier: MIT
// Triangles of a mesh that cross or touch each other where they should not. Every decision is that
// of exact arithmetic on the coordinates as they stand, whatever their size.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "core/cloud.h"

namespace minescan {

/// Whether the corners of a triangle are finite and not in one line.
bool has_area(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

/// How many pairs of triangles have more in common than the corners (and the side between two
/// corners) that they share by index. Touching counts, be it in a point; so do two triangles with
/// the same corners. Triangles without area are not looked at.
///
/// mesh   its triangles name vertices that are there
/// cost   O(triangles * log(triangles) + pairs whose boxes overlap) time, about 16 bytes per
///        triangle and 16 more for a moment; the same number for any number of threads
std::size_t count_self_intersections(const TriangleMesh& mesh);

}  // namespace minescan
