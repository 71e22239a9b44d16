// SPDX-License-Identifier: MIT
#include "eval/paired.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <stdexcept>

namespace minescan {
namespace {

// Above this the normal distribution is within 0.0005 of the exact one (its next Edgeworth term is
// 0.083 / n) and errs to the safe side in the tails; the exact one costs n^3.
constexpr std::size_t exact_limit = 200;

// Ranks times two, so that mean ranks of ties are whole numbers.
struct SignedRanks {
  std::vector<std::size_t> doubled = {};  // of all non-zero differences
  std::size_t positive = 0;               // sum over the positive ones
  std::size_t negative = 0;
};

SignedRanks signed_ranks(std::vector<double> differences) {
  std::erase(differences, 0.0);
  std::sort(differences.begin(), differences.end(),
            [](double a, double b) { return std::abs(a) < std::abs(b); });
  SignedRanks ranks;
  const std::size_t n = differences.size();
  for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
    while (end < n && std::abs(differences[end]) == std::abs(differences[begin])) ++end;
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t doubled = begin + 1 + end;  // mean of begin + 1 ... end, twice
      ranks.doubled.push_back(doubled);
      (differences[i] > 0 ? ranks.positive : ranks.negative) += doubled;
    }
  }
  return ranks;
}

// Probability that the sum of randomly chosen `ranks` is at most k, for each k.
std::vector<double> rank_sum_cdf(const std::vector<std::size_t>& ranks) {
  std::vector<double> probability(std::accumulate(ranks.begin(), ranks.end(), std::size_t{1}), 0.0);
  probability[0] = 1;
  std::size_t total = 0;
  for (const std::size_t rank : ranks) {
    total += rank;
    for (std::size_t k = total + 1; k-- > 0;)
      probability[k] = (probability[k] + (k >= rank ? probability[k - rank] : 0)) / 2;
  }
  for (std::size_t k = 1; k <= total; ++k) probability[k] += probability[k - 1];
  return probability;
}

// Mean and standard deviation of the same, a sum of independent terms {0, rank}; ties are thereby
// accounted for.
struct Normal {
  double mean = 0;
  double sigma = 0;
};
Normal rank_sum_normal(const std::vector<std::size_t>& ranks) {
  double sum = 0, squares = 0;
  for (const std::size_t rank : ranks) {
    const double r = static_cast<double>(rank);
    sum += r;
    squares += r * r;
  }
  return {sum / 2, std::sqrt(squares) / 2};
}

PValues both_sides(double greater, double less) {
  return {greater, less, std::min(1.0, 2 * std::min(greater, less))};
}

// How many of the pairs i <= j have a mean of at most `limit`; `sorted` ascends.
std::uint64_t walsh_averages_up_to(const std::vector<double>& sorted, double limit) {
  std::uint64_t count = 0;
  std::size_t end = sorted.size();
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    // (a + b) / 2 <= limit, in the form that cannot overflow
    while (end > 0 && sorted[i] / 2 + sorted[end - 1] / 2 > limit) --end;
    if (end <= i) break;
    count += end - i;
  }
  return count;
}

// The mean of rank `rank` (the smallest has 1), by bisection down to neighbouring doubles.
double walsh_average(const std::vector<double>& sorted, std::uint64_t rank) {
  double low = sorted.front(), high = sorted.back();
  if (walsh_averages_up_to(sorted, low) >= rank) return low;
  for (;;) {
    const double middle = low / 2 + high / 2;
    if (!(middle > low && middle < high)) return high;
    (walsh_averages_up_to(sorted, middle) >= rank ? high : low) = middle;
  }
}

// Largest k so that a rank sum below k has a probability of at most `risk`, without ties; 0 if
// none.
std::uint64_t interval_rank(std::size_t n, double risk) {
  std::vector<std::size_t> ranks(n);
  std::iota(ranks.begin(), ranks.end(), std::size_t{1});
  if (n > exact_limit) {
    const Normal normal = rank_sum_normal(ranks);
    const double k = normal.mean + normal_quantile(risk) * normal.sigma;
    return k > 0 ? static_cast<std::uint64_t>(k) : 0;
  }
  const std::vector<double> cdf = rank_sum_cdf(ranks);
  std::uint64_t k = 0;
  while (cdf[k] <= risk) ++k;
  return k;
}

}  // namespace

PValues wilcoxon_signed_rank(const std::vector<double>& differences) {
  if (std::any_of(differences.begin(), differences.end(), [](double d) { return std::isnan(d); }))
    throw std::invalid_argument("signed-rank test: a difference is not a number");
  const SignedRanks ranks = signed_ranks(differences);
  if (ranks.doubled.empty()) return {};
  if (ranks.doubled.size() <= exact_limit) {
    // The distribution is symmetric: as many positive ranks or more is as few negative or fewer.
    const std::vector<double> cdf = rank_sum_cdf(ranks.doubled);
    return both_sides(cdf[ranks.negative], cdf[ranks.positive]);
  }
  const Normal normal = rank_sum_normal(ranks.doubled);
  const auto at_most = [&](std::size_t sum) {  // sums step by 2 where there are no ties
    return normal_cdf((static_cast<double>(sum) + 1 - normal.mean) / normal.sigma);
  };
  return both_sides(at_most(ranks.negative), at_most(ranks.positive));
}

double smallest_p_value(std::size_t count) { return std::exp2(-static_cast<double>(count)); }

HodgesLehmann hodges_lehmann(std::vector<double> values, double confidence) {
  if (values.empty()) throw std::invalid_argument("Hodges-Lehmann: expected at least one value");
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }))
    throw std::invalid_argument("Hodges-Lehmann: a value is not finite");
  std::sort(values.begin(), values.end());
  const std::uint64_t n = values.size(), pairs = n * (n + 1) / 2;
  const double middle = walsh_average(values, (pairs + 1) / 2);
  const double next = pairs % 2 == 1 ? middle : walsh_average(values, pairs / 2 + 1);
  const std::uint64_t k = interval_rank(values.size(), (1 - confidence) / 2);
  if (k == 0) return {middle / 2 + next / 2, {values.front(), values.back()}};
  return {middle / 2 + next / 2, {walsh_average(values, k), walsh_average(values, pairs + 1 - k)}};
}

PValues mcnemar(std::size_t worse, std::size_t better) {
  const std::size_t both = worse + better;
  if (both == 0) return {};
  return both_sides(binomial_cdf(better, both, 0.5), binomial_cdf(worse, both, 0.5));
}

}  // namespace minescan
