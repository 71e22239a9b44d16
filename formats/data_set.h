// SPDX-License-Identifier: MIT
// The folder of a survey: scans with exact truth, trajectories, and the pairs to register.
//
//   survey.yaml      what made it
//   scans/0000.ply   measured points in the scanner frame and the truth of each (print_scan)
//   truth.tum        exact T_world_scanner of every scan, at its start
//   trajectory.tum   the same all the way, of a scanner that moves
//   odometry.tum     what the vehicle believed
//   pairs.csv        target, source, overlap, truth and guess of every pair
//
// Folders for other programs may be beside them (formats/data_set_formats.h).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/cloud.h"

namespace minescan {

/// One pair of a data set; poses T_target_source.
struct DataSetPair {
  std::size_t target = 0;  // indices of scans
  std::size_t source = 0;
  double overlap = 0;  // share of the source's points that the target saw too, in [0, 1]
  Pose truth = Pose::Identity();
  Pose guess = Pose::Identity();
};

/// "scans/0012.ply"
std::filesystem::path scan_file(std::size_t index);

/// A scan as binary PLY. Per vertex, in this order: x y z (float, m, as measured, scanner frame),
/// intensity (float), time (double, s), ring, column (uint), true_range, range (double, m), true_x
/// true_y true_z (float, m, where the beam really met the surface, scanner frame), incidence
/// (float, rad), nx ny nz (float, true normal, scanner frame), triangle (uint), material, flags,
/// echo (uchar); those that the scan does not have are left out. The grid of beams, if there is
/// one, is told as in Stanford's range images: obj_info num_cols (planes) and num_rows (beams per
/// plane). Throws std::invalid_argument if an attribute has another number of values than there are
/// points.
std::string print_scan(const Scan& scan);

/// Lines "time tx ty tz qx qy qz qw" in the form of the TUM RGB-D benchmark, 17 significant digits.
std::string print_tum(const std::vector<double>& times, const std::vector<Pose>& poses);

/// The times and poses of such lines; # begins a comment. Throws std::runtime_error "name:line:
/// what".
std::pair<std::vector<double>, std::vector<Pose>> parse_tum(std::string_view text,
                                                            const std::string& name);

std::string print_pairs(const std::vector<DataSetPair>& pairs);
/// The inverse of print_pairs. Throws std::runtime_error "name:line: what".
std::vector<DataSetPair> parse_pairs(std::string_view text, const std::string& name);

/// A pose from a file: 16 (or 12) row-major numbers, or tx ty tz qx qy qz qw; # begins a comment.
/// A file called *.pose is one of 3DTK (formats/uos.h) and gives T_world_scanner.
/// Throws std::runtime_error naming the file.
Pose read_pose(const std::filesystem::path& path);

}  // namespace minescan
