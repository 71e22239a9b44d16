// SPDX-License-Identifier: MIT
// What a command of the program is: its arguments as data and a function to run. Each command has a
// file of its own; cli/main.cpp lists them, cli/arguments.cpp reads the command line.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace minescan {

/// Options that every command takes.
struct Common {
  std::vector<std::string> set = {};  // --set key=value
  std::optional<std::uint64_t> seed = {};
  int threads = 0;  // 0: all cores
  bool quiet = false;
  std::string command_line = {};  // as typed
};

/// One argument of one command and where its value goes.
struct Argument {
  std::string name = {};        // "TARGET" for a positional one, "--out" for an option
  std::string value_name = {};  // "FILE"; empty for a flag
  std::string help = {};
  bool required = false;
  std::variant<bool*, std::string*, std::vector<std::string>*> value = {};
};

struct Command {
  std::string name = {};
  std::string summary = {};
  std::string examples = {};  // lines of shell, shown by --help
  std::vector<Argument> arguments = {};
  /// Does it; returns the exit code. Throws std::invalid_argument for what the user got wrong (exit
  /// code 2) and std::runtime_error for what could not be done (exit code 1).
  std::function<int(const Common&)> run = {};
};

/// Exit codes that scripts rely on.
enum ExitCode : int {
  exit_done = 0,
  exit_failed = 1,       // a file, a disk, a trial that threw
  exit_usage = 2,        // the command or a configuration is wrong
  exit_regression = 3,   // check: worse than the baseline
  exit_cannot_tell = 4,  // check: trials or baseline missing, too few trials
};

/// The version of the program, "0.1.0".
std::string_view version();

/// Reads the command line and runs the command it names. Returns the exit code; every error is one
/// line on standard error.
int run_command_line(int argc, const char* const* argv, const std::vector<Command>& commands);

// The commands, one file each.
Command list_command();
Command scene_command();
Command survey_command();
Command register_command();
Command sweep_command();
Command export_command();
Command report_command();
Command baseline_command();
Command check_command();
Command paper_command();
Command merge_command();
Command validate_command();

}  // namespace minescan
