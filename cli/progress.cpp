// SPDX-License-Identifier: MIT
#include "cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace minescan {

Progress::Progress(std::string label, std::size_t total, bool quiet)
    : label_(std::move(label)), total_(total), shown_(!quiet && isatty(STDERR_FILENO) == 1) {
  update(0);
}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\n");
}

void Progress::update(std::size_t done) {
  const Clock::time_point now = Clock::now();
  if (!shown_ || (done < total_ && done > 0 && now - drawn_ < std::chrono::milliseconds(100)))
    return;
  drawn_ = now;
  constexpr std::size_t width = 30;
  const double part =
      total_ == 0 ? 1 : static_cast<double>(std::min(done, total_)) / static_cast<double>(total_);
  const std::size_t filled = static_cast<std::size_t>(part * width);
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const std::string left = part > 0 && part < 1
                               ? fmt::format("{:.0f} s left", elapsed * (1 - part) / part)
                               : fmt::format("{:.1f} s", elapsed);
  // \033[K clears what a longer line left behind.
  fmt::print(stderr, "\r{:<24} [{:#<{}}{:.<{}}] {}/{}  {}\033[K", label_, "", filled, "",
             width - filled, done, total_, left);
  std::fflush(stderr);
}

}  // namespace minescan
