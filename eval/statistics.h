// SPDX-License-Identifier: MIT
// Statistics of registration results (REFERENCES are given per function). Nothing here knows what
// the numbers mean.
#pragma once

#include <cstddef>
#include <vector>

namespace minescan {

struct Interval {
  double low = 0;
  double high = 0;
};

/// Quantile of type 7 (Hyndman & Fan 1996): linear between order statistics, p in [0, 1].
/// Throws std::invalid_argument if `values` is empty or holds NaN.
double quantile(std::vector<double> values, double p);

/// The five numbers of a box plot in the paper's convention: whiskers are minimum and maximum.
struct BoxStatistics {
  std::size_t count = 0;
  double minimum = 0, lower_quartile = 0, median = 0, upper_quartile = 0, maximum = 0;
  Interval median_interval = {};  // order statistics, at least 95 % confidence where count >= 6
};
BoxStatistics box_statistics(std::vector<double> values);

/// Wilson interval of a rate of `successes` among `trials` at the given confidence.
Interval wilson_interval(std::size_t successes, std::size_t trials, double confidence = 0.95);

}  // namespace minescan
