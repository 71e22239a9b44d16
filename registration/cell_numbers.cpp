// SPDX-License-Identifier: MIT
#include "registration/cell_numbers.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace minescan {
namespace {

// Bits 0, 1, 2, ... of a number below 2^21 at 0, 3, 6, ...
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

}  // namespace

CellNumbers::CellNumbers(const std::vector<std::int32_t>& numbers,
                         const std::array<std::int32_t, 3>& size, Storage storage)
    : size_(size), storage_(storage) {
  assert(storage != Storage::dense);
  std::vector<std::int32_t> places;
  for (std::size_t place = 0; place < numbers.size(); ++place)
    if (numbers[place] >= 0) places.push_back(static_cast<std::int32_t>(place));
  if (storage == Storage::morton) {
    std::vector<std::pair<std::uint64_t, std::int32_t>> sorted;
    for (const std::int32_t place : places) sorted.emplace_back(morton(place), place);
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      codes_.push_back(sorted[i].first);
      places[i] = sorted[i].second;
    }
  }
  for (const std::int32_t place : places) {
    if (storage == Storage::hash) table_.insert(static_cast<std::uint64_t>(place));
    if (storage == Storage::runs) {
      const auto row = static_cast<std::size_t>(place / size_[0]);
      const std::int32_t x = place % size_[0];
      const bool new_row = rows_.size() <= row;
      while (rows_.size() <= row) rows_.push_back(static_cast<std::uint32_t>(runs_.size()));
      if (new_row || runs_.back().end != x)
        runs_.push_back({x, x, static_cast<std::uint32_t>(numbers_.size())});
      ++runs_.back().end;
    }
    numbers_.push_back(numbers[static_cast<std::size_t>(place)]);
  }
  if (storage == Storage::runs)
    rows_.resize(static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]) + 1,
                 static_cast<std::uint32_t>(runs_.size()));
}

std::uint64_t CellNumbers::morton(std::int32_t place) const {
  const std::int32_t row = place / size_[0];
  const auto code = [](std::int32_t i) { return spread(static_cast<std::uint64_t>(i)); };
  return code(place % size_[0]) | code(row % size_[1]) << 1 | code(row / size_[1]) << 2;
}

std::int32_t CellNumbers::find(std::int32_t place) const {
  switch (storage_) {
    case Storage::dense:
      break;
    case Storage::hash: {
      const std::uint32_t index = table_.find(static_cast<std::uint64_t>(place));
      return index == KeyTable::not_found ? -1 : numbers_[index];
    }
    case Storage::morton: {
      const std::uint64_t code = morton(place);
      const auto at = std::lower_bound(codes_.begin(), codes_.end(), code);
      if (at == codes_.end() || *at != code) return -1;
      return numbers_[static_cast<std::size_t>(at - codes_.begin())];
    }
    case Storage::runs: {
      const auto row = static_cast<std::size_t>(place / size_[0]);
      const std::int32_t x = place % size_[0];
      for (std::uint32_t r = rows_[row]; r < rows_[row + 1] && runs_[r].begin <= x; ++r)
        if (x < runs_[r].end)
          return numbers_[runs_[r].first + static_cast<std::uint32_t>(x - runs_[r].begin)];
      return -1;
    }
  }
  return -1;
}

std::size_t CellNumbers::bytes() const {
  return numbers_.size() * sizeof(numbers_[0]) + codes_.size() * sizeof(codes_[0]) +
         rows_.size() * sizeof(rows_[0]) + runs_.size() * sizeof(runs_[0]) +
         (storage_ == Storage::hash ? table_.bytes() : 0);
}

}  // namespace minescan
