// SPDX-License-Identifier: MIT
// Names of options and studies as people and file systems want them.
#pragma once

#include <string>
#include <string_view>

namespace minescan {

/// What stands beside an axis of a figure: "Initial translation error [m]" for
/// "initial-translation". A name that is not known is spelt out: "my-option" is "My option".
std::string axis_label(std::string_view axis);

/// `name` as a file name without folder: letters, digits and "._-" stay, anything else becomes '-';
/// it does not begin with a dot.
std::string file_stem(std::string_view name);

}  // namespace minescan
