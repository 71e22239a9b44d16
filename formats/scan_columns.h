// SPDX-License-Identifier: MIT
// What is known of each point of a scan, as the columns of a binary table.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/input_file.h"

namespace minescan {

/// One number of each point.
struct ScanColumn {
  std::string_view name = {};
  NumberType type = NumberType::float32;
  /// How many points have it: all or none.
  std::size_t (*count)(const Scan& scan) = nullptr;
  /// Writes the little-endian bytes of point `i`.
  void (*write)(const Scan& scan, std::size_t i, char* to) = nullptr;
};

/// The columns that `scan` has, in the order of formats/data_set.h. Throws std::invalid_argument if
/// one has another number of values than there are points.
std::vector<ScanColumn> scan_columns(const Scan& scan);

/// Bytes of one point.
std::size_t row_size(const std::vector<ScanColumn>& columns);

/// Writes the row_size(columns) bytes of point `i`.
void write_row(const std::vector<ScanColumn>& columns, const Scan& scan, std::size_t i, char* to);

}  // namespace minescan
