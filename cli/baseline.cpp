// SPDX-License-Identifier: MIT
#include "eval/baseline.h"

#include <fmt/format.h>

#include <memory>

#include "cli/command.h"
#include "eval/store.h"

namespace minescan {

Command baseline_command() {
  struct State {
    std::string results, out, reason;
  };
  const auto state = std::make_shared<State>();
  return {
      .name = "baseline",
      .summary = "keep results to compare later ones with",
      .examples =
          "  minescan sweep gate --out gate.db\n"
          "  minescan baseline gate.db --out baseline.json --reason \"first release\"\n",
      .arguments = {{"RESULTS", "FILE.db", "what minescan sweep wrote", true, &state->results},
                    {"--out", "FILE", "the file to write, for the repository", true, &state->out},
                    {"--reason", "TEXT", "why these are the results to hold others to", true,
                     &state->reason}},
      .run = [state](const Common&) -> int {
        const std::vector<Outcome> outcomes = ResultStore::open(state->results).read();
        write_baseline(state->out, outcomes, state->reason, std::string(version()));
        fmt::print("{}: {} trials\n", state->out, outcomes.size());
        return exit_done;
      }};
}

}  // namespace minescan
