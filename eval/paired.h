// SPDX-License-Identifier: MIT
// Two methods, or two versions of one, on the same start poses: statistics of paired results.
#pragma once

#include <cstddef>
#include <vector>

#include "eval/statistics.h"

namespace minescan {

/// One-sided and two-sided p-values of one test.
struct PValues {
  double greater = 1;  // small if the differences tend to be above zero
  double less = 1;     // small if they tend to be below
  double two_sided = 1;
};

/// Wilcoxon's signed-rank test that differences are symmetric about zero. Zero differences are
/// dropped, equal ones share their mean rank. Up to 200 differences the distribution is exact,
/// given the ties; beyond, it is normal with the variance of the ranks at hand and a continuity
/// correction. Throws std::invalid_argument for NaN.
PValues wilcoxon_signed_rank(const std::vector<double>& differences);

/// The smallest one-sided p-value that `count` differences can give: 2^-count.
double smallest_p_value(std::size_t count);

/// Median of the means of all pairs of `values` (each with itself too; Hodges & Lehmann 1963), and
/// its interval by inverting the signed-rank test (the whole range where there are too few values
/// for the confidence). For a ratio of errors: give logarithms, take exp of the result. No more
/// than O(n) memory. Throws std::invalid_argument if `values` is empty or holds a number that is
/// not finite.
struct HodgesLehmann {
  double estimate = 0;
  Interval interval = {};
};
HodgesLehmann hodges_lehmann(std::vector<double> values, double confidence = 0.95);

/// McNemar's exact test: `worse` trials went from success to failure and `better` the other way;
/// "greater" is small if there are too many of the first kind for chance.
PValues mcnemar(std::size_t worse, std::size_t better);

}  // namespace minescan
