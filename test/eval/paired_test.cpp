// SPDX-License-Identifier: MIT
#include "eval/paired.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/random.h"

namespace minescan {
namespace {

// The definition: the share of all 2^n choices of signs with at least as large a sum of the ranks
// of the positive ones.
double wilcoxon_by_enumeration(const std::vector<double>& differences) {
  std::vector<double> nonzero;
  for (const double d : differences)
    if (d != 0) nonzero.push_back(d);
  const auto rank = [&](double d) {
    double below = 0, equal = 0;
    for (const double other : nonzero) {
      below += std::abs(other) < std::abs(d);
      equal += std::abs(other) == std::abs(d);
    }
    return below + (equal + 1) / 2;
  };
  double observed = 0;
  for (const double d : nonzero) observed += d > 0 ? rank(d) : 0;
  int at_least = 0;
  const std::uint64_t all = std::uint64_t{1} << nonzero.size();
  for (std::uint64_t signs = 0; signs < all; ++signs) {
    double sum = 0;
    for (std::size_t i = 0; i < nonzero.size(); ++i)
      if (signs >> i & 1) sum += rank(nonzero[i]);
    at_least += sum >= observed;
  }
  return at_least / static_cast<double>(all);
}

TEST(Wilcoxon, EqualsTheEnumerationOfAllSigns) {
  for (std::uint64_t stream = 0; stream < 40; ++stream) {
    Random random(11, stream);
    std::vector<double> differences;
    for (std::uint64_t i = 0; i < 3 + stream % 8; ++i) {
      // Every other list has ties and zeros.
      const double d = 3 * random.normal() + 1;
      differences.push_back(stream % 2 ? std::round(d) : d);
    }
    // Both are sums of multiples of 2^-10: exact.
    EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(differences).greater,
                     wilcoxon_by_enumeration(differences))
        << "stream " << stream;
  }
}

TEST(Wilcoxon, MirrorsWithTheSign) {
  std::vector<double> differences = {1, 2, -3, 4, 5, 6, 7.5};
  const PValues p = wilcoxon_signed_rank(differences);
  for (double& d : differences) d = -d;
  const PValues mirrored = wilcoxon_signed_rank(differences);
  EXPECT_EQ(p.greater, mirrored.less);
  EXPECT_EQ(p.less, mirrored.greater);
  EXPECT_EQ(p.two_sided, mirrored.two_sided);
}

TEST(Wilcoxon, SaysNothingWithoutDifferences) {
  EXPECT_EQ(wilcoxon_signed_rank({}).two_sided, 1);
  EXPECT_EQ(wilcoxon_signed_rank({0, 0, 0}).greater, 1);
  EXPECT_THROW(wilcoxon_signed_rank({1, std::nan("")}), std::invalid_argument);
}

TEST(Wilcoxon, AllOnOneSideHasTheSmallestPValue) {
  const std::vector<double> differences(12, 0.5);
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(differences).greater, smallest_p_value(12));
  EXPECT_DOUBLE_EQ(smallest_p_value(12), 1.0 / 4096);
}

// Beyond 200 differences the normal approximation takes over. The exact distribution is that of the
// sum of a random subset of 1 ... n.
TEST(Wilcoxon, NormalApproximationIsCloseToTheExactDistribution) {
  constexpr std::size_t n = 201;
  std::vector<double> probability(n * (n + 1) / 2 + 1, 0.0);
  probability[0] = 1;
  for (std::size_t rank = 1; rank <= n; ++rank)
    for (std::size_t k = probability.size(); k-- > 0;)
      probability[k] = (probability[k] + (k >= rank ? probability[k - rank] : 0)) / 2;

  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    Random random(12, stream);
    std::vector<double> differences;  // of magnitudes 1 ... n: their own ranks
    std::size_t positive = 0;
    for (std::size_t rank = 1; rank <= n; ++rank) {
      const bool up = random.uniform() < 0.5 + 0.01 * static_cast<double>(stream);
      differences.push_back(up ? static_cast<double>(rank) : -static_cast<double>(rank));
      if (up) positive += rank;
    }
    double exact = 0;
    for (std::size_t k = positive; k < probability.size(); ++k) exact += probability[k];
    // The next Edgeworth term is kurtosis / 24 * max |z^3 - 3 z| phi(z) = (3.6 / n) / 24 * 0.55.
    EXPECT_NEAR(wilcoxon_signed_rank(differences).greater, exact, 4.2e-4) << "stream " << stream;
  }
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  const std::size_t n = v.size();
  return n % 2 ? v[n / 2] : (v[n / 2 - 1] + v[n / 2]) / 2;
}

TEST(HodgesLehmann, IsTheMedianOfAllMeans) {
  for (std::uint64_t stream = 0; stream < 30; ++stream) {
    Random random(13, stream);
    std::vector<double> values, means;
    for (std::uint64_t i = 0; i <= stream; ++i) values.push_back(random.normal());
    if (stream % 3 == 0)
      for (double& v : values) v = std::round(v);  // ties
    for (std::size_t i = 0; i < values.size(); ++i)
      for (std::size_t j = i; j < values.size(); ++j) means.push_back((values[i] + values[j]) / 2);
    EXPECT_NEAR(hodges_lehmann(values).estimate, median(means), 1e-15);  // rounding of the mean
  }
}

TEST(HodgesLehmann, HasTheIntervalOfTheSignedRankTest) {
  // Tables of the signed-rank statistic (n = 10, two-sided 0.05): critical value 8, so the interval
  // is from the 9th smallest to the 9th largest of the 55 means.
  std::vector<double> values, means;
  Random random(14, 0);
  for (int i = 0; i < 10; ++i) values.push_back(random.normal());
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = i; j < values.size(); ++j) means.push_back((values[i] + values[j]) / 2);
  std::sort(means.begin(), means.end());
  const HodgesLehmann result = hodges_lehmann(values);
  EXPECT_NEAR(result.interval.low, means[8], 1e-15);
  EXPECT_NEAR(result.interval.high, means[means.size() - 9], 1e-15);
}

TEST(HodgesLehmann, IntervalHoldsTheTruthAsOftenAsItSays) {
  for (const int n : {15, 300}) {  // exact and normal
    int held = 0;
    const int repeats = 400;
    for (int r = 0; r < repeats; ++r) {
      Random random(15, static_cast<std::uint64_t>(1000 * n + r));
      std::vector<double> values;
      for (int i = 0; i < n; ++i) values.push_back(0.7 + random.normal());
      const Interval interval = hodges_lehmann(values).interval;
      held += interval.low <= 0.7 && 0.7 <= interval.high;
    }
    // 95 % of 400 is 380 with a sigma of 4.4; three sigmas.
    EXPECT_GE(held, 367) << n;
    EXPECT_LE(held, 394) << n;
  }
}

TEST(HodgesLehmann, SpansAllWhereThereAreFewValues) {
  const HodgesLehmann result = hodges_lehmann({3, 1, 2});
  EXPECT_EQ(result.estimate, 2);
  EXPECT_EQ(result.interval.low, 1);
  EXPECT_EQ(result.interval.high, 3);
  EXPECT_THROW(hodges_lehmann({}), std::invalid_argument);
  EXPECT_THROW(hodges_lehmann({1, INFINITY}), std::invalid_argument);
}

TEST(McNemar, IsASignTestOfTheDiscordantPairs) {
  EXPECT_DOUBLE_EQ(mcnemar(5, 0).two_sided, 0.0625);
  EXPECT_DOUBLE_EQ(mcnemar(5, 0).greater, 0.03125);
  EXPECT_DOUBLE_EQ(mcnemar(0, 5).greater, 1);
  // 8 : 2 discordant: (1 + 10 + 45) / 2^10 above, by the binomial coefficients.
  EXPECT_NEAR(mcnemar(8, 2).greater, 56.0 / 1024, 1e-15);
  EXPECT_EQ(mcnemar(0, 0).two_sided, 1);
  EXPECT_EQ(mcnemar(4, 4).two_sided, 1);
}

}  // namespace
}  // namespace minescan
