// SPDX-License-Identifier: MIT
// The program. A newcomer reads on in cli/sweep.cpp: it is the main path from a mine to a table.
#include "cli/command.h"

int main(int argc, char** argv) {
  using namespace minescan;
  return run_command_line(
      argc, argv,
      {list_command(), scene_command(), survey_command(), register_command(), sweep_command(),
       merge_command(), export_command(), report_command(), baseline_command(), check_command(),
       validate_command(), paper_command()});
}
