// SPDX-License-Identifier: MIT
// A report on the disk.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace minescan {

/// Writes index.html for the result tables into `folder` (made if it is not there), and with `svg`
/// every figure beside it. Returns the path of the page.
std::filesystem::path write_report(const std::vector<std::string>& results,
                                   const std::filesystem::path& folder, bool svg);

}  // namespace minescan
