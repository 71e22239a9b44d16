// SPDX-License-Identifier: MIT
#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace minescan {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnceInTheSameBlocks) {
  for (const int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    std::vector<int> visits(1003, 0);
    std::vector<std::size_t> begin_of(1003, 0);
    parallel_for(visits.size(), 10, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        ++visits[i];
        begin_of[i] = begin;
      }
    });
    for (std::size_t i = 0; i < visits.size(); ++i) {
      EXPECT_EQ(visits[i], 1);
      EXPECT_EQ(begin_of[i], i / 10 * 10);
    }
  }
}

TEST(ParallelFor, PassesOnWhatABodyThrows) {
  EXPECT_THROW(parallel_for(100, 1,
                            [](std::size_t i, std::size_t) {
                              if (i == 50) throw std::runtime_error("fifty");
                            }),
               std::runtime_error);
  EXPECT_THROW(parallel_for(1, 0, [](std::size_t, std::size_t) {}), std::invalid_argument);
  EXPECT_THROW(ThreadLimit(0), std::invalid_argument);
  parallel_for(0, 1, [](std::size_t, std::size_t) { FAIL() << "there is no index"; });
}

TEST(ParallelInOrder, TakesInOrderWhatWasMadeInAnyOrder) {
  for (const int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    std::vector<std::size_t> slots(parallel_slots());
    std::vector<std::size_t> taken;
    parallel_in_order(
        1003,
        [&](std::size_t i, std::size_t slot) {
          // The first ones of a round are the last to be made.
          if (i % 7 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
          slots.at(slot) = i;
        },
        [&](std::size_t i, std::size_t slot) {
          EXPECT_EQ(slots.at(slot), i);
          taken.push_back(i);
        });
    ASSERT_EQ(taken.size(), 1003u);
    for (std::size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(taken[i], i);
  }
  const OneThread one;
  std::vector<std::size_t> calls;
  parallel_in_order(
      2, [&](std::size_t i, std::size_t) { calls.push_back(10 * i); },
      [&](std::size_t i, std::size_t) { calls.push_back(10 * i + 1); });
  EXPECT_EQ(calls, (std::vector<std::size_t>{0, 1, 10, 11}));
}

TEST(ParallelInOrder, PassesOnWhatIsThrown) {
  const auto nothing = [](std::size_t, std::size_t) {};
  const auto fifty = [](std::size_t i, std::size_t) {
    if (i == 50) throw std::runtime_error("fifty");
  };
  EXPECT_THROW(parallel_in_order(100, fifty, nothing), std::runtime_error);
  EXPECT_THROW(parallel_in_order(100, nothing, fifty), std::runtime_error);
  parallel_in_order(
      0, [](std::size_t, std::size_t) { FAIL() << "there is no item"; }, nothing);
}

TEST(ThreadLimit, OfOneRunsOnTheCallingThread) {
  const ThreadLimit limit(1);
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<int> elsewhere = 0;
  parallel_for(1000, 1, [&](std::size_t, std::size_t) {
    if (std::this_thread::get_id() != caller) ++elsewhere;
  });
  EXPECT_EQ(elsewhere, 0);
}

TEST(OneThread, RunsLoopsOnTheThreadThatItLivesOn) {
  const auto threads_of_a_loop = [] {
    std::vector<std::thread::id> ids(64);
    parallel_for(ids.size(), 1,
                 [&](std::size_t begin, std::size_t) { ids[begin] = std::this_thread::get_id(); });
    return std::set<std::thread::id>(ids.begin(), ids.end());
  };
  EXPECT_FALSE(on_one_thread());
  {
    const OneThread outer;
    { const OneThread inner; }
    EXPECT_TRUE(on_one_thread());
    EXPECT_EQ(threads_of_a_loop(), std::set{std::this_thread::get_id()});
    // It is this thread's affair alone.
    bool elsewhere = true;
    std::thread([&] { elsewhere = on_one_thread(); }).join();
    EXPECT_FALSE(elsewhere);
  }
  EXPECT_FALSE(on_one_thread());
}

}  // namespace
}  // namespace minescan
