// SPDX-License-Identifier: MIT
// Random numbers that depend on nothing but (seed, stream, how many were drawn): the same on every
// machine and for any number of threads, since each beam, trial or block owns a stream.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace minescan {

__extension__ using Uint128 = unsigned __int128;

/// A seed for one purpose ("noise", "relief", ...) made from the user's seed, so that two purposes
/// never share numbers.
std::uint64_t derived_seed(std::uint64_t seed, std::string_view purpose);

/// Counter-based generator Philox4x32-10 (Salmon et al. 2011). Cheap to make: one per beam is fine.
class Random {
 public:
  /// `block`: how many pairs of 64 bits are skipped.
  Random(std::uint64_t seed, std::uint64_t stream, std::uint64_t block = 0)
      : seed_(seed), stream_(stream), blocks_(block) {}

  /// 64 random bits.
  std::uint64_t bits() {
    if (used_ == 2) refill();
    return block_[used_++];
  }
  /// Uniform in [0, 1), a multiple of 2^-53.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  /// Uniform among 0 ... count - 1; count >= 1. The bias is below count / 2^64.
  std::uint64_t below(std::uint64_t count) {
    return static_cast<std::uint64_t>((static_cast<Uint128>(bits()) * count) >> 64);
  }
  /// Standard normal (Box-Muller; two per two uniforms, the second kept).
  double normal();

 private:
  void refill();

  std::uint64_t seed_;
  std::uint64_t stream_;
  std::uint64_t blocks_;
  std::array<std::uint64_t, 2> block_ = {};
  int used_ = 2;
  bool has_spare_ = false;
  double spare_ = 0;
};

}  // namespace minescan
