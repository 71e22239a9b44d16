// SPDX-License-Identifier: MIT
#include "cli/scene_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/data_set.h"
#include "sim/scanner.h"

namespace minescan {
namespace {

// A field of the configuration itself, beside those of scenes and scanners.
Field text_field(std::string name, std::string expected, std::string help, std::string value,
                 std::function<std::string(std::string_view)> canonical) {
  return {.name = std::move(name),
          .expected = std::move(expected),
          .help = std::move(help),
          .value = std::move(value),
          .canonical = std::move(canonical)};
}

struct Seed {
  std::uint64_t seed = 1;
};
template <class Visitor>
void fields(Seed& o, Visitor&& field) {
  field("seed", o.seed, not_negative, "", "names every random choice");
}

std::string same(std::string_view text) { return std::string(text); }

std::string canonical_pose(std::string_view text) { return pose_text(parse_pose(text)); }

std::string pairs_text(const std::vector<StationPair>& pairs) {
  std::vector<std::string> parts;
  for (const StationPair& pair : pairs)
    parts.push_back(fmt::format("{}-{}", pair.target, pair.source));
  return join(parts, ", ");
}

std::vector<StationPair> parse_pair_list(std::string_view text) {
  std::vector<StationPair> pairs;
  for (const std::string& part : split(text, ',')) {
    const std::vector<std::string> ends = split(part, '-');
    if (ends.size() != 2)
      throw std::invalid_argument(fmt::format("expected target-source, found '{}'", part));
    pairs.push_back({static_cast<std::size_t>(read_number(ends[0], between(0, 1e6), true)),
                     static_cast<std::size_t>(read_number(ends[1], between(0, 1e6), true))});
  }
  return pairs;
}

std::string canonical_pairs(std::string_view text) { return pairs_text(parse_pair_list(text)); }

// `list` with the defaults replaced by `settings`: what a row of a table says of its own.
std::vector<Field> with_defaults(std::vector<Field> list, const Settings& settings) {
  for (Field& field : list) {
    const auto found = settings.find(field.name);
    if (found != settings.end()) field.value = field.canonical(found->second);
  }
  return list;
}

// The settings of a part, on top of those that its row brings.
Settings merged(Settings base, const Settings& changes) {
  for (const auto& [name, text] : changes) base[name] = text;
  return base;
}

void append(std::vector<Field>& list, std::vector<Field> more) {
  list.insert(list.end(), more.begin(), more.end());
}

// The keys of `config` that begin with `prefix`, without it: the parts of a scene that they name
// decide which fields it has.
Settings given(const Config& config, const std::string& prefix) {
  Settings keys;
  for (const ConfigEntry& entry : config)
    if (entry.key.starts_with(prefix)) keys[entry.key.substr(prefix.size())] = entry.text;
  return keys;
}

bool is_mesh_file(const std::string& text) {
  return text.ends_with(".ply") || text.ends_with(".obj") || text.ends_with(".stl");
}

// A row of the table of scenes, or a file of triangles: then the row that reads it, and the setting
// that names it.
struct NamedScene {
  std::string name = {};
  Settings settings = {};
};
NamedScene named_scene(const std::string& text) {
  if (is_mesh_file(text)) return {"mesh", {{"parts.file.file", text}}};
  return {find_scene(text).name, {}};
}

std::string station_prefix(std::size_t k) { return fmt::format("stations.{}.", k); }

// Every key of a survey's configuration with the values of `survey` as defaults; `more` names
// further parts of its scene.
std::vector<Field> survey_fields(const Survey& survey, std::uint64_t seed,
                                 const Settings& more = {}) {
  std::vector<Field> list;
  list.push_back(text_field("survey", "a name in `minescan list surveys`",
                            "the survey to start from", survey.name, same));
  append(list, fields_of(Seed{seed}));
  append(list, fields_of(survey));
  list.push_back(text_field("pairs", "target-source, ...",
                            "which scans are registered, by the numbers of their stations",
                            pairs_text(survey.pairs), canonical_pairs));
  list.push_back(
      text_field("scene.name", "a name in `minescan list scenes`", "the mine", survey.scene, same));
  append(list, prefixed("scene.",
                        with_defaults(
                            find_scene(survey.scene).fields(merged(survey.scene_settings, more)),
                            survey.scene_settings)));
  const auto scanner_fields = [&](const std::string& prefix, const std::string& scanner,
                                  const Settings& settings) {
    list.push_back(text_field(prefix + "scanner", "a name in `minescan list scanners`",
                              "what stands there", scanner, same));
    append(list, prefixed(prefix, with_defaults(fields_of(find_scanner(scanner)), settings)));
  };
  if (survey.drive) {
    append(list, prefixed("drive.", fields_of(*survey.drive)));
    append(list, prefixed("vehicle.", fields_of(survey.drive->vehicle)));
    scanner_fields("drive.", survey.drive->scanner, survey.drive->settings);
  }
  for (std::size_t k = 0; k < survey.stations.size(); ++k) {
    const Station& station = survey.stations[k];
    const std::string prefix = station_prefix(k);
    list.push_back(text_field(prefix + "pose", "tx,ty,tz,qx,qy,qz,qw",
                              "T_world_scanner, metres and a unit quaternion",
                              pose_text(station.T_world_scanner), canonical_pose));
    scanner_fields(prefix, station.scanner, station.settings);
  }
  return list;
}

// What `key` says in `config`, which it stays in; empty if nothing.
std::string said(const Config& config, const std::string& key) {
  Config copy = config;
  return take(copy, key, "");
}

// A trajectory in a file of lines "time tx ty tz qx qy qz qw".
Trajectory read_trajectory(const std::string& file) {
  const auto [times, poses] = parse_tum(read_file(file), file);
  Trajectory trajectory{.times = times, .poses = poses};
  try {
    check(trajectory);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(file + ": " + error.what());
  }
  return trajectory;
}

// The scanner that `config` names under `prefix`, in place of another and its settings: a row of
// the table, or a YAML file with a row to start from (its key `scanner`) and what differs from it.
void take_scanner(const Config& config, const std::string& prefix, std::string& scanner,
                  Settings& settings) {
  const std::string wanted = said(config, prefix + "scanner");
  if (wanted.empty() || wanted == scanner) return;
  Config file = is_config_file(wanted) ? read_config(wanted) : Config{};
  const std::string row = is_config_file(wanted) ? take(file, "scanner", "") : wanted;
  if (row.empty())
    throw std::invalid_argument(wanted +
                                ": expected a key 'scanner' that names the one to start from");
  scanner = find_scanner(row).name;
  settings = resolve(file, fields_of(find_scanner(scanner)));
}

// Of `settings`, those that are in `list`.
Settings known_to(const std::vector<Field>& list, const Settings& settings) {
  Settings known;
  for (const auto& [name, text] : settings)
    if (find_field(list, name)) known[name] = text;
  return known;
}
template <class Options>
Options with_known_settings(const Options& options, const Settings& settings) {
  return with_settings(options, known_to(fields_of(options), settings));
}

// Station numbers in keys are 0, 1, ... without a gap; more than the survey has add stations, which
// must name their scanner and pose.
void add_stations(Survey& survey, const Config& config) {
  for (std::size_t k = survey.stations.size(); !said(config, station_prefix(k) + "scanner").empty();
       ++k) {
    Station& added = survey.stations.emplace_back();
    take_scanner(config, station_prefix(k), added.scanner, added.settings);
  }
}

// Without pairs, each scan of a drive is registered to the one before.
void complete_pairs(Survey& survey) {
  if (survey.drive && survey.pairs.empty())
    for (int k = 1; k < survey.drive->scans; ++k)
      survey.pairs.push_back(
          {.target = static_cast<std::size_t>(k - 1), .source = static_cast<std::size_t>(k)});
}

void check_pairs(const Survey& survey) {
  const std::size_t scans =
      survey.drive ? static_cast<std::size_t>(survey.drive->scans) : survey.stations.size();
  if (survey.pairs.empty()) throw std::invalid_argument("pairs: expected at least one pair");
  for (const StationPair& pair : survey.pairs)
    if (std::max(pair.target, pair.source) >= scans || pair.target == pair.source)
      throw std::invalid_argument(
          fmt::format("pairs: '{}-{}': expected two of the stations 0 to {}", pair.target,
                      pair.source, scans - 1));
}

}  // namespace

bool is_config_file(const std::string& text) {
  return text.ends_with(".yaml") || text.ends_with(".yml");
}

Config set_entries(const Common& common) {
  Config config;
  for (const std::string& assignment : common.set)
    config.push_back(parse_assignment(assignment, "--set"));
  return config;
}

Config gather_config(const std::string& text, const Config& changes) {
  Config config = is_config_file(text) ? read_config(text) : Config{};
  config.insert(config.end(), changes.begin(), changes.end());
  return config;
}

std::uint64_t take_seed(Config& config, const std::optional<std::uint64_t>& wanted) {
  const std::vector<Field> known = fields_of(Seed{});
  Config seeds;
  for (const ConfigEntry& entry : config)
    if (entry.key == "seed") seeds.push_back(entry);
  const Settings settings = resolve(seeds, known);
  std::erase_if(config, [](const ConfigEntry& e) { return e.key == "seed"; });
  return wanted.value_or(with_settings(Seed{}, settings).seed);
}

SceneConfig load_scene_config(const std::string& text, const Config& changes,
                              const std::optional<std::uint64_t>& seed) {
  Config config = gather_config(text, changes);
  SceneConfig scene;
  scene.seed = take_seed(config, seed);
  const std::string wanted = is_config_file(text) ? take(config, "scene", "") : text;
  if (wanted.empty())
    throw std::invalid_argument(text + ": expected a key 'scene' that names the kind of mine");
  const NamedScene named = named_scene(wanted);
  scene.name = named.name;
  const Settings keys = merged(named.settings, given(config, ""));
  scene.settings = merged(named.settings, resolve(config, find_scene(scene.name).fields(keys)));
  return scene;
}

std::string scene_config_yaml(const SceneConfig& scene) {
  std::vector<Field> list;
  list.push_back(text_field("scene", "a name in `minescan list scenes`", "the kind of mine",
                            scene.name, same));
  list.push_back(fields_of(Seed{scene.seed}).front());
  append(list, find_scene(scene.name).fields(scene.settings));
  return config_yaml(list, scene.settings);
}

SurveyConfig load_survey_config(const std::string& text, const Config& changes,
                                const std::optional<std::uint64_t>& seed) {
  Config config = gather_config(text, changes);
  SurveyConfig result;
  result.seed = take_seed(config, seed);
  const std::string base = is_config_file(text) ? take(config, "survey", "") : text;
  if (base.empty())
    throw std::invalid_argument(text +
                                ": expected a key 'survey' that names the one to start from");
  Survey& survey = result.survey;
  survey = find_survey(base);

  // Which fields there are depends on the names of the scene and the scanners, so these come first;
  // a part of another kind does not inherit the settings of the one it replaces.
  if (const std::string scene = said(config, "scene.name");
      !scene.empty() && scene != survey.scene) {
    const NamedScene named = named_scene(scene);
    survey.scene = named.name;
    survey.scene_settings = named.settings;
  }
  if (survey.drive) take_scanner(config, "drive.", survey.drive->scanner, survey.drive->settings);
  for (std::size_t k = 0; k < survey.stations.size(); ++k)
    take_scanner(config, station_prefix(k), survey.stations[k].scanner,
                 survey.stations[k].settings);
  add_stations(survey, config);

  const Settings settings =
      resolve(config, survey_fields(survey, result.seed, given(config, "scene.")));
  const auto value = [&](const std::string& name, const std::string& fallback) {
    const auto found = settings.find(name);
    return found == settings.end() ? fallback : found->second;
  };
  survey = with_known_settings(survey, settings);
  survey.pairs = parse_pair_list(value("pairs", pairs_text(survey.pairs)));

  Settings scene = without_prefix("scene.", settings);
  scene.erase("name");
  survey.scene_settings = merged(survey.scene_settings, scene);
  if (survey.drive) {
    Drive& drive = *survey.drive;
    const Settings own = without_prefix("drive.", settings);
    drive = with_known_settings(drive, own);
    if (!drive.path_file.empty()) drive.path = read_trajectory(drive.path_file);
    drive.vehicle = with_settings(drive.vehicle, without_prefix("vehicle.", settings));
    drive.settings = merged(drive.settings, known_to(fields_of(find_scanner(drive.scanner)), own));
  }
  for (std::size_t k = 0; k < survey.stations.size(); ++k) {
    Station& station = survey.stations[k];
    Settings own = without_prefix(station_prefix(k), settings);
    own.erase("scanner");
    if (const auto pose = own.find("pose"); pose != own.end()) {
      station.T_world_scanner = parse_pose(pose->second);
      own.erase(pose);
    }
    station.settings = merged(station.settings, own);
  }
  complete_pairs(survey);
  check_pairs(survey);
  return result;
}

std::string survey_config_yaml(const SurveyConfig& config) {
  return config_yaml(survey_fields(config.survey, config.seed), {});
}

std::string survey_identity(const SurveyConfig& config) {
  const std::vector<Field> usual = survey_fields(find_survey(config.survey.name), 1);
  std::string text = config.survey.name;
  if (config.survey.drive && !config.survey.drive->path_file.empty())
    text += " path " + text_hash(read_file(config.survey.drive->path_file));
  for (const Field& field : survey_fields(config.survey, config.seed)) {
    const Field* row = find_field(usual, field.name);
    if (!row || row->value != field.value) text += fmt::format(" {}={}", field.name, field.value);
  }
  return text;
}

}  // namespace minescan
