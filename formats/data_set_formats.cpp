// SPDX-License-Identifier: MIT
#include "formats/data_set_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "core/table.h"
#include "formats/binary.h"
#include "formats/cloud_file.h"
#include "formats/las.h"
#include "formats/npy.h"
#include "formats/registration_benchmark.h"
#include "formats/scan_columns.h"
#include "formats/uos.h"

namespace minescan {
namespace {

using Files = std::vector<DataSetFile>;

Files nothing(const DataSetSummary&) { return {}; }

// pcd

// For each beam, row by row of an organised cloud, the point it gave; none for a beam that did not
// come back. Nothing if the scan has no grid or a beam gave several points.
constexpr std::size_t no_point = std::numeric_limits<std::size_t>::max();
std::optional<std::vector<std::size_t>> points_of_beams(const Scan& scan) {
  const std::size_t points = scan.cloud.points.size();
  if (scan.rings == 0 || scan.columns == 0 || scan.ring.size() != points ||
      scan.column.size() != points)
    return std::nullopt;
  std::vector<std::size_t> beams(std::size_t{scan.rings} * scan.columns, no_point);
  for (std::size_t i = 0; i < points; ++i) {
    if (scan.ring[i] >= scan.rings || scan.column[i] >= scan.columns) return std::nullopt;
    std::size_t& beam = beams[std::size_t{scan.ring[i]} * scan.columns + scan.column[i]];
    if (beam != no_point) return std::nullopt;
    beam = i;
  }
  return beams;
}

char pcd_type(NumberType type) {
  return type == NumberType::float32 || type == NumberType::float64 ? 'F' : 'U';
}

// The row of a beam that did not come back.
std::string empty_row(const std::vector<ScanColumn>& columns) {
  std::string row;
  for (const ScanColumn& column : columns) {
    if (column.type == NumberType::float32)
      append(row, std::numeric_limits<float>::quiet_NaN());
    else if (column.type == NumberType::float64)
      append(row, std::numeric_limits<double>::quiet_NaN());
    else
      row.append(size_of(column.type), '\0');
  }
  return row;
}

// Byte of a row at which the column called `name` begins.
std::size_t offset_of(const std::vector<ScanColumn>& columns, std::string_view name) {
  std::size_t offset = 0;
  for (const ScanColumn& column : columns) {
    if (column.name == name) return offset;
    offset += size_of(column.type);
  }
  throw std::invalid_argument(fmt::format("offset_of: the scan has no {}", name));
}

std::string print_pcd_scan(const Scan& scan) {
  const std::vector<ScanColumn> columns = scan_columns(scan);
  std::string names, sizes, types, counts;
  for (const ScanColumn& column : columns) {
    fmt::format_to(std::back_inserter(names), " {}", column.name);
    fmt::format_to(std::back_inserter(sizes), " {}", size_of(column.type));
    fmt::format_to(std::back_inserter(types), " {}", pcd_type(column.type));
    counts += " 1";
  }
  const std::optional<std::vector<std::size_t>> beams = points_of_beams(scan);
  const std::size_t points = scan.cloud.points.size();
  const std::size_t rows = beams ? beams->size() : points;
  std::string bytes = fmt::format(
      "# .PCD v0.7\nVERSION 0.7\nFIELDS{}\nSIZE{}\nTYPE{}\nCOUNT{}\nWIDTH {}\nHEIGHT {}\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA binary\n",
      names, sizes, types, counts, beams ? scan.columns : points, beams ? scan.rings : 1, rows);
  const std::size_t header = bytes.size(), stride = row_size(columns);
  bytes.resize(header + rows * stride);
  if (!beams) {
    for (std::size_t i = 0; i < points; ++i)
      write_row(columns, scan, i, bytes.data() + header + i * stride);
    return bytes;
  }
  const std::string empty = empty_row(columns);
  const std::size_t ring = offset_of(columns, "ring"), column = offset_of(columns, "column");
  for (std::size_t k = 0; k < rows; ++k) {
    char* row = bytes.data() + header + k * stride;
    if ((*beams)[k] != no_point) {
      write_row(columns, scan, (*beams)[k], row);
      continue;
    }
    empty.copy(row, stride);
    store(row + ring, static_cast<std::uint32_t>(k / scan.columns));
    store(row + column, static_cast<std::uint32_t>(k % scan.columns));
  }
  return bytes;
}

Files pcd_scan(std::size_t index, const Scan& scan) {
  return {{fmt::format("pcd/{:04}.pcd", index), print_pcd_scan(scan)}};
}

// las

// Whether points i and i + 1 are returns of one beam.
bool same_beam(const Scan& scan, std::size_t i) {
  const auto same = [&](const std::vector<std::uint32_t>& index) {
    return index.empty() || index[i] == index[i + 1];
  };
  return i + 1 < scan.echo.size() && scan.echo[i] < scan.echo[i + 1] && same(scan.ring) &&
         same(scan.column);
}

Files las_scan(std::size_t index, const Scan& scan) {
  scan_columns(scan);  // throws unless each attribute has a value per point, or none
  std::vector<LasPoint> points(scan.cloud.points.size());
  // Backwards, because the last return of a beam knows how many there are.
  for (std::size_t i = points.size(); i-- > 0;) {
    LasPoint& point = points[i];
    point.position = scan.cloud.points[i];
    if (!scan.intensity.empty())
      point.intensity = static_cast<std::uint16_t>(
          std::lround(65535 * std::sqrt(std::clamp(scan.intensity[i], 0.0F, 1.0F))));
    if (!scan.time.empty()) point.time = scan.time[i];
    if (!scan.flags.empty()) point.user_data = scan.flags[i];
    if (scan.echo.empty()) continue;
    point.echo = scan.echo[i];
    point.echoes = same_beam(scan, i) ? points[i + 1].echoes : scan.echo[i];
  }
  return {{fmt::format("las/{:04}.las", index), print_las(points, scan.scanner)}};
}

// npy

Files npy_scan(std::size_t index, const Scan& scan) {
  const std::vector<ScanColumn> columns = scan_columns(scan);
  std::vector<double> values;
  values.reserve(columns.size() * scan.cloud.points.size());
  for (std::size_t i = 0; i < scan.cloud.points.size(); ++i)
    for (const ScanColumn& column : columns) {
      char bytes[sizeof(double)];
      column.write(scan, i, bytes);
      values.push_back(load_number(bytes, column.type, false));
    }
  Files files = {{fmt::format("npy/{:04}.npy", index),
                  print_npy_matrix(scan.cloud.points.size(), columns.size(), values)}};
  if (index == 0) {
    std::string names;
    for (const ScanColumn& column : columns) names += fmt::format("{}\n", column.name);
    files.push_back({"npy/columns.txt", names});
  }
  return files;
}

// uos

Files uos_scan(std::size_t index, const Scan& scan) {
  return {{fmt::format("uos/scan{:03}.3d", index), print_uos(scan.cloud.points)},
          {fmt::format("uos/scan{:03}.pose", index), print_uos_pose(scan.T_world_scanner)}};
}

Files uosr_scan(std::size_t index, const Scan& scan) {
  return {{fmt::format("uosr/scan{:03}.3d", index), print_uos(scan.cloud.points, scan.intensity)},
          {fmt::format("uosr/scan{:03}.pose", index), print_uos_pose(scan.T_world_scanner)}};
}

// kitti

Files kitti_scan(std::size_t index, const Scan& scan) {
  return {{fmt::format("kitti/velodyne/{:06}.bin", index),
           print_kitti(scan.cloud.points, scan.intensity)}};
}

Files kitti_summary(const DataSetSummary& summary) {
  std::string poses, times;
  for (std::size_t k = 0; k < summary.truth.size(); ++k) {
    const Pose T_first_scanner = summary.truth[0].inverse() * summary.truth[k];
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        fmt::format_to(std::back_inserter(poses), "{:.17g}{}", T_first_scanner(row, column),
                       row == 2 && column == 3 ? '\n' : ' ');
    fmt::format_to(std::back_inserter(times), "{:.6e}\n", summary.times.at(k));
  }
  return {{"kitti/poses.txt", poses},
          {"kitti/times.txt", times},
          {"kitti/calib.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n"}};
}

// benchmark

Files benchmark_scan(std::size_t index, const Scan& scan) {
  std::vector<Eigen::Vector3d> world = scan.cloud.points;
  for (Eigen::Vector3d& point : world) point = scan.T_world_scanner * point;
  return {{"benchmark" / benchmark_cloud(index), print_pcd(world)}};
}

Files benchmark_summary(const DataSetSummary& summary) {
  return {{fmt::format("benchmark/{}_local.txt", summary.name),
           print_benchmark_problems(summary.pairs, summary.truth)}};
}

}  // namespace

const std::vector<DataSetFormat>& data_set_formats() {
  static const std::vector<DataSetFormat> table = {
      {"pcd", "PCL: all columns with the truth, organised where beams lie on a grid", pcd_scan,
       nothing},
      {"las", "LAS 1.2 in steps of 0.01 mm: intensity, time, return, flags", las_scan, nothing},
      {"npy", "NumPy: all columns with the truth, float64; columns.txt names them", npy_scan,
       nothing},
      {"uos", "3DTK: scan000.3d and scan000.pose (exact), left-handed, centimetres", uos_scan,
       nothing},
      {"uosr", "3DTK: as uos with the amplitude", uosr_scan, nothing},
      {"kitti", "KITTI odometry: velodyne/000000.bin, poses.txt (exact), times.txt", kitti_scan,
       kitti_summary},
      {"benchmark", "problems of the point clouds registration benchmark (Fontana et al. 2021)",
       benchmark_scan, benchmark_summary},
  };
  return table;
}

std::vector<DataSetFormat> find_data_set_formats(const std::string& names) {
  std::vector<DataSetFormat> formats;
  for (const std::string& name : split(names, ','))
    formats.push_back(find_row(data_set_formats(), "data-set format", name));
  return formats;
}

}  // namespace minescan
