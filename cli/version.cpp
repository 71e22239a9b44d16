// SPDX-License-Identifier: MIT
#include "cli/command.h"

namespace minescan {

std::string_view version() { return MINESCAN_VERSION; }

}  // namespace minescan
