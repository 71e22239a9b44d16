// SPDX-License-Identifier: MIT
// From what the user named (a row of a table or a YAML file, and --set) to a complete
// configuration.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.h"
#include "core/config.h"
#include "scenes/scene.h"
#include "sim/survey.h"

namespace minescan {

/// Whether `text` is meant as a configuration file: it ends in .yaml or .yml.
bool is_config_file(const std::string& text);

/// The entries of --set.
Config set_entries(const Common& common);

/// The entries of the file `text` names, or none if it names a row of a table, and behind them
/// `changes`.
Config gather_config(const std::string& text, const Config& changes);

/// The `seed` that is wanted (--seed), else the configuration's, else 1; the key is removed from
/// `config`.
std::uint64_t take_seed(Config& config, const std::optional<std::uint64_t>& wanted);

/// A scene with its settings.
struct SceneConfig {
  std::string name = {};
  Settings settings = {};
  std::uint64_t seed = 1;
};
SceneConfig load_scene_config(const std::string& text, const Config& changes,
                              const std::optional<std::uint64_t>& seed);
std::string scene_config_yaml(const SceneConfig& scene);

/// A survey with all its settings; the scene is built from the same seed.
struct SurveyConfig {
  Survey survey = {};
  std::uint64_t seed = 1;
};
/// Keys: survey (the row to start from), seed, pairs, odometry-*, scene.name, scene.<its fields>,
/// stations.<k>.scanner, stations.<k>.pose, stations.<k>.<fields of the scanner>.
SurveyConfig load_survey_config(const std::string& text, const Config& changes,
                                const std::optional<std::uint64_t>& seed);
std::string survey_config_yaml(const SurveyConfig& config);

/// What decides the survey's points: its name and every value that differs from its row with
/// seed 1. New options leave the identity of old configurations as it was.
std::string survey_identity(const SurveyConfig& config);

}  // namespace minescan
