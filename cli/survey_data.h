// SPDX-License-Identifier: MIT
// The scans of a survey: built in memory, written as a folder, or read back from one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/scene_config.h"
#include "core/cloud.h"
#include "eval/trial.h"
#include "formats/data_set.h"
#include "formats/data_set_formats.h"

namespace minescan {

/// What came of a survey.
struct SurveyData {
  Survey survey = {};                     // with the stations of a drive
  std::vector<std::size_t> points = {};   // of each scan
  std::vector<std::uint64_t> beams = {};  // of each scan
  std::vector<PointCloud> clouds = {};    // of each scan; empty where they were not kept
  std::vector<Pose> odometry = {};        // believed T_world_scanner of each scan
  std::vector<DataSetPair> pairs = {};
  std::string scene_json = {};  // what the mine's mesh is like
};

/// Builds the mine and scans it. Shows progress. `on_scan` is called with each scan when it is
/// done; the clouds are kept if `keep_clouds` says so, else only as long as pairs need them.
///
/// A mine that is too large for memory as a whole is built around each station; the decision and
/// the points depend on the configuration alone.
SurveyData make_survey(const SurveyConfig& config, bool quiet, bool keep_clouds,
                       const std::function<void(std::size_t, const Scan&)>& on_scan = {});

/// The same, written as the folder of formats/data_set.h scan by scan; it appears when it is
/// complete. `replace` allows to replace the folder of another survey (and nothing else); a folder
/// that exists is refused otherwise, before any work. `formats` are written beside.
SurveyData write_survey(const std::filesystem::path& folder, const SurveyConfig& config, bool quiet,
                        bool keep_clouds, bool replace,
                        const std::vector<DataSetFormat>& formats = {});

/// The pairs of a survey for registration, with their points: called by the survey, with "/k"
/// behind where it has several. `data` has all clouds.
std::vector<ScanPair> scan_pairs(const SurveyConfig& config, const SurveyData& data);

/// The same for any survey: `text` is a survey's name, a YAML file, or a folder that
/// `minescan survey` wrote (which takes no `changes`; its pairs are called by the folder).
std::vector<ScanPair> load_pairs(const std::string& text, const Config& changes, std::uint64_t seed,
                                 bool quiet);

}  // namespace minescan
