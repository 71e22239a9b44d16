// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <memory>

#include "cli/command.h"
#include "core/output_file.h"
#include "eval/store.h"

namespace minescan {

Command export_command() {
  struct State {
    std::string results, csv;
  };
  const auto state = std::make_shared<State>();
  return {.name = "export",
          .summary = "write a result table as comma-separated values",
          .examples =
              "  minescan export results.db --csv results.csv\n"
              "  minescan export results.db --csv - | column -s, -t | less -S\n",
          .arguments = {{"RESULTS", "FILE.db", "what minescan sweep wrote", true, &state->results},
                        {"--csv", "FILE", "the file to write; - for standard output", true,
                         &state->csv}},
          .run = [state](const Common&) -> int {
            const std::string text = ResultStore::open(state->results).csv();
            if (state->csv == "-")
              fmt::print("{}", text);
            else
              write_file(state->csv, text);
            return exit_done;
          }};
}

}  // namespace minescan
