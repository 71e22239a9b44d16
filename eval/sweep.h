// SPDX-License-Identifier: MIT
// A list of trials -> rows of a result table, in parallel, resumed where it was stopped.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "eval/store.h"
#include "eval/trial.h"

namespace minescan {

/// Which of the trials are run, and what is noted about the run.
struct SweepOptions {
  int shard = 1;              // this part, 1 ... shards: trials shard - 1, shard - 1 + shards, ...
  int shards = 1;             // of so many; several machines share a sweep this way
  bool retry_failed = false;  // run those again whose row holds a message
  RunInfo run = {};           // the times are filled in
};

/// How far a sweep is. trials = done_before + finished + those to come.
struct SweepCounts {
  std::size_t trials = 0;       // of this shard
  std::size_t done_before = 0;  // were there, or were copied from another study of the same table
  std::size_t finished = 0;     // were run now
  std::size_t threw = 0;        // of those, the rows that hold a message
};

/// The trials of the shard that have no row yet (with retry_failed also those whose row holds a
/// message), in their order. Throws std::invalid_argument for a shard out of range.
std::vector<Trial> remaining_trials(const std::vector<Trial>& trials, const ResultStore& store,
                                    const SweepOptions& options);

/// Runs the remaining trials, each on one thread, and writes their rows about once a second, so
/// that a killed program loses no more than that. Rows are the same for any number of threads,
/// shards and resumes, but for measured times. A trial that is there under another study is copied
/// with this study's labels.
///
/// pairs     those that the trials name
/// methods   where the trials' methods are looked up; methods() and perhaps others
/// methods   where the trials' methods are looked up: methods(), or others as well
/// progress  called after every trial, never from two threads at once. What it throws ends the
/// sweep
///           after the rows that are finished have been written, and is thrown here
/// throws    std::invalid_argument if a trial's pair or method is missing, before anything is run;
///           std::runtime_error if the table cannot be written
SweepCounts run_sweep(const std::vector<Trial>& trials, const std::vector<ScanPair>& pairs,
                      const std::vector<Method>& methods, ResultStore& store,
                      const SweepOptions& options = {},
                      const std::function<void(const SweepCounts&)>& progress = {});

/// The present time in UTC, ISO 8601: "2026-01-31T12:00:00Z".
std::string utc_now();

}  // namespace minescan
