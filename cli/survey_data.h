// SPDX-License-Identifier: MIT
// The scans of a survey: built in memory, written as a folder, or read back from one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/scene_config.h"
#include "eval/trial.h"
#include "formats/data_set.h"

namespace minescan {

/// What came of a survey.
struct SurveyData {
  std::vector<Scan> scans = {};
  std::vector<Pose> odometry = {};  // believed T_world_scanner of each scan
  std::vector<DataSetPair> pairs = {};
};

/// Builds the mine and scans it. Shows progress.
SurveyData make_survey(const SurveyConfig& config, bool quiet);

/// Writes the folder of formats/data_set.h. `replace` allows to replace the folder of another
/// survey (and nothing else); a folder that exists is refused otherwise.
void write_survey(const std::filesystem::path& folder, const SurveyConfig& config,
                  const SurveyData& data, bool replace);

/// The pairs of a survey for registration, with their points: called by the survey, with "/k"
/// behind where it has several.
std::vector<ScanPair> scan_pairs(const SurveyConfig& config, const SurveyData& data);

/// The same for any survey: `text` is a survey's name, a YAML file, or a folder that
/// `minescan survey` wrote (which takes no `changes`; its pairs are called by the folder).
std::vector<ScanPair> load_pairs(const std::string& text, const Config& changes, std::uint64_t seed,
                                 bool quiet);

}  // namespace minescan
