// SPDX-License-Identifier: MIT
// Times of one registration.
#pragma once

#include <ctime>

#include "core/parallel.h"

namespace minescan {

class Stopwatch {
 public:
  /// Wall time since construction or the last lap, in seconds.
  double lap() {
    const double now = seconds(CLOCK_MONOTONIC);
    const double elapsed = now - last_lap_;
    last_lap_ = now;
    return elapsed;
  }
  /// Processor time since construction, in seconds: of the calling thread where loops run on it
  /// alone (OneThread), else of the process.
  double cpu() const { return seconds(cpu_clock_) - cpu_start_; }

 private:
  static double seconds(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  double last_lap_ = seconds(CLOCK_MONOTONIC);
  clockid_t cpu_clock_ = on_one_thread() ? CLOCK_THREAD_CPUTIME_ID : CLOCK_PROCESS_CPUTIME_ID;
  double cpu_start_ = seconds(cpu_clock_);
};

}  // namespace minescan
