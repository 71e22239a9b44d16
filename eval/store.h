// SPDX-License-Identifier: MIT
// The result table: one SQLite file with a row per trial.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include "eval/trial.h"

namespace minescan {

/// What is known of one invocation that wrote rows; table `runs`.
struct RunInfo {
  std::string version = {};
  std::string command_line = {};
  std::string machine = {};  // processor, compiler
  int threads = 1;
  std::string started = {};   // UTC, ISO 8601
  std::string finished = {};  // empty if it was killed
};

/// A result file. Errors of the file are std::runtime_error naming it.
class ResultStore {
 public:
  /// Opens or creates it for writing; a file that is not a result table is refused untouched.
  static ResultStore create_or_resume(const std::filesystem::path& path);
  /// Opens an existing one for reading.
  static ResultStore open(const std::filesystem::path& path);
  ~ResultStore();
  ResultStore(ResultStore&&) noexcept;

  /// Adds a run; returns its number, which rows refer to.
  int begin_run(const RunInfo& run);
  void end_run(int run, const std::string& finished);

  /// Adds or replaces rows in one transaction.
  void write(const std::vector<Outcome>& outcomes, int run);

  /// Ids of the rows that are there; with `failed` false, without those that hold a message.
  std::unordered_set<std::string> ids(bool failed) const;

  /// All rows in the order of their ids, or of one study.
  std::vector<Outcome> read(const std::string& study = {}) const;
  std::vector<RunInfo> runs() const;

  /// The table `trials` with every column of the contract, as comma-separated values in the order of ids.
  std::string csv() const;

 private:
  struct Impl;  // keeps SQLiteCpp out of this header
  explicit ResultStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace minescan
