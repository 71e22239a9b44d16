// SPDX-License-Identifier: MIT
// A line on standard error that tells how far a long job is. Silent where that is not a terminal.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace minescan {

class Progress {
 public:
  /// `total` steps of a job called `label`.
  Progress(std::string label, std::size_t total, bool quiet);
  ~Progress();  // ends the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` of the steps are finished; redraws at most ten times a second.
  void update(std::size_t done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  std::size_t total_;
  bool shown_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point drawn_ = {};
};

}  // namespace minescan
