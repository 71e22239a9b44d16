// SPDX-License-Identifier: MIT
// Results kept to compare with, as a text file for the repository: one line per trial.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "eval/trial.h"

namespace minescan {

struct Baseline {
  std::string version = {};            // of the program that made the results
  std::string reason = {};             // why these are the results to hold others to
  std::vector<Outcome> outcomes = {};  // trial, pose, status, iterations, errors and message only
};

/// Writes results in the order of their trials' ids; a trial that is there under two studies is
/// written once. The same results give the same bytes. Throws std::invalid_argument without a
/// reason or without results, std::runtime_error if the file cannot be written.
void write_baseline(const std::filesystem::path& path, const std::vector<Outcome>& outcomes,
                    const std::string& reason, const std::string& version);

/// Reads it. Throws std::runtime_error, naming the file and, for a bad trial, its number, if it
/// cannot be read or is not a baseline, or if a trial's id does not fit the rest (the file was
/// edited).
Baseline read_baseline(const std::filesystem::path& path);

}  // namespace minescan
