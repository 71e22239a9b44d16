// SPDX-License-Identifier: MIT
// Closed forms, and literals computed with R 4.2 or by hand where said so.
#include "eval/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "core/random.h"

namespace minescan {
namespace {

std::vector<double> one_to(int n) {
  std::vector<double> values(static_cast<std::size_t>(n));
  std::iota(values.begin(), values.end(), 1.0);
  return values;
}

TEST(Quantile, IsLinearBetweenOrderStatistics) {
  // Hyndman & Fan type 7: position p (n - 1), counted from 0. All values are exact in binary.
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0), 1);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0.25), 1.75);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 1), 4);
  EXPECT_EQ(quantile({7}, 0.3), 7);
}

TEST(Quantile, RefusesNothingNanAndBadProbabilities) {
  EXPECT_THROW(quantile({}, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile({1, std::nan("")}, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile({1}, 1.1), std::invalid_argument);
  EXPECT_THROW(quantile({1}, std::nan("")), std::invalid_argument);
}

TEST(Quantile, KeepsAnInfiniteValueOutOfItsNeighbours) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(quantile({1, 2, infinity}, 0.5), 2);
  EXPECT_EQ(quantile({1, 2, infinity}, 1), infinity);
}

TEST(BoxStatistics, HasMinimumAndMaximumAsWhiskers) {
  const BoxStatistics box = box_statistics(one_to(101));
  EXPECT_EQ(box.count, 101u);
  EXPECT_EQ(box.minimum, 1);
  EXPECT_EQ(box.lower_quartile, 26);
  EXPECT_EQ(box.median, 51);
  EXPECT_EQ(box.upper_quartile, 76);
  EXPECT_EQ(box.maximum, 101);
}

struct Ranks {
  std::size_t count;
  double p;
  std::size_t low, high;
  double confidence;  // to three digits
};

TEST(QuantileRanks, AreThoseOfTheBinomialDistribution) {
  const Ranks known[] = {{100, 0.5, 40, 61, 0.965},  {50, 0.5, 18, 33, 0.967},
                         {30, 0.5, 10, 21, 0.957},   {200, 0.5, 86, 115, 0.960},
                         {100, 0.25, 17, 34, 0.951}, {100, 0.75, 67, 84, 0.951},
                         {100, 0.95, 91, 100, 0.966}};
  for (const Ranks& k : known) {
    const RankInterval ranks = quantile_ranks(k.count, k.p);
    EXPECT_EQ(ranks.low, k.low) << k.count << " " << k.p;
    EXPECT_EQ(ranks.high, k.high) << k.count << " " << k.p;
    EXPECT_NEAR(ranks.confidence, k.confidence, 0.0005) << k.count << " " << k.p;  // half a digit
  }
}

TEST(QuantileRanks, SpanAllValuesWhereThereAreFew) {
  // 6 values: 1 - 2 / 2^6 = 0.969; 5 values: 0.9375, not enough but all there is.
  EXPECT_EQ(quantile_ranks(6, 0.5).low, 1u);
  EXPECT_EQ(quantile_ranks(6, 0.5).high, 6u);
  EXPECT_DOUBLE_EQ(quantile_ranks(6, 0.5).confidence, 1 - 2.0 / 64);
  EXPECT_EQ(quantile_ranks(5, 0.5).high, 5u);
  EXPECT_EQ(quantile_ranks(1, 0.5).high, 1u);
  EXPECT_THROW(quantile_ranks(0, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile_ranks(5, 1.0), std::invalid_argument);
}

TEST(BoxStatistics, MedianIntervalIsBetweenTheRanks) {
  const BoxStatistics box = box_statistics(one_to(100));
  EXPECT_EQ(box.median_interval.low, 40);
  EXPECT_EQ(box.median_interval.high, 61);
}

struct Rate {
  std::size_t successes, trials;
  double low, high;
};

TEST(ClopperPearson, GivesTheKnownIntervals) {
  // In per cent, one digit (two-digit entries: none).
  const Rate known[] = {{0, 100, 0, 3.6},
                        {2, 100, 0.2, 7.0},
                        {5, 100, 1.6, 11.3},
                        {40, 50, 66.3, 90.0},
                        {45, 50, 78.2, 96.7}};
  for (const Rate& k : known) {
    const Interval interval = clopper_pearson_interval(k.successes, k.trials);
    EXPECT_NEAR(100 * interval.low, k.low, 0.05) << k.successes;
    EXPECT_NEAR(100 * interval.high, k.high, 0.05) << k.successes;
  }
  // No failure in n: the bound solves (1 - p)^n = 0.025.
  EXPECT_NEAR(clopper_pearson_interval(0, 100).high, 1 - std::pow(0.025, 0.01), 1e-12);
}

TEST(Wilson, SolvesItsEquation) {
  // The bounds p satisfy (rate - p)^2 = z^2 p (1 - p) / n with z = 1.959964 (Wilson 1927).
  for (const auto& [k, n] : {std::pair<std::size_t, std::size_t>{96, 100}, {3, 7}, {50, 100}}) {
    const Interval interval = wilson_interval(k, n);
    const double rate = static_cast<double>(k) / static_cast<double>(n);
    for (const double p : {interval.low, interval.high})
      EXPECT_NEAR((rate - p) * (rate - p),
                  1.959963984540054 * 1.959963984540054 * p * (1 - p) / static_cast<double>(n),
                  1e-12);  // rounding
  }
  // 96 of 100 is the smallest count whose bound reaches 90 %.
  EXPECT_GE(wilson_interval(96, 100).low, 0.90);
  EXPECT_LT(wilson_interval(95, 100).low, 0.90);
}

TEST(Wilson, TouchesTheEndsExactly) {
  EXPECT_EQ(wilson_interval(0, 10).low, 0);
  EXPECT_EQ(wilson_interval(10, 10).high, 1);
  EXPECT_THROW(wilson_interval(1, 0), std::invalid_argument);
  EXPECT_THROW(wilson_interval(3, 2), std::invalid_argument);
  EXPECT_THROW(wilson_interval(1, 2, 1.0), std::invalid_argument);
}

TEST(FisherExact, GivesTheKnownValues) {
  EXPECT_NEAR(fisher_exact(40, 50, 45, 50), 0.26, 0.005);
  EXPECT_NEAR(fisher_exact(2, 100, 0, 100), 0.497, 0.0005);
  // Fisher's tea: 3 of 4 right has probability 16/70 of the same, 1/70 of better, both sides.
  EXPECT_NEAR(fisher_exact(3, 4, 1, 4), 34.0 / 70, 1e-12);
  EXPECT_NEAR(fisher_exact(0, 5, 0, 7), 1, 1e-12);
}

TEST(Holm, MultipliesByTheNumberOfTestsLeft) {
  // By hand: 0.01 * 3; 0.03 * 2; max(0.04 * 1, 0.06).
  const std::vector<double> adjusted = holm_adjusted({0.04, 0.01, 0.03});
  EXPECT_DOUBLE_EQ(adjusted[1], 0.03);
  EXPECT_DOUBLE_EQ(adjusted[2], 0.06);
  EXPECT_DOUBLE_EQ(adjusted[0], 0.06);
  EXPECT_TRUE(holm_adjusted({}).empty());
  EXPECT_EQ(holm_adjusted({0.9, 0.8})[0], 1);
}

// ln(0.99 / 0.01), ln(0.85 / 0.95) and ln(0.15 / 0.05), and what Wald's formula makes of them.
TEST(SequentialTest, HasTheConstantsOfWald) {
  const SequentialTest test(0.95, 0.85, 0.01);
  EXPECT_NEAR(test.bound(), 4.5951, 5e-5);
  EXPECT_NEAR(test.after_success(), -0.1112, 5e-5);
  EXPECT_NEAR(test.after_failure(), 1.0986, 5e-5);
  EXPECT_NEAR(test.expected_trials_if_good(), 89, 0.5);
  EXPECT_NEAR(test.expected_trials_if_bad(), 64, 0.5);
  const SequentialTest narrow(0.99, 0.93, 0.01);
  EXPECT_NEAR(narrow.expected_trials_if_good(), 106, 0.5);
  EXPECT_NEAR(narrow.expected_trials_if_bad(), 58, 0.5);
}

TEST(SequentialTest, AnswersOnceAndForAll) {
  SequentialTest test(0.95, 0.85, 0.01);
  for (int i = 0; i < 41; ++i) test.add(true);
  EXPECT_EQ(test.answer(), SequentialTest::Answer::undecided);
  test.add(true);  // 42 times 0.1112 is more than 4.595, 41 times is not
  EXPECT_EQ(test.answer(), SequentialTest::Answer::good);
  for (int i = 0; i < 100; ++i) test.add(false);
  EXPECT_EQ(test.answer(), SequentialTest::Answer::good);
  SequentialTest failing(0.95, 0.85, 0.01);
  for (int i = 0; i < 5; ++i) failing.add(false);  // 5 times 1.0986
  EXPECT_EQ(failing.answer(), SequentialTest::Answer::bad);
}

// 4000 tests at either rate: wrong answers a part of 0.0101 or less, within three standard
// deviations of such a count; trials as Wald says, but for what the sum goes beyond the bound, a
// failure's at most.
TEST(SequentialTest, IsAsOftenWrongAsItSays) {
  Random random(21, 0);
  for (const double rate : {0.95, 0.85}) {
    int wrong = 0, trials = 0;
    for (int i = 0; i < 4000; ++i) {
      SequentialTest test(0.95, 0.85, 0.01);
      for (; test.answer() == SequentialTest::Answer::undecided; ++trials)
        test.add(random.uniform() < rate);
      wrong += (test.answer() == SequentialTest::Answer::good) != (rate == 0.95);
    }
    EXPECT_LE(wrong, 40 + 3 * std::sqrt(40));
    const SequentialTest test(0.95, 0.85, 0.01);
    const double expected =
        rate == 0.95 ? test.expected_trials_if_good() : test.expected_trials_if_bad();
    EXPECT_NEAR(trials / 4000.0, expected, 1.0986 / 0.0507);
  }
}

TEST(SequentialTest, RefusesWhatItCannotDecide) {
  EXPECT_THROW(SequentialTest(0.8, 0.9, 0.01), std::invalid_argument);
  EXPECT_THROW(SequentialTest(1, 0.9, 0.01), std::invalid_argument);
  EXPECT_THROW(SequentialTest(0.9, 0, 0.01), std::invalid_argument);
  EXPECT_THROW(SequentialTest(0.9, 0.8, 0.5), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
