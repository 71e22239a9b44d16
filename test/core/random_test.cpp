// SPDX-License-Identifier: MIT
#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace minescan {
namespace {

// The first block is a known answer of Philox4x32-10 published with Random123 (counter 0, key 0);
// the second was computed by ten rounds written in Python 3.11 from the paper's definition.
TEST(Random, GivesThePublishedPhiloxNumbers) {
  Random zero(0, 0);
  EXPECT_EQ(zero.bits(), 0xe169c58d6627e8d5);
  EXPECT_EQ(zero.bits(), 0x9b00dbd8bc57ac4c);
  Random other(0x299f31d0a4093822, 0x0370734413198a2e);
  other.bits();
  other.bits();
  EXPECT_EQ(other.bits(), 0xab83527314ddb4b);
  EXPECT_EQ(other.bits(), 0x3fc8cf4c9fc3cabe);
}

TEST(Random, IsUniformAndNormal) {
  Random random(1, 7);
  constexpr int n = 200'000;
  double sum = 0, normal_sum = 0, normal_squares = 0, normal_fourth = 0;
  for (int i = 0; i < n; ++i) {
    sum += random.uniform();
    const double x = random.normal();
    normal_sum += x;
    normal_squares += x * x;
    normal_fourth += x * x * x * x;
  }
  // Four standard errors each: sqrt(1/12/n), sqrt(1/n), sqrt(2/n), sqrt(96/n).
  EXPECT_NEAR(sum / n, 0.5, 4 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(normal_sum / n, 0, 4 * std::sqrt(1.0 / n));
  EXPECT_NEAR(normal_squares / n, 1, 4 * std::sqrt(2.0 / n));
  EXPECT_NEAR(normal_fourth / n, 3, 4 * std::sqrt(96.0 / n));
}

TEST(Random, StreamsSeedsAndPurposesDiffer) {
  std::set<std::uint64_t> first;
  for (std::uint64_t stream = 0; stream < 1000; ++stream) first.insert(Random(1, stream).bits());
  for (std::uint64_t seed = 2; seed < 1000; ++seed) first.insert(Random(seed, 0).bits());
  first.insert(derived_seed(1, "noise"));
  first.insert(derived_seed(1, "relief"));
  first.insert(derived_seed(2, "noise"));
  EXPECT_EQ(first.size(), 1000 + 998 + 3);
}

TEST(Random, BelowCoversItsRangeEvenly) {
  Random random(4, 0);
  int count[3] = {};
  for (int i = 0; i < 30'000; ++i) ++count[random.below(3)];
  // Four standard errors of a binomial of 30 000 draws with rate 1/3.
  for (const int c : count) EXPECT_NEAR(c, 10'000, 4 * std::sqrt(30'000 * 2.0 / 9));
}

}  // namespace
}  // namespace minescan
