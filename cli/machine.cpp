// SPDX-License-Identifier: MIT
#include "cli/machine.h"

#include <fmt/format.h>

#include <fstream>

#include "core/parallel.h"
#include "core/text.h"

namespace minescan {

std::string machine_text() {
  std::string processor = "unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    processor = trimmed(std::string_view(line).substr(line.find(':') + 1));
    break;
  }
#ifdef __clang__
  constexpr const char* compiler = "Clang " __clang_version__;
#else
  constexpr const char* compiler = "GCC " __VERSION__;
#endif
  return fmt::format("{}, {} cores, {}", processor, available_threads(), compiler);
}

}  // namespace minescan
