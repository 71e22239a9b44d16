// SPDX-License-Identifier: MIT
// Cubic cells in space, and a table of those that are in use. Memory goes with the cells in use,
// not with the volume between them, so two points far apart cost no more than two neighbours.
#pragma once

#include <Eigen/Core>
#include <array>
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
    return key(std::array<int, 3>{floored(x), floored(y), floored(z)});
  }
  /// As `key`, but throws std::invalid_argument (naming `option`, the side) for a point beyond.
  std::uint64_t checked_key(const Eigen::Vector3d& p, const char* option) const {
    const std::uint64_t k = key(p);
    if (k == no_key) throw_beyond(p, option);
    return k;
  }
  static std::uint64_t key(const std::array<int, 3>& cell) {
    return biased(cell[0]) | biased(cell[1]) << 21 | biased(cell[2]) << 42;
  }
  /// i, j and k of a key.
  static std::array<int, 3> indices(std::uint64_t key) {
    constexpr std::uint64_t mask = (1u << 21) - 1;
    const auto index = [&](int shift) {
      return static_cast<int>((key >> shift) & mask) - index_limit;
    };
    return {index(0), index(21), index(42)};
  }
  /// The corner with the smallest coordinates.
  Eigen::Vector3d corner(const std::array<int, 3>& cell) const {
    return origin_ + side_ * Eigen::Vector3d(cell[0], cell[1], cell[2]);
  }
  Eigen::Vector3d corner(std::uint64_t key) const { return corner(indices(key)); }

  double side() const { return side_; }
  const Eigen::Vector3d& origin() const { return origin_; }

 private:
  // floor, without the library call that baseline x86-64 needs for it; never plain truncation,
  // which would make the cells around zero twice as wide.
  static int floored(double x) {
    const int truncated = static_cast<int>(x);
    return truncated - static_cast<int>(x < static_cast<double>(truncated));
  }
  static std::uint64_t biased(int index) {
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

/// The cells of a cloud, numbered 0, 1, 2, ... in the order in which the points first touch them.
struct NumberedCells {
  std::vector<std::uint32_t> cell_of = {};  // one per point
  std::vector<std::uint64_t> keys = {};     // one per cell
};

/// Time O(N); memory O(N) whatever the space between the points. Throws std::invalid_argument
/// (naming `option`, the side) for a point more than Lattice::index_limit cells from the origin, or
/// with a coordinate that is not finite.
NumberedCells number_cells(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice,
                           const char* option);

}  // namespace minescan
