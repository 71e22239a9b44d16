// SPDX-License-Identifier: MIT
#include "formats/scan_columns.h"

#include <fmt/format.h>

#include <type_traits>

#include "formats/binary.h"

namespace minescan {
namespace {

template <class T>
constexpr NumberType type_of() {
  if constexpr (std::is_same_v<T, float>) return NumberType::float32;
  if constexpr (std::is_same_v<T, double>) return NumberType::float64;
  if constexpr (std::is_same_v<T, std::uint32_t>) return NumberType::uint32;
  if constexpr (std::is_same_v<T, std::uint8_t>) return NumberType::uint8;
}

// A member of Scan with one number per point.
template <auto member>
constexpr ScanColumn numbers(std::string_view name) {
  using T = typename std::remove_reference_t<decltype(std::declval<Scan>().*member)>::value_type;
  return {name, type_of<T>(), [](const Scan& s) { return (s.*member).size(); },
          [](const Scan& s, std::size_t i, char* to) { store(to, (s.*member)[i]); }};
}

// One coordinate of a member of Scan with a vector per point.
template <auto member, int axis>
constexpr ScanColumn axis_of(std::string_view name) {
  return {name, NumberType::float32, [](const Scan& s) { return (s.*member).size(); },
          [](const Scan& s, std::size_t i, char* to) { store(to, (s.*member)[i][axis]); }};
}

template <int axis>
constexpr ScanColumn measured(std::string_view name) {
  return {name, NumberType::float32, [](const Scan& s) { return s.cloud.points.size(); },
          [](const Scan& s, std::size_t i, char* to) {
            store(to, static_cast<float>(s.cloud.points[i][axis]));
          }};
}

constexpr ScanColumn table[] = {
    measured<0>("x"),
    measured<1>("y"),
    measured<2>("z"),
    numbers<&Scan::intensity>("intensity"),
    numbers<&Scan::time>("time"),
    numbers<&Scan::ring>("ring"),
    numbers<&Scan::column>("column"),
    numbers<&Scan::true_range>("true_range"),
    numbers<&Scan::range>("range"),
    axis_of<&Scan::true_point, 0>("true_x"),
    axis_of<&Scan::true_point, 1>("true_y"),
    axis_of<&Scan::true_point, 2>("true_z"),
    numbers<&Scan::incidence>("incidence"),
    axis_of<&Scan::true_normal, 0>("nx"),
    axis_of<&Scan::true_normal, 1>("ny"),
    axis_of<&Scan::true_normal, 2>("nz"),
    numbers<&Scan::triangle>("triangle"),
    numbers<&Scan::material>("material"),
    numbers<&Scan::flags>("flags"),
    numbers<&Scan::echo>("echo"),
};

}  // namespace

std::vector<ScanColumn> scan_columns(const Scan& scan) {
  std::vector<ScanColumn> columns;
  const std::size_t points = scan.cloud.points.size();
  for (const ScanColumn& column : table) {
    const std::size_t count = column.count(scan);
    if (count == points)
      columns.push_back(column);
    else if (count != 0)
      throw std::invalid_argument(
          fmt::format("scan: expected {} values of {}, found {}", points, column.name, count));
  }
  return columns;
}

std::size_t row_size(const std::vector<ScanColumn>& columns) {
  std::size_t size = 0;
  for (const ScanColumn& column : columns) size += size_of(column.type);
  return size;
}

void write_row(const std::vector<ScanColumn>& columns, const Scan& scan, std::size_t i, char* to) {
  for (const ScanColumn& column : columns) {
    column.write(scan, i, to);
    to += size_of(column.type);
  }
}

}  // namespace minescan
