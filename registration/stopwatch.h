// SPDX-License-Identifier: MIT
// Times of one registration, taken on the thread that runs it.
#pragma once

#include <ctime>

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
  /// Processor time of the calling thread since construction, in seconds.
  double cpu() const { return seconds(CLOCK_THREAD_CPUTIME_ID) - cpu_start_; }

 private:
  static double seconds(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  double last_lap_ = seconds(CLOCK_MONOTONIC);
  double cpu_start_ = seconds(CLOCK_THREAD_CPUTIME_ID);
};

}  // namespace minescan
