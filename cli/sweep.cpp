// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "cli/machine.h"
#include "cli/progress.h"
#include "cli/survey_data.h"
#include "cli/sweep_run.h"
#include "core/parallel.h"
#include "core/table.h"
#include "core/text.h"
#include "eval/external_method.h"
#include "registration/methods.h"

namespace minescan {
namespace {

struct State {
  std::string study, out, shard, trials;
  std::vector<std::string> axes;
  bool retry_failed = false, dry_run = false, print_config = false;
};

// --axis name=v1,v2,... and --trials N are keys of the configuration too.
Config changes_of(const State& state, const Common& common) {
  Config changes = set_entries(common);
  for (const std::string& text : state.axes) {
    ConfigEntry axis = parse_assignment(text, "--axis");
    axis.key = "axes." + axis.key;
    changes.push_back(axis);
  }
  if (!state.trials.empty()) changes.push_back({"trials", state.trials, "--trials"});
  return changes;
}

SweepOptions options_of(const State& state) {
  SweepOptions options{.retry_failed = state.retry_failed};
  if (state.shard.empty()) return options;
  const std::vector<std::string> parts = split(state.shard, '/');
  if (parts.size() != 2)
    throw std::invalid_argument("--shard: expected i/n, found '" + state.shard + "'");
  options.shards = static_cast<int>(read_number(parts[1], between(1, 1e6), true));
  options.shard = static_cast<int>(read_number(parts[0], between(1, options.shards), true));
  return options;
}

// The table is made when the scans are there; what is wrong with its place is said before.
void check_output(const std::filesystem::path& out) {
  if (std::filesystem::exists(out)) {
    ResultStore::open(out);
    return;
  }
  const std::filesystem::path folder = std::filesystem::absolute(out).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(
        fmt::format("{}: the folder {} does not exist", out.string(), folder.string()));
}

// How many trials, and how long: one trial of each method and axis value is run to know.
void print_plan(const StudyConfig& config, const SweepOptions& options, bool quiet) {
  const std::vector<ScanPair> pairs = pairs_of(config, quiet);
  const std::vector<Trial> all = trials(config.study, pairs, config.methods, config.seed);
  std::size_t count = 0;
  for (std::size_t i = static_cast<std::size_t>(options.shard) - 1; i < all.size();
       i += static_cast<std::size_t>(options.shards))
    ++count;
  std::size_t probes = 0;
  const auto start = std::chrono::steady_clock::now();
  for (const Trial& trial : all) {
    if (trial.start != 0) continue;
    const auto pair = std::find_if(pairs.begin(), pairs.end(),
                                   [&](const ScanPair& p) { return p.name == trial.pair; });
    run_trial(trial, *pair, find_row(config.methods, "method", trial.method));
    ++probes;
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fmt::print(
      "{} trials, about {:.0f} s on {} threads\n", count,
      seconds / static_cast<double>(probes) * static_cast<double>(count) / available_threads(),
      available_threads());
}

// Programs that the study names as files become methods, and it names those.
void take_programs(Config& config, StudyConfig& result) {
  const auto last = std::find_if(config.rbegin(), config.rend(),
                                 [](const ConfigEntry& entry) { return entry.key == "methods"; });
  if (last == config.rend()) return;
  const std::string where = last->where;
  std::vector<std::string> names = split(last->text, ',');
  Config settings;
  for (std::string& name : names) {
    if (!is_external_method(name)) continue;
    const ExternalMethod external = external_method(name);
    if (!result.programs.try_emplace(external.method.name, Program{name, external.settings}).second)
      throw std::invalid_argument(
          fmt::format("{}: {}: there is a method '{}' already", where, name, external.method.name));
    result.methods.push_back(external.method);
    for (const auto& [key, text] : external.settings)
      settings.push_back({"settings." + external.method.name + "." + key, text, where});
    name = external.method.name;
  }
  last->text = join(names, ",");
  // First, so that what the user sets comes after.
  config.insert(config.begin(), settings.begin(), settings.end());
}

// The study as the user may give it back: programs by their files.
Study as_given(const StudyConfig& config) {
  Study study = config.study;
  for (std::string& name : study.methods) {
    const auto program = config.programs.find(name);
    if (program == config.programs.end()) continue;
    for (const auto& [key, text] : program->second.settings) {
      const auto setting = study.settings.find(name + "." + key);
      if (setting != study.settings.end() && setting->second == text) study.settings.erase(setting);
    }
    name = program->second.file;
  }
  return study;
}

// "NAME" or "NAME:12", of several in a list.
std::vector<ScanPair> pairs_of_one(std::string name, const Config& changes, std::uint64_t seed,
                                   bool quiet) {
  std::optional<std::size_t> only;
  const std::size_t colon = name.rfind(':');
  if (colon != std::string::npos && !std::filesystem::exists(name)) {
    read_named("survey", name, [&] {
      only = static_cast<std::size_t>(read_number(name.substr(colon + 1), between(0, 1e6), true));
    });
    name.erase(colon);
  }
  std::vector<ScanPair> found = load_pairs(name, changes, seed, quiet);
  if (!only) return found;
  if (*only >= found.size())
    throw std::invalid_argument(
        fmt::format("survey '{}:{}': it has {} pairs, the first is 0", name, *only, found.size()));
  return {std::move(found[*only])};
}

}  // namespace

StudyConfig load_study_config(const std::string& text, const Config& changes,
                              const std::optional<std::uint64_t>& seed) {
  Config config = gather_config(text, changes);
  StudyConfig result;
  result.seed = take_seed(config, seed);
  result.base = is_config_file(text) ? take(config, "study", "") : text;
  if (result.base.empty())
    throw std::invalid_argument(text + ": expected a key 'study' that names the one to start from");
  result.methods = methods();
  take_programs(config, result);
  result.study = with_config(find_study(result.base), config, result.methods);
  return result;
}

std::vector<ScanPair> pairs_of(const StudyConfig& config, bool quiet) {
  Config survey_changes;
  for (const auto& [key, text] : config.study.survey_settings)
    survey_changes.push_back({key, text, "survey-settings"});
  // A folder may have a comma in its name.
  const std::string& survey = config.study.survey;
  std::vector<std::string> names = {survey};
  if (!std::filesystem::exists(survey)) names = split(survey, ',');
  std::vector<ScanPair> pairs;
  for (std::string name : names) {
    name.erase(0, name.find_first_not_of(' '));
    name.erase(name.find_last_not_of(' ') + 1);
    for (ScanPair& pair : pairs_of_one(name, survey_changes, config.seed, quiet))
      pairs.push_back(std::move(pair));
  }
  return pairs;
}

SweepCounts run_study(const StudyConfig& config, const std::vector<ScanPair>& pairs,
                      const std::string& out, SweepOptions options, const Common& common) {
  options.run.version = version();
  options.run.command_line = common.command_line;
  options.run.machine = machine_text();
  options.run.threads = common.threads > 0 ? common.threads : available_threads();

  const std::vector<Trial> all = trials(config.study, pairs, config.methods, config.seed);
  ResultStore store = ResultStore::create_or_resume(out);
  Progress progress(config.study.name, remaining_trials(all, store, options).size(), common.quiet);
  return run_sweep(all, pairs, config.methods, store, options,
                   [&](const SweepCounts& counts) { progress.update(counts.finished); });
}

Command sweep_command() {
  const auto state = std::make_shared<State>();
  return {
      .name = "sweep",
      .summary = "run the registrations of a study into a result table; resumes where it stopped",
      .examples =
          "  minescan sweep fig16 --out results.db\n"
          "  minescan sweep fig16 --trials 20 --axis initial-translation=1,2 --out results.db\n"
          "  minescan sweep fig17 --set settings.ndt.cell-size=2 --dry-run\n"
          "  minescan sweep fig16 --print-config > mine.yaml\n"
          "  minescan sweep mine.yaml --shard 1/4 --out part1.db\n"
          "  minescan sweep gate --set methods=icp,my_icp.yaml --out compared.db\n"
          "Settings, beside axes.NAME, settings.[METHOD.]OPTION and survey-settings.KEY:\n" +
          fields_help(fields_of(Study{})),
      .arguments = {{"STUDY", "NAME|FILE.yaml", "see minescan list studies", true, &state->study},
                    {"--out", "FILE.db", "the table to write or go on with", false, &state->out},
                    {"--axis", "NAME=V1,V2,...",
                     "what is varied: initial-translation, initial-rotation or an option of the "
                     "methods; may be given several times",
                     false, &state->axes},
                    {"--trials", "N", "start poses of every point", false, &state->trials},
                    {"--shard", "I/N", "run only the I-th of N parts", false, &state->shard},
                    {"--retry-failed", "", "run those again whose method threw", false,
                     &state->retry_failed},
                    {"--dry-run", "", "tell how many trials and about how long instead", false,
                     &state->dry_run},
                    {"--print-config", "", "write the resolved YAML instead", false,
                     &state->print_config}},
      .run = [state](const Common& common) -> int {
        const StudyConfig config =
            load_study_config(state->study, changes_of(*state, common), common.seed);
        const SweepOptions options = options_of(*state);
        if (state->print_config) {
          fmt::print("study: {}\nseed: {}\n{}", config.base, config.seed,
                     study_yaml(as_given(config)));
          return exit_done;
        }
        if (state->dry_run) {
          print_plan(config, options, common.quiet);
          return exit_done;
        }
        if (state->out.empty()) throw std::invalid_argument("sweep: --out is required");
        check_output(state->out);
        const std::vector<ScanPair> pairs = pairs_of(config, common.quiet);
        const SweepCounts counts = run_study(config, pairs, state->out, options, common);
        fmt::print("{}: {} trials, {} were there, {} run now, {} of them threw\n", state->out,
                   counts.trials, counts.done_before, counts.finished, counts.threw);
        return counts.threw == 0 ? exit_done : exit_failed;
      }};
}

}  // namespace minescan
