// SPDX-License-Identifier: MIT
#include "eval/check.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <stdexcept>

#include "cli/command.h"
#include "cli/scene_config.h"
#include "core/output_file.h"
#include "eval/check_report.h"
#include "eval/check_self_test.h"
#include "eval/store.h"

namespace minescan {
namespace {

struct State {
  std::string results, baseline, limits, junit, markdown, json;
  bool self_test = false;
};

// Simulated checks per row of the self-test: rates are then good to about 2.5 points.
constexpr std::size_t self_test_repetitions = 400;

// What the self-test simulates for each method: a small gate, ours, and a figure of the paper.
constexpr std::size_t self_test_trials[] = {12, 30, 100};

int run_self_test(const CheckOptions& options, std::uint64_t seed) {
  for (const std::size_t trials : self_test_trials)
    fmt::print("{}", self_test_text(check_self_test(trials, self_test_repetitions, seed, options)));
  return exit_done;
}

int exit_code_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return exit_done;
    case Verdict::regression:
      return exit_regression;
    case Verdict::cannot_tell:
      return exit_cannot_tell;
  }
  throw std::logic_error("check: not a verdict");
}

int run(const State& state, const Common& common) {
  const CheckOptions options =
      with_settings(CheckOptions{}, resolve(set_entries(common), fields_of(CheckOptions{})));
  if (state.self_test) return run_self_test(options, common.seed.value_or(1));
  if (state.results.empty() || state.baseline.empty())
    throw std::invalid_argument("check: expected RESULTS and --baseline, or --self-test");
  const std::vector<Limit> limits =
      state.limits.empty() ? std::vector<Limit>{} : read_limits(state.limits);
  const std::vector<Outcome> outcomes = ResultStore::open(state.results).read();
  CheckResult result;
  if (std::filesystem::exists(state.baseline))
    result = check(outcomes, read_baseline(state.baseline), limits, options);
  else
    result.summary = fmt::format("cannot tell: there is no baseline {}", state.baseline);

  if (!state.junit.empty()) write_file(state.junit, check_junit(result));
  if (!state.markdown.empty()) write_file(state.markdown, check_markdown(result));
  if (!state.json.empty()) write_file(state.json, check_json(result));
  fmt::print("{}", check_text(result));
  return exit_code_of(result.verdict);
}

}  // namespace

Command check_command() {
  const auto state = std::make_shared<State>();
  return {
      .name = "check",
      .summary = "did registration get worse? Answers with statistics and an exit code",
      .examples =
          "  minescan check gate.db --baseline baseline.json\n"
          "  minescan check gate.db --baseline baseline.json --limits limits.yaml \\\n"
          "    --junit check.xml --markdown check.md\n"
          "  minescan check gate.db --baseline baseline.json --set ratio-margin=1.5\n"
          "  minescan check --self-test\n"
          "Settings:\n" +
          fields_help(fields_of(CheckOptions{})),
      .arguments = {{"RESULTS", "FILE.db", "what minescan sweep wrote", false, &state->results},
                    {"--baseline", "FILE", "what minescan baseline wrote", false, &state->baseline},
                    {"--limits", "FILE.yaml", "what must hold whatever the baseline says", false,
                     &state->limits},
                    {"--junit", "FILE", "write the result as JUnit XML", false, &state->junit},
                    {"--markdown", "FILE", "write the result as Markdown", false, &state->markdown},
                    {"--json", "FILE", "write the result as JSON", false, &state->json},
                    {"--self-test", "",
                     "measure how often the check is wrong, on simulated results", false,
                     &state->self_test}},
      .run = [state](const Common& common) { return run(*state, common); }};
}

}  // namespace minescan
