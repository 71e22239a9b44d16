// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/command.h"
#include "eval/store.h"

namespace minescan {

Command merge_command() {
  struct State {
    std::string out;
    std::vector<std::string> in;
  };
  const auto state = std::make_shared<State>();
  return {.name = "merge",
          .summary = "join result tables, as of the shards of a sweep",
          .examples =
              "  minescan sweep fig16 --shard 1/2 --out a.db\n"
              "  minescan sweep fig16 --shard 2/2 --out b.db\n"
              "  minescan merge all.db a.db b.db\n",
          .arguments = {{"OUT", "FILE.db", "the table to write or add to", true, &state->out},
                        {"IN", "FILE.db", "tables to read", true, &state->in}},
          .run = [state](const Common&) -> int {
            // Every table is looked at before the first is touched.
            for (const std::string& in : state->in) ResultStore::open(in);
            ResultStore out = ResultStore::create_or_resume(state->out);
            for (const std::string& in : state->in) out.merge(in);
            fmt::print("{}: {} rows\n", state->out, out.read().size());
            return exit_done;
          }};
}

}  // namespace minescan
