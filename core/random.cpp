// SPDX-License-Identifier: MIT
#include "core/random.h"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

namespace minescan {

std::uint64_t derived_seed(std::uint64_t seed, std::string_view purpose) {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const char c : purpose) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return Random(seed, hash).bits();
}

void Random::refill() {
  using Philox = r123::Philox4x32;
  const auto low = [](std::uint64_t v) { return static_cast<std::uint32_t>(v); };
  const auto high = [](std::uint64_t v) { return static_cast<std::uint32_t>(v >> 32); };
  const Philox::ctr_type counter = {{low(blocks_), high(blocks_), low(stream_), high(stream_)}};
  const Philox::key_type key = {{low(seed_), high(seed_)}};
  const Philox::ctr_type words = Philox()(counter, key);
  const auto joined = [&](std::size_t i) {
    return words.v[i] | (static_cast<std::uint64_t>(words.v[i + 1]) << 32);
  };
  block_ = {joined(0), joined(2)};
  used_ = 0;
  ++blocks_;
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  // 1 - uniform() is in (0, 1], so the logarithm is finite.
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  const double angle = 2 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

}  // namespace minescan
