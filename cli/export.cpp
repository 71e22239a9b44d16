// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "cli/command.h"
#include "core/output_file.h"
#include "eval/method_table.h"
#include "eval/store.h"

namespace minescan {

Command export_command() {
  struct State {
    std::string results, csv, markdown;
  };
  const auto state = std::make_shared<State>();
  return {.name = "export",
          .summary = "write a result table as comma-separated values, or a summary of it",
          .examples =
              "  minescan export results.db --csv results.csv\n"
              "  minescan export results.db --csv - | column -s, -t | less -S\n"
              "  minescan export results.db --markdown methods.md\n",
          .arguments = {{"RESULTS", "FILE.db", "what minescan sweep wrote", true, &state->results},
                        {"--csv", "FILE",
                         "the file to write, a row per registration; - for standard output", false,
                         &state->csv},
                        {"--markdown", "FILE",
                         "a table for people, a row per pair and method; - for standard output",
                         false, &state->markdown}},
          .run = [state](const Common&) -> int {
            if (state->csv.empty() && state->markdown.empty())
              throw std::invalid_argument("export: --csv or --markdown is required");
            const ResultStore store = ResultStore::open(state->results);
            const auto put = [](const std::string& path, const std::string& text) {
              if (path == "-")
                fmt::print("{}", text);
              else if (!path.empty())
                write_file(path, text);
            };
            if (!state->csv.empty()) put(state->csv, store.csv());
            if (!state->markdown.empty()) put(state->markdown, method_table(store.read()));
            return exit_done;
          }};
}

}  // namespace minescan
