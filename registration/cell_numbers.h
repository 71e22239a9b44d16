// SPDX-License-Identifier: MIT
// Where the numbers of the cells of a box are kept, if not in an array with a place for each cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "registration/lattice.h"

namespace minescan {

/// dense: an array over the whole box (paper, section 5.2.1), which grows with the third power of
/// its sides. The others hold cells with a number only, which on surfaces grow with the second.
/// Measured (two scans of a junction, all points): a search takes 1, 1.6, 4 and 2 times as long in
/// the order below; distributions and numbers take 104, 150, 95 and 89 kB with cells of 1 m, 514,
/// 391, 290 and 273 kB with cells of 0.25 m.
enum class Storage {
  dense,
  hash,    // a table of the cells
  morton,  // sorted along a Z-order curve, looked up by bisection
  runs,    // per row along x, runs of cells one after the other (the paper's suggestion)
};
constexpr auto names_of(Storage) {
  return std::to_array<std::string_view>({"dense", "hash", "morton", "runs"});
}

/// The numbers of a box's cells, in memory that goes with how many there are.
class CellNumbers {
 public:
  /// `numbers`: of each cell, x fastest, -1: none; `size`: cells along x, y, z, at most 2^21 each.
  /// `storage` is not dense.
  CellNumbers(const std::vector<std::int32_t>& numbers, const std::array<std::int32_t, 3>& size,
              Storage storage);

  /// Of the cell at `place` of `numbers`.
  std::int32_t find(std::int32_t place) const;
  std::size_t bytes() const;

 private:
  struct Run {
    std::int32_t begin = 0, end = 0;  // along x
    std::uint32_t first = 0;          // into numbers_
  };
  std::uint64_t morton(std::int32_t place) const;

  std::array<std::int32_t, 3> size_ = {};
  Storage storage_ = Storage::hash;
  std::vector<std::int32_t> numbers_ = {};
  KeyTable table_ = {};                    // hash: place to index of numbers_
  std::vector<std::uint64_t> codes_ = {};  // morton: of each of numbers_, ascending
  std::vector<std::uint32_t> rows_ = {};   // runs: where each row's begin, and an end
  std::vector<Run> runs_ = {};
};

}  // namespace minescan
