// SPDX-License-Identifier: MIT
// Statistics of one list of numbers or counts. Nothing here knows what the numbers mean.
#pragma once

#include <cstddef>
#include <vector>

#include "core/interval.h"

namespace minescan {

/// Quantile of type 7 (Hyndman & Fan 1996): linear between order statistics, p in [0, 1].
/// Throws std::invalid_argument if `values` is empty or holds NaN.
double quantile(std::vector<double> values, double p);

/// Two order statistics (the smallest has rank 1) with a quantile between them.
struct RankInterval {
  std::size_t low = 1;
  std::size_t high = 1;
  double confidence = 0;  // that the quantile lies between them, for any continuous distribution
};

/// Ranks of an interval for quantile `p` of at least the given confidence, from the binomial
/// distribution of the number of values below it. For the median the narrowest symmetric one with
/// half the risk on either side, else the narrowest. With too few values for that confidence: 1
/// and `count`. Throws std::invalid_argument unless count >= 1, 0 < p < 1 and 0 < confidence < 1.
RankInterval quantile_ranks(std::size_t count, double p, double confidence = 0.95);

/// The five numbers of a box plot in the paper's convention: whiskers are minimum and maximum.
struct BoxStatistics {
  std::size_t count = 0;
  double minimum = 0, lower_quartile = 0, median = 0, upper_quartile = 0, maximum = 0;
  Interval median_interval = {};  // quantile_ranks: at least 95 % confidence where count >= 6
};
/// Throws as quantile.
BoxStatistics box_statistics(std::vector<double> values);

/// Wilson interval of a rate of `successes` among `trials` at the given confidence. Throws
/// std::invalid_argument unless successes <= trials, 1 <= trials and 0 < confidence < 1.
Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence = 0.95);

/// Exact interval of the same (Clopper & Pearson 1934); never too narrow, wider than Wilson's.
Interval clopper_pearson_interval(std::size_t successes, std::size_t trials,
                                  double confidence = 0.95);

/// Two-sided p-value of Fisher's exact test that two rates are equal: the probability of all tables
/// with the same margins that are no likelier than the one seen.
double fisher_exact(std::size_t successes_a, std::size_t trials_a, std::size_t successes_b,
                    std::size_t trials_b);

/// Probability of at most `successes` in `trials` at rate `p`.
double binomial_cdf(std::size_t successes, std::size_t trials, double p);

/// Probability that a standard normal variable is at most `z`, and the z of a probability in (0,
/// 1).
double normal_cdf(double z);
double normal_quantile(double probability);

/// p-values adjusted for being taken together (Holm 1979): all those <= alpha may be called
/// significant with a chance of at most alpha that any of them is a false alarm.
std::vector<double> holm_adjusted(const std::vector<double>& p_values);

}  // namespace minescan
