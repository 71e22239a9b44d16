// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <memory>

#include "cli/survey_data.h"

namespace minescan {

Command survey_command() {
  struct State {
    std::string survey, out, formats;
    bool print_config = false, force = false;
  };
  const auto state = std::make_shared<State>();
  return {
      .name = "survey",
      .summary = "scan a mine and write a data set with exact truth",
      .examples =
          "  minescan survey junction --out data\n"
          "  minescan survey tunnel --set scene.edge-length=0.1 --seed 7 --out data\n"
          "  minescan survey junction --format pcd,uos,kitti --out data\n"
          "  minescan survey junction --print-config > mine.yaml\n"
          "  minescan survey mine.yaml --out data --force\n"
          "Settings: --print-config shows them all, with units and limits\n",
      .arguments =
          {{"SURVEY", "NAME|FILE.yaml", "see minescan list surveys", true, &state->survey},
           {"--out", "DIR", "the folder to write", false, &state->out},
           {"--format", "NAMES",
            "write the scans for other programs too, pcd,las,... see minescan list formats", false,
            &state->formats},
           {"--force", "", "replace the folder of another survey", false, &state->force},
           {"--print-config", "", "write the resolved YAML instead", false, &state->print_config}},
      .run = [state](const Common& common) -> int {
        const SurveyConfig config =
            load_survey_config(state->survey, set_entries(common), common.seed);
        if (state->print_config) {
          fmt::print("{}", survey_config_yaml(config));
          return exit_done;
        }
        if (state->out.empty()) throw std::invalid_argument("survey: --out is required");
        const SurveyData data = write_survey(state->out, config, common.quiet, false, state->force,
                                             find_data_set_formats(state->formats));
        for (std::size_t k = 0; k < data.points.size(); ++k)
          fmt::print("{}: {} points of {} beams\n", scan_file(k).string(), data.points[k],
                     data.beams[k]);
        for (const DataSetPair& pair : data.pairs)
          fmt::print("pair {} <- {}: overlap {:.0f} %\n", pair.target, pair.source,
                     100 * pair.overlap);
        return exit_done;
      }};
}

}  // namespace minescan
