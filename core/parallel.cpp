// SPDX-License-Identifier: MIT
#include "core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <stdexcept>

namespace minescan {
namespace {
thread_local int one_thread_scopes = 0;
}

void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
  if (grain == 0) throw std::invalid_argument("parallel_for: expected a grain of at least 1");
  const std::size_t blocks = (count + grain - 1) / grain;
  const auto run = [&](std::size_t block) {
    body(block * grain, std::min(count, (block + 1) * grain));
  };
  if (on_one_thread()) {
    for (std::size_t block = 0; block < blocks; ++block) run(block);
    return;
  }
  tbb::parallel_for(std::size_t{0}, blocks, run);
}

// Made in place: a copy of the control would not limit anything, and TBB lets one be made.
struct ThreadLimit::Impl {
  explicit Impl(std::size_t threads)
      : control(tbb::global_control::max_allowed_parallelism, threads) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads) {
  if (threads < 1) throw std::invalid_argument("expected at least 1 thread");
  impl_ = std::make_unique<Impl>(static_cast<std::size_t>(threads));
}
ThreadLimit::~ThreadLimit() = default;

OneThread::OneThread() { ++one_thread_scopes; }
OneThread::~OneThread() { --one_thread_scopes; }
bool on_one_thread() { return one_thread_scopes > 0; }

int available_threads() { return tbb::info::default_concurrency(); }

}  // namespace minescan
