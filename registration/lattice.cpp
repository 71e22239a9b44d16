// SPDX-License-Identifier: MIT
#include "registration/lattice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "registration/bounds.h"
#include "registration/wide.h"

namespace minescan {

void Lattice::throw_beyond(const Eigen::Vector3d& p, const char* option) const {
  throw std::invalid_argument(fmt::format(
      "{} = {}: a point at ({}, {}, {}) is more than {} cells away from the lattice's origin",
      option, side_, p.x(), p.y(), p.z(), index_limit));
}

std::uint32_t KeyTable::insert_at(std::size_t i, std::uint64_t key) {
  slots_[i] = {.key = key, .number = size_++};
  const std::uint32_t number = slots_[i].number;
  if (2 * static_cast<std::size_t>(size_) > slots_.size()) {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    --shift_;
    for (const Slot& s : old)
      if (s.number != not_found) slots_[slot(s.key)] = s;
  }
  return number;
}

namespace {

// Neighbours in a scan mostly share their cell, so that one look-up serves many points.
NumberedCells numbered_by_hash(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice) {
  NumberedCells cells{.cell_of = std::vector<std::uint32_t>(points.size())};
  KeyTable table;
  std::uint64_t last_key = Lattice::no_key;
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint64_t key = lattice.key(points[i]);
    if (key != last_key) {
      last_key = key;
      last = table.insert(key);
      if (last == cells.keys.size()) cells.keys.push_back(key);
    }
    cells.cell_of[i] = last;
  }
  return cells;
}

// Coordinates x y z x y z ... are worked on in groups of four points, which fill registers of any
// width.
constexpr std::size_t group = 12;

/// The indices of cells, less `first`, of as many coordinates; `origin` and `first` are for x, y,
/// z.
MINESCAN_WIDE void indices_from(const double* xyz, std::size_t coordinates, const double* origin,
                                double inverse_side, const int* first, int* index) {
  using Doubles = double __attribute__((vector_size(4 * sizeof(double))));
  using Ints = int __attribute__((vector_size(4 * sizeof(int))));
  Doubles o[3];
  Ints f[3];
  for (std::size_t k = 0; k < group; ++k)
    o[k / 4][k % 4] = origin[k % 3], f[k / 4][k % 4] = first[k % 3];
  for (std::size_t i = 0; i < coordinates; i += group) {
    double rest[group] = {};
    const double* from = xyz + i;
    if (coordinates - i < group) {
      std::copy_n(from, coordinates - i, rest);
      from = rest;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      Doubles at;
      std::memcpy(&at, from + 4 * k, sizeof(at));
      at = (at - o[k]) * inverse_side;
      // floor; comparisons yield -1 for true
      const Ints truncated = __builtin_convertvector(at, Ints);
      const Ints too_high =
          __builtin_convertvector(at < __builtin_convertvector(truncated, Doubles), Ints);
      const Ints from_first = truncated + too_high - f[k];
      std::memcpy(index + i + 4 * k, &from_first, sizeof(from_first));
    }
  }
}

constexpr int block_bits = 3;
constexpr std::uint32_t block_cells = 1 << (3 * block_bits);

/// Numbers of the cells of a box in blocks of 8 x 8 x 8, which are made when a point first meets
/// them: a few points far from the others cost a block each and not the space between.
NumberedCells numbered_by_blocks(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice,
                                 const std::array<int, 3>& first,
                                 const std::array<int, 3>& blocks) {
  constexpr std::uint32_t none = KeyTable::not_found;
  NumberedCells cells{.cell_of = std::vector<std::uint32_t>(points.size())};
  // Where a block begins in `numbers`; the first one there stays empty, for those not made.
  std::vector<std::uint32_t> begins(static_cast<std::size_t>(blocks[0]) * blocks[1] * blocks[2], 0);
  std::vector<std::uint32_t> numbers(block_cells, none);
  const auto add = [&](std::uint32_t block, std::uint32_t within, std::uint64_t key) {
    if (begins[block] == 0) {
      begins[block] = static_cast<std::uint32_t>(numbers.size());
      numbers.resize(numbers.size() + block_cells, none);
    }
    numbers[begins[block] + within] = static_cast<std::uint32_t>(cells.keys.size());
    cells.keys.push_back(key);
  };

  constexpr int mask = (1 << block_bits) - 1;
  constexpr std::size_t chunk = 256;  // points whose indices stay in the processor's cache
  int index[3 * chunk];
  const std::uint32_t* const begin_of = begins.data();
  for (std::size_t begin = 0; begin < points.size(); begin += chunk) {
    const std::size_t count = std::min(chunk, points.size() - begin);
    indices_from(points[begin].data(), 3 * count, lattice.origin().data(), 1 / lattice.side(),
                 first.data(), index);
    std::uint32_t* const cell_of = cells.cell_of.data() + begin;
    const std::uint32_t* number_at = numbers.data();
    for (std::size_t i = 0; i < count; ++i) {
      const int x = index[3 * i], y = index[3 * i + 1], z = index[3 * i + 2];
      const auto block = static_cast<std::uint32_t>(
          ((z >> block_bits) * blocks[1] + (y >> block_bits)) * blocks[0] + (x >> block_bits));
      const auto within = static_cast<std::uint32_t>(((z & mask) << (2 * block_bits)) |
                                                     ((y & mask) << block_bits) | (x & mask));
      if (number_at[begin_of[block] + within] == none) {
        add(block, within,
            Lattice::key(std::array<int, 3>{x + first[0], y + first[1], z + first[2]}));
        number_at = numbers.data();
      }
      cell_of[i] = number_at[begin_of[block] + within];
    }
  }
  return cells;
}

}  // namespace

NumberedCells number_cells(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice,
                           const char* option) {
  if (points.empty()) return {};
  const auto [low, high, finite] = bounds_of(points);
  if (!finite)  // it throws for that one
    for (const Eigen::Vector3d& p : points) lattice.checked_key(p, option);
  const std::array<int, 3> first = Lattice::indices(lattice.checked_key(low, option)),
                           last = Lattice::indices(lattice.checked_key(high, option));
  std::array<int, 3> blocks = {};
  double count = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    blocks[i] = ((last[i] - first[i]) >> block_bits) + 1;
    count *= blocks[i];
  }
  // Blocks while their table takes no more than the points do, and their cells can be counted (at
  // worst each point has a block); else a hash table.
  const auto n = static_cast<double>(points.size());
  return count <= n + 4096 && n * block_cells < 4e9
             ? numbered_by_blocks(points, lattice, first, blocks)
             : numbered_by_hash(points, lattice);
}

}  // namespace minescan
