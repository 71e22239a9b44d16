// SPDX-License-Identifier: MIT
// The findings of a validation as text, JSON and one page.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/validation.h"

namespace minescan {

/// One line per finding: verdict, name, what was measured and what is accepted.
std::string findings_text(const std::vector<Finding>& findings);

/// An object with "version", "seed", "passed", "failed", "reported" and the list "findings".
std::string findings_json(const std::vector<Finding>& findings, std::uint64_t seed);

/// A picture of the page: a file beside it.
struct PagePicture {
  std::string file = {};
  std::string caption = {};
};

/// One HTML page that works offline beside its pictures.
std::string findings_page(const std::vector<Finding>& findings,
                          const std::vector<PagePicture>& pictures, std::uint64_t seed);

}  // namespace minescan
