// SPDX-License-Identifier: MIT
// Results -> one page that works offline, and figures as files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "eval/store.h"

namespace minescan {

/// Rows of one or more result files and the runs that made them.
struct ReportInput {
  std::vector<Outcome> outcomes = {};
  std::vector<RunInfo> runs = {};
};

/// One self-contained page: box plots of every study, a table of the numbers under each, what was
/// run.
std::string report_page(const ReportInput& input);

/// A picture of one figure.
struct FigureFile {
  std::string name = {};  // "fig16-translation_error_m.svg"
  std::string svg = {};
};

/// Every figure of the page as SVG. Needs Node.js (`node`) on the PATH at run time; throws
/// std::runtime_error saying so when it is missing.
std::vector<FigureFile> report_figures(const ReportInput& input);

}  // namespace minescan
