// SPDX-License-Identifier: MIT
// The result table: one SQLite file with a row per trial and study (two studies may share a
// registration; each has its own labels on it). It has no companion files once written
// (no write-ahead log), so it can be copied; a killed program leaves the rows of all finished
// `write` calls. Numbers are kept bit for bit.
#pragma once

#include <cstddef>
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

/// A result file. Errors of the file are std::runtime_error naming it. Not for several threads at
/// once; several processes may use one file.
class ResultStore {
 public:
  /// Opens or creates it for writing; a file that is not a result table is refused untouched. A
  /// table of version 1 gets the columns that it lacks (evaluations, empty_points and
  /// outside_points); its rows have no value there, which is read as 0.
  static ResultStore create_or_resume(const std::filesystem::path& path);
  /// Opens an existing one for reading, also of version 1.
  static ResultStore open(const std::filesystem::path& path);
  ~ResultStore();
  ResultStore(ResultStore&&) noexcept;
  ResultStore& operator=(ResultStore&&) noexcept;

  /// Adds a run; returns its number, which rows refer to.
  int begin_run(const RunInfo& run);
  void end_run(int run, const std::string& finished);

  /// Adds rows, or replaces those of the same trial and study, in one transaction.
  void write(const std::vector<Outcome>& outcomes, int run);

  /// Adds rows for those of `trials` whose registration is there, without a message, under another
  /// study, with the labels given now; returns how many.
  std::size_t relabel(const std::vector<Trial>& trials);

  /// Adds the runs and rows of another file. A row that is here stays, unless it holds a message
  /// and the other's does not.
  void merge(const std::filesystem::path& other);

  /// Ids of the rows that are there, or of one study; with `failed` false, without those that hold
  /// a message.
  std::unordered_set<std::string> ids(bool failed, const std::string& study = {}) const;

  /// All rows in the order of their ids, then studies; or those of one study.
  std::vector<Outcome> read(const std::string& study = {}) const;
  std::vector<RunInfo> runs() const;

  /// The table `trials` with all its columns as comma-separated values (RFC 4180, lines end with a
  /// line feed) in the order of ids; no value is an empty field.
  std::string csv() const;

 private:
  struct Impl;  // keeps SQLiteCpp out of this header
  explicit ResultStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace minescan
