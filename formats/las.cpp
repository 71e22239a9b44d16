// SPDX-License-Identifier: MIT
#include "formats/las.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/input_file.h"
#include "formats/binary.h"
#include "formats/cloud_file.h"

namespace minescan {
namespace {

// Bytes from the start of the header, LAS 1.2 section "Public header block"; the last of LAS 1.4.
constexpr std::size_t at_version = 24, at_system = 26, at_software = 58, at_header_size = 94,
                      at_data = 96, at_format = 104, at_record_size = 105, at_count = 107,
                      at_returns = 111, at_scale = 131, at_offset = 155, at_bounds = 179,
                      header_size_1_2 = 227, at_count_1_4 = 247, header_size_1_4 = 375;

// Bytes of a point of format 0, 1, ... 10.
constexpr std::size_t record_sizes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

constexpr double scale = 1e-5;  // metres

// Copies text into a field of zeros.
void put_text(char* field, std::string_view text) {
  std::copy_n(text.begin(), std::min<std::size_t>(text.size(), 32), field);
}

}  // namespace

std::vector<Eigen::Vector3d> parse_las(std::string_view bytes, const std::string& name) {
  const auto fail = [&](const std::string& what) { throw std::runtime_error(name + ": " + what); };
  if (!bytes.starts_with("LASF")) fail("expected 'LASF' at the start");
  if (bytes.size() < header_size_1_2)
    fail(fmt::format("expected a header of at least {} bytes, the file has {}", header_size_1_2,
                     bytes.size()));
  const char* header = bytes.data();
  const int major = header[at_version], minor = header[at_version + 1];
  if (major != 1 || minor < 0 || minor > 4)
    fail(fmt::format("expected version 1.0 to 1.4, found {}.{}", major, minor));
  const unsigned format = static_cast<unsigned char>(header[at_format]);
  if (format >= 64) fail("its points are compressed (LAZ); expected LAS");
  if (format >= std::size(record_sizes))
    fail(fmt::format("expected point format 0 to 10, found {}", format));
  const std::size_t record = load<std::uint16_t>(header + at_record_size, false);
  if (record < record_sizes[format])
    fail(fmt::format("expected at least {} bytes per point of format {}, found {}",
                     record_sizes[format], format, record));
  const std::size_t header_size = load<std::uint16_t>(header + at_header_size, false);
  const std::size_t data = load<std::uint32_t>(header + at_data, false);
  if (header_size < header_size_1_2 || data < header_size || data > bytes.size())
    fail(fmt::format("expected points after a header of {} bytes, at byte {} of {}", header_size,
                     data, bytes.size()));
  std::uint64_t count = load<std::uint32_t>(header + at_count, false);
  if (minor == 4 && header_size >= header_size_1_4)
    count = load<std::uint64_t>(header + at_count_1_4, false);
  if (count > (bytes.size() - data) / record)
    fail(fmt::format("expected {} points of {} bytes, the file ends after {}", count, record,
                     (bytes.size() - data) / record));
  Eigen::Vector3d step, offset;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = load<double>(header + at_scale + 8 * axis, false);
    offset[axis] = load<double>(header + at_offset + 8 * axis, false);
  }
  if (!step.allFinite() || !offset.allFinite() || (step.array() == 0).any())
    fail(fmt::format("expected scales other than 0 and offsets, found {} {} {} and {} {} {}",
                     step.x(), step.y(), step.z(), offset.x(), offset.y(), offset.z()));
  std::vector<Eigen::Vector3d> points(count);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      points[i][axis] =
          offset[axis] +
          step[axis] * load<std::int32_t>(header + data + i * record + 4 * axis, false);
  return points;
}

std::string print_las(const std::vector<LasPoint>& points, std::string_view system) {
  if (points.size() > std::numeric_limits<std::uint32_t>::max())
    throw std::invalid_argument(
        fmt::format("LAS file: expected at most 2^32 - 1 points, found {}", points.size()));
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
  if (!points.empty()) low = high = points[0].position;
  for (const LasPoint& point : points) {
    if (!point.position.allFinite())
      throw std::invalid_argument("LAS file: it holds no coordinates that are not finite");
    low = low.cwiseMin(point.position);
    high = high.cwiseMax(point.position);
  }
  const Eigen::Vector3d offset = ((low + high) / 2).array().round();
  constexpr double most = scale * std::numeric_limits<std::int32_t>::max();
  if ((high - offset).maxCoeff() > most || (offset - low).maxCoeff() > most)
    throw std::invalid_argument(
        fmt::format("LAS file: expected points within {:.0f} m of their middle", most));

  constexpr std::size_t stride = record_sizes[1];
  std::string bytes(header_size_1_2 + points.size() * stride, '\0');
  char* header = bytes.data();
  std::uint32_t returns[5] = {};
  char* row = header + header_size_1_2;
  Eigen::Vector3i first = Eigen::Vector3i::Zero(), last = Eigen::Vector3i::Zero();
  for (std::size_t i = 0; i < points.size(); ++i, row += stride) {
    const LasPoint& point = points[i];
    const Eigen::Vector3i steps =
        ((point.position - offset) / scale).array().round().cast<int>().matrix();
    first = i == 0 ? steps : first.cwiseMin(steps);
    last = i == 0 ? steps : last.cwiseMax(steps);
    for (int axis = 0; axis < 3; ++axis) store(row + 4 * axis, std::int32_t{steps[axis]});
    store(row + 12, point.intensity);
    const int echo = std::clamp<int>(point.echo, 1, 7),
              echoes = std::clamp<int>(point.echoes, 1, 7);
    row[14] = static_cast<char>(echo | echoes << 3);
    store(row + 17, point.user_data);
    store(row + 20, point.time);
    if (echo <= 5) ++returns[echo - 1];
  }

  put_text(header, "LASF");
  header[at_version] = 1;
  header[at_version + 1] = 2;
  put_text(header + at_system, system);
  put_text(header + at_software, "minescan");
  store(header + at_header_size, static_cast<std::uint16_t>(header_size_1_2));
  store(header + at_data, static_cast<std::uint32_t>(header_size_1_2));
  header[at_format] = 1;
  store(header + at_record_size, static_cast<std::uint16_t>(stride));
  store(header + at_count, static_cast<std::uint32_t>(points.size()));
  for (std::size_t k = 0; k < 5; ++k) store(header + at_returns + 4 * k, returns[k]);
  for (int axis = 0; axis < 3; ++axis) {
    store(header + at_scale + 8 * axis, scale);
    store(header + at_offset + 8 * axis, offset[axis]);
    // Of the rounded points, or readers find some outside.
    store(header + at_bounds + 16 * axis, offset[axis] + scale * last[axis]);
    store(header + at_bounds + 16 * axis + 8, offset[axis] + scale * first[axis]);
  }
  return bytes;
}

std::string print_las(const std::vector<Eigen::Vector3d>& points) {
  std::vector<LasPoint> records(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) records[i].position = points[i];
  return print_las(records, "");
}

}  // namespace minescan
