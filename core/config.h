// SPDX-License-Identifier: MIT
// Configurations: keys and values from YAML files and --set, checked against the fields that are
// known. In YAML, keys nest ("scene: {edge-length: 0.05}"); here they are joined by dots
// ("scene.edge-length"). A list is the same as its values with commas between.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/fields.h"

namespace minescan {

/// One value and the place where the user wrote it, for messages.
struct ConfigEntry {
  std::string key = {};
  std::string text = {};
  std::string where = {};  // "mine.yaml:12" or "--set"
};
using Config = std::vector<ConfigEntry>;

/// Reads a YAML file. Throws std::runtime_error if it cannot be read, std::invalid_argument with
/// file and line if it is not a mapping of keys to numbers, texts, lists or mappings.
Config read_config(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages.
Config parse_config(const std::string& yaml, const std::string& name);

/// "key=value" as given to `option` ("--set"). Throws std::invalid_argument without a '='.
ConfigEntry parse_assignment(std::string_view text, const std::string& option);

/// The text of `key` if it is there (its last entry), which is then removed from `config`; else
/// `fallback`.
std::string take(Config& config, std::string_view key, const std::string& fallback);

/// Checks every entry against `known` and returns the values in canonical text, those that differ
/// from the field's default only; later entries win. Throws std::invalid_argument with the place:
/// "mine.yaml:12: cell-size = '-1': expected a number > 0 (m), found '-1'", or the known keys.
Settings resolve(const Config& config, const std::vector<Field>& known);

/// YAML that read_config understands: every field with its value (from `settings`, or its default),
/// nested at the dots, each with unit, limits and meaning as a comment.
std::string config_yaml(const std::vector<Field>& known, const Settings& settings);

}  // namespace minescan
