// SPDX-License-Identifier: MIT
// The result of a check for people and for continuous integration.
#pragma once

#include <string>

#include "eval/check.h"

namespace minescan {

/// For a terminal: the summary, then one line per question and limit, those that alarm first.
std::string check_text(const CheckResult& result);

/// All numbers of the result, one JSON object.
std::string check_json(const CheckResult& result);

/// For a comment on a change: the summary and tables.
std::string check_markdown(const CheckResult& result);

/// JUnit's XML: a test case per question and limit; regressions are failures, what cannot be told
/// are errors.
std::string check_junit(const CheckResult& result);

}  // namespace minescan
