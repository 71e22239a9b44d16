// SPDX-License-Identifier: MIT
#include "core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <vector>

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

void parallel_in_order(std::size_t count, const InOrder& make, const InOrder& take) {
  if (on_one_thread()) {
    for (std::size_t i = 0; i < count; ++i) {
      make(i, 0);
      take(i, 0);
    }
    return;
  }
  // The slot that was freed last is used first, while its memory is still in a cache.
  std::mutex mutex;
  std::vector<std::size_t> free_slots;
  for (std::size_t slot = parallel_slots(); slot-- > 0;) free_slots.push_back(slot);
  struct Item {
    std::size_t i = 0;
    std::size_t slot = 0;
  };
  std::size_t next = 0;
  const auto begin = [&](tbb::flow_control& control) -> Item {
    if (next == count) {
      control.stop();
      return {};
    }
    const std::lock_guard lock(mutex);
    const std::size_t slot = free_slots.back();
    free_slots.pop_back();
    return {next++, slot};
  };
  const auto make_it = [&](const Item& item) {
    make(item.i, item.slot);
    return item;
  };
  const auto take_it = [&](const Item& item) {
    take(item.i, item.slot);
    const std::lock_guard lock(mutex);
    free_slots.push_back(item.slot);
  };
  using tbb::filter_mode;
  tbb::parallel_pipeline(parallel_slots(),
                         tbb::make_filter<void, Item>(filter_mode::serial_in_order, begin) &
                             tbb::make_filter<Item, Item>(filter_mode::parallel, make_it) &
                             tbb::make_filter<Item, void>(filter_mode::serial_in_order, take_it));
}

// Several for each thread (four: assumed), so that a slow item does not keep the others waiting.
std::size_t parallel_slots() { return 4 * static_cast<std::size_t>(available_threads()); }

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
