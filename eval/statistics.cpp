// SPDX-License-Identifier: MIT
#include "eval/statistics.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/hypergeometric.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace minescan {
namespace {

void check_values(const std::vector<double>& values) {
  if (values.empty()) throw std::invalid_argument("statistics: expected at least one value");
  if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }))
    throw std::invalid_argument("statistics: a value is not a number");
}

void check_fraction(double p, const char* what) {
  if (!(p > 0 && p < 1))
    throw std::invalid_argument(std::string(what) + ": expected a number between 0 and 1, found " +
                                std::to_string(p));
}

void check_counts(std::size_t successes, std::size_t trials) {
  if (trials == 0 || successes > trials)
    throw std::invalid_argument("rate of " + std::to_string(successes) + " in " +
                                std::to_string(trials) + ": expected at least one trial and no " +
                                "more successes than trials");
}

double sorted_quantile(const std::vector<double>& sorted, double p) {
  const double position = p * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const double fraction = position - static_cast<double>(below);
  if (fraction == 0) return sorted[below];  // also keeps an infinite neighbour out
  return sorted[below] + fraction * (sorted[below + 1] - sorted[below]);
}

}  // namespace

double quantile(std::vector<double> values, double p) {
  check_values(values);
  if (!(p >= 0 && p <= 1))
    throw std::invalid_argument("quantile: expected a number in [0, 1], found " +
                                std::to_string(p));
  std::sort(values.begin(), values.end());
  return sorted_quantile(values, p);
}

RankInterval quantile_ranks(std::size_t count, double p, double confidence) {
  if (count == 0) throw std::invalid_argument("quantile ranks: expected at least one value");
  check_fraction(p, "quantile");
  check_fraction(confidence, "confidence");
  // below[k]: probability that at most k of the values are below the quantile.
  std::vector<double> below(count + 1);
  for (std::size_t k = 0; k <= count; ++k) below[k] = binomial_cdf(k, count, p);
  // The quantile is between ranks l and h if at least l and fewer than h values are below it.
  const auto coverage = [&](std::size_t l, std::size_t h) { return below[h - 1] - below[l - 1]; };

  RankInterval best{.low = 1, .high = count, .confidence = coverage(1, count)};
  const auto consider = [&](std::size_t l, std::size_t h) {
    const double c = coverage(l, h);
    const std::size_t width = h - l, best_width = best.high - best.low;
    if (c >= confidence && (width < best_width || (width == best_width && c > best.confidence)))
      best = {.low = l, .high = h, .confidence = c};
  };
  if (p == 0.5) {
    for (std::size_t l = 2; l < count + 1 - l; ++l) consider(l, count + 1 - l);
    return best;
  }
  for (std::size_t l = 1, h = 1; l <= count; ++l) {
    h = std::max(h, l);
    while (h < count && coverage(l, h) < confidence) ++h;
    consider(l, h);
  }
  return best;
}

BoxStatistics box_statistics(std::vector<double> values) {
  check_values(values);
  std::sort(values.begin(), values.end());
  const RankInterval ranks = quantile_ranks(values.size(), 0.5);
  return {.count = values.size(),
          .minimum = values.front(),
          .lower_quartile = sorted_quantile(values, 0.25),
          .median = sorted_quantile(values, 0.5),
          .upper_quartile = sorted_quantile(values, 0.75),
          .maximum = values.back(),
          .median_interval = {values[ranks.low - 1], values[ranks.high - 1]}};
}

Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence) {
  check_counts(successes, trials);
  check_fraction(confidence, "confidence");
  const double n = static_cast<double>(trials);
  const double rate = static_cast<double>(successes) / n;
  const double z = normal_quantile((1 + confidence) / 2);
  const double middle = (rate + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(rate * (1 - rate) / n + z * z / (4 * n * n));
  // Exactly 0 and 1 at the ends; rounding would leave 1e-17 and 1 - 1e-16.
  return {successes == 0 ? 0 : std::max(0.0, middle - half),
          successes == trials ? 1 : std::min(1.0, middle + half)};
}

Interval clopper_pearson_interval(std::size_t successes, std::size_t trials, double confidence) {
  check_counts(successes, trials);
  check_fraction(confidence, "confidence");
  using Binomial = boost::math::binomial_distribution<>;
  const double n = static_cast<double>(trials), k = static_cast<double>(successes);
  const double risk = (1 - confidence) / 2;
  return {Binomial::find_lower_bound_on_p(n, k, risk), Binomial::find_upper_bound_on_p(n, k, risk)};
}

double fisher_exact(std::size_t successes_a, std::size_t trials_a, std::size_t successes_b,
                    std::size_t trials_b) {
  check_counts(successes_a, trials_a);
  check_counts(successes_b, trials_b);
  const std::size_t successes = successes_a + successes_b, trials = trials_a + trials_b;
  const boost::math::hypergeometric_distribution<> in_a(static_cast<unsigned>(successes),
                                                        static_cast<unsigned>(trials_a),
                                                        static_cast<unsigned>(trials));
  const auto probability = [&](std::size_t k) {
    return boost::math::pdf(in_a, static_cast<unsigned>(k));
  };
  // Tables that are equally likely by symmetry differ by rounding.
  const double limit = probability(successes_a) * (1 + 1e-9);
  double sum = 0;
  const std::size_t first = successes > trials_b ? successes - trials_b : 0;
  for (std::size_t k = first; k <= std::min(successes, trials_a); ++k)
    if (probability(k) <= limit) sum += probability(k);
  return std::min(1.0, sum);
}

SequentialTest::SequentialTest(double good_rate, double bad_rate, double error)
    : good_rate_(good_rate), bad_rate_(bad_rate), error_(error) {
  check_fraction(good_rate, "good rate");
  check_fraction(bad_rate, "bad rate");
  if (!(bad_rate < good_rate && error > 0 && error < 0.5))
    throw std::invalid_argument(
        "sequential test: expected a bad rate below the good one, and an error between 0 and 0.5");
  bound_ = std::log((1 - error) / error);
  after_success_ = std::log(bad_rate / good_rate);
  after_failure_ = std::log((1 - bad_rate) / (1 - good_rate));
}

void SequentialTest::add(bool success) {
  if (answer() == Answer::undecided) sum_ += success ? after_success_ : after_failure_;
}

SequentialTest::Answer SequentialTest::answer() const {
  if (sum_ >= bound_) return Answer::bad;
  return sum_ <= -bound_ ? Answer::good : Answer::undecided;
}

double binomial_cdf(std::size_t successes, std::size_t trials, double p) {
  if (successes >= trials) return 1;
  return boost::math::cdf(boost::math::binomial_distribution<>(static_cast<double>(trials), p),
                          static_cast<double>(successes));
}

double normal_cdf(double z) { return boost::math::cdf(boost::math::normal_distribution<>(), z); }

double normal_quantile(double probability) {
  check_fraction(probability, "probability");
  return boost::math::quantile(boost::math::normal_distribution<>(), probability);
}

std::vector<double> holm_adjusted(const std::vector<double>& p_values) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<double> adjusted(p_values.size());
  double largest = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double scaled = static_cast<double>(order.size() - i) * p_values[order[i]];
    largest = std::max(largest, std::min(1.0, scaled));
    adjusted[order[i]] = largest;
  }
  return adjusted;
}

}  // namespace minescan
