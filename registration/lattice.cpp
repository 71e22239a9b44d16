// SPDX-License-Identifier: MIT
#include "registration/lattice.h"

#include <fmt/format.h>

#include <stdexcept>

namespace minescan {

Eigen::Vector3d Lattice::corner(std::uint64_t key) const {
  constexpr std::uint64_t mask = (1u << 21) - 1;
  const auto index = [&](int shift) {
    return static_cast<double>(static_cast<int>((key >> shift) & mask) - index_limit);
  };
  return origin_ + side_ * Eigen::Vector3d(index(0), index(21), index(42));
}

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

}  // namespace minescan
