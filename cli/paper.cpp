// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/report_files.h"
#include "cli/survey_data.h"
#include "cli/sweep_run.h"

namespace minescan {
namespace {

namespace fs = std::filesystem;

// The data sets of the paper that are made, and the studies that are run on the first of them.
constexpr const char* data_sets[] = {"junction", "tunnel"};
constexpr const char* experiments[] = {"fig16", "fig17"};

// Start poses per point; the paper has 100. A quarter still gives quartiles, in a few minutes.
constexpr const char* quick_trials = "25";

struct State {
  std::string out;
  bool quick = false, svg = false;
};

int run(const State& state, const Common& common) {
  if (!common.set.empty())
    throw std::invalid_argument("paper: takes no --set; minescan sweep runs a study with settings");
  const fs::path out = state.out;
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw std::runtime_error(out.string() + ": cannot be made: " + error.message());

  std::vector<ScanPair> pairs;
  for (const char* name : data_sets) {
    const SurveyConfig config = load_survey_config(name, {}, common.seed);
    const SurveyData data = write_survey(out / name, config, common.quiet, true, true);
    for (ScanPair& pair : scan_pairs(config, data)) pairs.push_back(std::move(pair));
  }

  const std::string results = (out / "results.db").string();
  std::size_t threw = 0;
  for (const char* name : experiments) {
    Config changes;
    if (state.quick) changes.push_back({"trials", quick_trials, "--quick"});
    const StudyConfig study = load_study_config(name, changes, common.seed);
    std::vector<ScanPair> chosen;
    for (const ScanPair& pair : pairs)
      if (pair.name == study.study.survey) chosen.push_back(pair);
    threw += run_study(study, chosen, results, {}, common).threw;
  }
  const fs::path page = write_report({results}, out, state.svg);
  fmt::print("{}\n", page.string());
  return threw == 0 ? exit_done : exit_failed;
}

}  // namespace

Command paper_command() {
  const auto state = std::make_shared<State>();
  return {
      .name = "paper",
      .summary = "the main job: data sets, experiments and report of the paper",
      .examples =
          "  minescan paper --quick --out paper\n"
          "  minescan paper --out paper --svg --seed 2\n",
      .arguments =
          {{"--out", "DIR", "the folder to write; a stopped run goes on in it", true, &state->out},
           {"--quick", "", "25 start poses per point instead of 100", false, &state->quick},
           {"--svg", "", "write every figure as a file too (needs Node.js)", false, &state->svg}},
      .run = [state](const Common& common) { return run(*state, common); }};
}

}  // namespace minescan
