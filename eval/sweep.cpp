// SPDX-License-Identifier: MIT
#include "eval/sweep.h"

#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <map>
#include <mutex>
#include <stdexcept>
#include <unordered_set>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"

namespace minescan {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<Trial> shard_of(const std::vector<Trial>& trials, const SweepOptions& options) {
  if (options.shards < 1 || options.shard < 1 || options.shard > options.shards)
    throw std::invalid_argument(
        fmt::format("shard {}/{}: expected i/n with 1 <= i <= n", options.shard, options.shards));
  std::vector<Trial> part;
  for (std::size_t i = static_cast<std::size_t>(options.shard) - 1; i < trials.size();
       i += static_cast<std::size_t>(options.shards))
    part.push_back(trials[i]);
  return part;
}

// Finished rows on their way to the table. Rows are handed in by any thread and written by
// whichever finds that a second has passed.
class RowWriter {
 public:
  RowWriter(ResultStore& store, int run, SweepCounts& counts,
            const std::function<void(const SweepCounts&)>& progress)
      : store_(store), run_(run), counts_(counts), progress_(progress) {}

  void add(Outcome outcome) {
    const std::lock_guard lock(mutex_);
    ++counts_.finished;
    if (!outcome.message.empty()) ++counts_.threw;
    waiting_.push_back(std::move(outcome));
    if (Clock::now() - written_ >= std::chrono::seconds(1)) write();
    if (progress_) progress_(counts_);
  }

  void finish() {
    const std::lock_guard lock(mutex_);
    write();
  }

 private:
  void write() {
    store_.write(waiting_, run_);
    waiting_.clear();
    written_ = Clock::now();
  }

  ResultStore& store_;
  const int run_;
  SweepCounts& counts_;
  const std::function<void(const SweepCounts&)>& progress_;
  std::mutex mutex_;
  std::vector<Outcome> waiting_;
  Clock::time_point written_ = Clock::now();
};

// A trial with what it needs.
struct Job {
  const Trial* trial = nullptr;
  const ScanPair* pair = nullptr;
  const Method* method = nullptr;
};

std::vector<Job> jobs_of(const std::vector<Trial>& trials, const std::vector<ScanPair>& pairs,
                         const std::vector<Method>& methods) {
  std::map<std::pair<std::string, std::string>, const ScanPair*> pair_by_name;
  for (const ScanPair& pair : pairs) pair_by_name[{pair.name, pair.origin}] = &pair;
  std::map<std::string, const Method*> method_by_name;
  std::vector<std::string> known;
  for (const Method& method : methods) {
    method_by_name[method.name] = &method;
    known.push_back(method.name);
  }
  std::vector<Job> jobs;
  for (const Trial& trial : trials) {
    const auto pair = pair_by_name.find({trial.pair, trial.origin});
    if (pair == pair_by_name.end())
      throw std::invalid_argument(
          fmt::format("no scans are given for pair '{}' of {}", trial.pair, trial.origin));
    const auto method = method_by_name.find(trial.method);
    if (method == method_by_name.end())
      throw std::invalid_argument(unknown_name("method", trial.method, known));
    jobs.push_back({&trial, pair->second, method->second});
  }
  return jobs;
}

}  // namespace

std::vector<Trial> remaining_trials(const std::vector<Trial>& trials, const ResultStore& store,
                                    const SweepOptions& options) {
  std::map<std::string, std::unordered_set<std::string>> done;  // by study
  std::vector<Trial> remaining;
  for (const Trial& trial : shard_of(trials, options)) {
    auto [ids, is_new] = done.try_emplace(trial.study);
    if (is_new) ids->second = store.ids(!options.retry_failed, trial.study);
    if (!ids->second.contains(trial_id(trial))) remaining.push_back(trial);
  }
  return remaining;
}

SweepCounts run_sweep(const std::vector<Trial>& trials, const std::vector<ScanPair>& pairs,
                      const std::vector<Method>& methods, ResultStore& store,
                      const SweepOptions& options,
                      const std::function<void(const SweepCounts&)>& progress) {
  std::vector<Trial> remaining = remaining_trials(trials, store, options);
  if (store.relabel(remaining) > 0) remaining = remaining_trials(trials, store, options);
  SweepCounts counts;
  counts.trials = shard_of(trials, options).size();
  counts.done_before = counts.trials - remaining.size();
  const std::vector<Job> jobs = jobs_of(remaining, pairs, methods);
  if (jobs.empty()) return counts;

  RunInfo run = options.run;
  run.started = utc_now();
  const int number = store.begin_run(run);
  RowWriter rows(store, number, counts, progress);
  try {
    parallel_for(jobs.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        rows.add(run_trial(*jobs[i].trial, *jobs[i].pair, *jobs[i].method));
    });
  } catch (...) {
    rows.finish();  // what is done is not lost; the run stays without an end
    throw;
  }
  rows.finish();
  store.end_run(number, utc_now());
  return counts;
}

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc = {};
  gmtime_r(&now, &utc);
  char text[32];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return {text, length};
}

}  // namespace minescan
