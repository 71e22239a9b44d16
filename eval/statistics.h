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

/// Decides whether a success rate is good or bad with as few trials as it takes: each adds to the
/// logarithm of how much likelier a bad rate is than a good one, until that leaves +-bound().
/// Probability of a wrong answer at either rate: at most error / (1 - error).
/// source: Wald 1945, sequential probability ratio test
class SequentialTest {
 public:
  enum class Answer { undecided, good, bad };

  /// Throws std::invalid_argument unless 0 < bad_rate < good_rate < 1 and 0 < error < 0.5.
  SequentialTest(double good_rate, double bad_rate, double error);

  /// Has no effect after the answer.
  void add(bool success);
  Answer answer() const;
  double bound() const { return bound_; }
  double after_success() const { return after_success_; }  // what a success adds, below 0
  double after_failure() const { return after_failure_; }  // what a failure adds, above 0
  /// Trials needed on average where the rate is the good or the bad one, by Wald's approximation
  /// that the sum ends at a bound and not beyond.
  double expected_trials_if_good() const { return expected_trials(good_rate_, -bound_); }
  double expected_trials_if_bad() const { return expected_trials(bad_rate_, bound_); }

 private:
  double expected_trials(double rate, double end) const {
    return (1 - 2 * error_) * end / (rate * after_success_ + (1 - rate) * after_failure_);
  }

  double good_rate_ = 0, bad_rate_ = 0, error_ = 0;
  double bound_ = 0, after_success_ = 0, after_failure_ = 0;
  double sum_ = 0;
};

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
