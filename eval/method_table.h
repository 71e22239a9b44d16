// SPDX-License-Identifier: MIT
// Results as a table for people, one row per pair, method and point of the study.
#pragma once

#include <string>
#include <vector>

#include "eval/trial.h"

namespace minescan {

/// Markdown: good results of how many with the 95 % Wilson interval, medians of the errors of all
/// and of the processor time, and memory of the target. Results with another start error, axis
/// value or setting have a row of their own; rows by pair and method, then as `outcomes` first name
/// them.
std::string method_table(const std::vector<Outcome>& outcomes);

}  // namespace minescan
