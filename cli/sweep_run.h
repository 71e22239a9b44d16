// SPDX-License-Identifier: MIT
// A study with all its settings, and running it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.h"
#include "core/config.h"
#include "eval/study.h"
#include "eval/sweep.h"

namespace minescan {

/// A program of the user's that a study names.
struct Program {
  std::string file = {};
  Settings settings = {};  // ExternalMethod::settings
};

struct StudyConfig {
  std::string base = {};  // the row of studies() that it started from
  Study study = {};
  std::uint64_t seed = 1;
  std::vector<Method> methods = {};  // those that there are, and programs that the study names
  std::map<std::string, Program> programs = {};  // of those, by the method's name
};

/// `text` is a study's name or a YAML file with a key `study` (the row to start from).
StudyConfig load_study_config(const std::string& text, const Config& changes,
                              const std::optional<std::uint64_t>& seed);

/// The scans of a study, built or read.
std::vector<ScanPair> pairs_of(const StudyConfig& config, bool quiet);

/// Runs what has no row in the table `out` yet, and shows progress.
SweepCounts run_study(const StudyConfig& config, const std::vector<ScanPair>& pairs,
                      const std::string& out, SweepOptions options, const Common& common);

}  // namespace minescan
