// SPDX-License-Identifier: MIT
#include "reports/report.h"

#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <system_error>

#include "cli/command.h"
#include "cli/report_files.h"
#include "core/output_file.h"

namespace minescan {

std::filesystem::path write_report(const std::vector<std::string>& results,
                                   const std::filesystem::path& folder, bool svg) {
  ReportInput input;
  for (const std::string& path : results) {
    const ResultStore store = ResultStore::open(path);
    for (Outcome& outcome : store.read()) input.outcomes.push_back(std::move(outcome));
    for (RunInfo& run : store.runs()) input.runs.push_back(std::move(run));
  }
  if (input.outcomes.empty())
    throw std::runtime_error(results.front() + ": holds no trial to report on");
  const std::string page = report_page(input);
  const std::vector<FigureFile> figures = svg ? report_figures(input) : std::vector<FigureFile>{};
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": cannot be made: " + error.message());
  for (const FigureFile& figure : figures) write_file(folder / figure.name, figure.svg);
  write_file(folder / "index.html", page);
  return folder / "index.html";
}

Command report_command() {
  struct State {
    std::vector<std::string> results;
    std::string out;
    bool svg = false;
  };
  const auto state = std::make_shared<State>();
  return {.name = "report",
          .summary = "draw result tables as one page that works offline",
          .examples =
              "  minescan report results.db --out report\n"
              "  minescan report fig16.db fig17.db --out report --svg\n",
          .arguments = {{"RESULTS", "FILE.db", "what minescan sweep wrote", true, &state->results},
                        {"--out", "DIR", "the folder to write index.html into", true, &state->out},
                        {"--svg", "", "write every figure as a file too (needs Node.js)", false,
                         &state->svg}},
          .run = [state](const Common&) -> int {
            fmt::print("{}\n", write_report(state->results, state->out, state->svg).string());
            return exit_done;
          }};
}

}  // namespace minescan
