// SPDX-License-Identifier: MIT
// Problems in the form of the "point clouds registration benchmark", and its measure of error.
//
// Source: Fontana, Cattaneo, Ballardini, Vaghi, Sorrenti, "A benchmark for point clouds
// registration algorithms", Robotics and Autonomous Systems 140 (2021), and its repository
// github.com/iralabdisco/point_clouds_registration_benchmark (README.md, metric/metric.py).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/data_set.h"

namespace minescan {

/// "0012.pcd": the points of a scan in the world frame.
std::filesystem::path benchmark_cloud(std::size_t index);

/// The problems of `pairs`, one per line under a line of names: "id source target overlap t1 ...
/// t12". All clouds are in the world frame, where the truth is the identity; t1 ... t12 are the
/// first three rows of the transform to apply to the source before registration, which brings it to
/// where the pair's guess has it. T_world_scanner are the exact poses of the scans.
std::string print_benchmark_problems(const std::vector<DataSetPair>& pairs,
                                     const std::vector<Pose>& T_world_scanner);

/// The benchmark's error of a registration: the mean over the source's points of
/// |estimate p - truth p| / |p - centroid|, without unit. Not finite if a point lies on the
/// centroid, as in the original. It needs the points, so it is no row of metrics(), which judge by
/// poses alone.
///
/// source  points in their own frame, metres; poses T_target_source
/// throws  std::invalid_argument for no points
double benchmark_error(const std::vector<Eigen::Vector3d>& source, const Pose& truth,
                       const Pose& estimate);

}  // namespace minescan
