// SPDX-License-Identifier: MIT
// What a run is labelled with, so that numbers can be judged later.
#pragma once

#include <string>

namespace minescan {

/// "AMD EPYC 9654, 2 cores, GCC 12.2.0"
std::string machine_text();

}  // namespace minescan
