// SPDX-License-Identifier: MIT
// Cubic cells in space, and a table of those that are in use. Memory goes with the cells in use,
// not with the volume between them, so two points far apart cost no more than two neighbours.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace minescan {

/// Cell (i, j, k) holds the points with i <= (p.x - origin.x) / side < i + 1 and so on.
class Lattice {
 public:
  /// Indices reach from -index_limit to index_limit - 1 on each axis: three fit in one key.
  static constexpr int index_limit = 1 << 20;
  /// The key of a point beyond that.
  static constexpr std::uint64_t no_key = ~std::uint64_t{0};

  explicit Lattice(double side, const Eigen::Vector3d& origin = Eigen::Vector3d::Zero())
      : side_(side), inverse_side_(1 / side), origin_(origin) {}

  std::uint64_t key(const Eigen::Vector3d& p) const {
    const double x = (p.x() - origin_.x()) * inverse_side_;
    const double y = (p.y() - origin_.y()) * inverse_side_;
    const double z = (p.z() - origin_.z()) * inverse_side_;
    constexpr double limit = index_limit;
    if (!(std::abs(x) < limit && std::abs(y) < limit && std::abs(z) < limit)) return no_key;
    return biased(x) | biased(y) << 21 | biased(z) << 42;
  }
  /// As `key`, but throws std::invalid_argument (naming `option`, the side) for a point beyond.
  std::uint64_t checked_key(const Eigen::Vector3d& p, const char* option) const {
    const std::uint64_t k = key(p);
    if (k == no_key) throw_beyond(p, option);
    return k;
  }
  /// The corner with the smallest coordinates.
  Eigen::Vector3d corner(std::uint64_t key) const;

  double side() const { return side_; }

 private:
  // floor, without the library call that baseline x86-64 needs for it; never plain truncation,
  // which would make the cells around zero twice as wide.
  static std::uint64_t biased(double x) {
    const int truncated = static_cast<int>(x);
    const int index = truncated - static_cast<int>(x < static_cast<double>(truncated));
    return static_cast<std::uint64_t>(std::int64_t{index} + index_limit);
  }
  [[noreturn]] void throw_beyond(const Eigen::Vector3d& p, const char* option) const;

  double side_;
  double inverse_side_;
  Eigen::Vector3d origin_;
};

/// Numbers keys 0, 1, 2, ... in the order in which they are first inserted. Open addressing with
/// linear probing, at most half full.
class KeyTable {
 public:
  static constexpr std::uint32_t not_found = ~std::uint32_t{0};

  KeyTable() : slots_(16) {}

  /// The number of `key`, a new one if need be.
  std::uint32_t insert(std::uint64_t key) {
    const std::size_t i = slot(key);
    if (slots_[i].number != not_found) return slots_[i].number;
    return insert_at(i, key);
  }
  std::uint32_t find(std::uint64_t key) const { return slots_[slot(key)].number; }

  std::uint32_t size() const { return size_; }
  std::size_t bytes() const { return slots_.size() * sizeof(Slot); }

 private:
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t number = not_found;
  };

  /// Where `key` is, or the empty slot where it would go.
  std::size_t slot(std::uint64_t key) const {
    // Fibonacci hashing: the high bits of a product depend on all lower bits of the key.
    std::size_t i = (key * 0x9E3779B97F4A7C15u) >> shift_;
    const std::size_t mask = slots_.size() - 1;
    while (slots_[i].number != not_found && slots_[i].key != key) i = (i + 1) & mask;
    return i;
  }
  std::uint32_t insert_at(std::size_t i, std::uint64_t key);

  std::vector<Slot> slots_;
  int shift_ = 60;  // 64 - log2(slots)
  std::uint32_t size_ = 0;
};

}  // namespace minescan
