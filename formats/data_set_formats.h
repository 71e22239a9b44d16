// SPDX-License-Identifier: MIT
// The scans and poses of a survey as other programs read them: one row per format. Each row writes
// a folder of its own beside scans/ (formats/data_set.h), called by the row.
//
// The form of the TUM RGB-D benchmark has no row: truth.tum and odometry.tum are always there.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "formats/data_set.h"

namespace minescan {

/// What is known when all scans of a data set are done; entry k is of scan k.
struct DataSetSummary {
  std::string name = {};            // of the survey
  std::vector<double> times = {};   // seconds
  std::vector<Pose> truth = {};     // exact T_world_scanner
  std::vector<Pose> odometry = {};  // believed T_world_scanner
  std::vector<DataSetPair> pairs = {};
};

/// A file of a data set.
struct DataSetFile {
  std::filesystem::path path = {};  // below the folder of the data set
  std::string bytes = {};
};

/// One row of the table of formats.
struct DataSetFormat {
  std::string name = {};
  std::string description = {};
  /// The files of scan `index`. Throws std::invalid_argument if the format cannot hold the scan.
  std::function<std::vector<DataSetFile>(std::size_t index, const Scan& scan)> scan_files = {};
  /// The files about all scans.
  std::function<std::vector<DataSetFile>(const DataSetSummary& summary)> summary_files = {};
};

/// All formats:
///
/// pcd        pcd/0000.pcd: binary PCD 0.7, the columns of scans/0000.ply under the same names. On
/// a
///            grid of beams with one return at most the cloud is organised: WIDTH planes, HEIGHT
///            beams per plane, beams without return NaN (whole numbers: 0, but for ring, column).
/// las        las/0000.las: LAS 1.2, point format 1 (formats/las.h). Intensity is 65535 times the
///            square root of the amplitude, at most 65535 (linear steps would leave few beyond 20
///            m); GPS time is seconds since the start of the scan; user data are the flags.
/// npy        npy/0000.npy: float64, a row per point, and npy/columns.txt: the name of each column,
///            those of scans/0000.ply.
/// uos        uos/scan000.3d and uos/scan000.pose, exact (formats/uos.h), for 3DTK: slam6D -f uos.
/// uosr       the same with the amplitude as fourth column: slam6D -f uosr.
/// kitti      kitti/velodyne/000000.bin: x, y, z, amplitude as float; kitti/poses.txt: exact poses,
///            a 3 x 4 matrix by rows per line, in the frame of the first, as KITTI's are;
///            kitti/times.txt: seconds; kitti/calib.txt: Tr is the identity, because the poses are
///            those of the scanner.
/// benchmark  benchmark/0000.pcd: measured points in the world frame, x y z as float (at 1 km from
///            the origin of the world, rounded by up to 0.03 mm), and benchmark/NAME_local.txt: the
///            pairs (formats/registration_benchmark.h).
const std::vector<DataSetFormat>& data_set_formats();

/// The rows called by `names`, which are separated by commas; none for an empty text. Throws
/// std::invalid_argument with the known names.
std::vector<DataSetFormat> find_data_set_formats(const std::string& names);

}  // namespace minescan
