// SPDX-License-Identifier: MIT
// Loops over several cores. A body of parallel_for writes to its own slots of arrays sized
// beforehand, and sums are taken in index order afterwards, so results do not depend on the number
// of threads.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace minescan {

/// Calls body(begin, end) for consecutive blocks of `grain` indices (the last may be shorter) that
/// cover 0 ... count - 1, each block once, in any order and from several threads. The blocks do not
/// depend on the number of threads. An exception of a body ends the loop and is thrown here.
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body);

/// A step of parallel_in_order for item i. `slot` says which of parallel_slots() buffers is the
/// item's own from its first step to the end of its second.
using InOrder = std::function<void(std::size_t i, std::size_t slot)>;
std::size_t parallel_slots();

/// Work in two steps, the second in order: calls make(i, slot) for i = 0 ... count - 1 from several
/// threads and, each after its make, take(i, slot) one after the other, i = 0 first. An exception
/// of either ends the work and is thrown here.
void parallel_in_order(std::size_t count, const InOrder& make, const InOrder& take);

/// While it lives, loops use at most `threads` threads (>= 1).
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Impl;  // keeps TBB out of this header
  std::unique_ptr<Impl> impl_;
};

/// While it lives, the loops that its thread begins run on that thread alone.
class OneThread {
 public:
  OneThread();
  ~OneThread();
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;
};
/// Whether one lives on this thread.
bool on_one_thread();

/// The cores that this process may use.
int available_threads();

}  // namespace minescan
