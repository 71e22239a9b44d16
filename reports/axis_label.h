// SPDX-License-Identifier: MIT
// Names of options and studies as people and file systems want them.
#pragma once

#include <string>
#include <string_view>

namespace minescan {

/// What stands beside an axis of a figure: "Initial translation error [m]" for
/// "initial-translation". Options of methods are spelt out with their unit: "cell-size" is
/// "Cell size [m]".
std::string axis_label(std::string_view axis);

/// `name` as a file name without folder: letters, digits and "._-" stay, anything else between
/// them becomes one '-'; it does not begin with a dot and is not empty.
std::string file_stem(std::string_view name);

}  // namespace minescan
