// SPDX-License-Identifier: MIT
// Somebody else's registration program as a method.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/config.h"
#include "core/fields.h"
#include "registration/methods.h"

namespace minescan {

struct ExternalProgram {
  std::string name = {};
  // The program and its arguments, as it is started: no shell looks at them. "{target}", "{source}"
  // and "{guess}" become the names of two binary PLY files and of a file with a 4 x 4 matrix.
  std::vector<std::string> command = {};
  double timeout_s = 60;
};

template <class Visitor>
void fields(ExternalProgram& o, Visitor&& field) {
  field("name", o.name, "what the method is called");
  field(
      "command", o.command,
      "the program and its arguments, without commas in them; {target} {source} {guess} are files");
  field("timeout_s", o.timeout_s, above_up_to(0, 1e6), "s", "after which it is stopped");
}

/// Whether a method's name is that of a file: it ends in .yaml or .yml.
bool is_external_method(const std::string& name);

struct ExternalMethod {
  Method method = {};
  Settings settings = {};  // what a trial of this program has in its settings
};

/// Reads {name, command, timeout_s} from a YAML file. A program named with a '/' is looked for from
/// the working directory, others along PATH.
///
/// The method's `run` writes the clouds and the guess to a private temporary folder, starts the
/// program, waits for it and removes the folder. It throws std::runtime_error if the program cannot
/// be started, ends with a code other than 0 or by a signal, is not done after timeout_s (it and
/// what it has started are stopped then; not when minescan itself is killed), or prints anything
/// but 16 numbers that are a pose, row by row. Time to align is that from start to end, cpu that of
/// the program.
///
/// The command is an option of the method that has no default, and so has to be among a trial's
/// settings: results of different commands are told apart.
///
/// throws  std::runtime_error if the file cannot be read, std::invalid_argument with the place for
///         an unknown key, no command, or a name that is empty or that of a method known already
ExternalMethod external_method(const std::filesystem::path& path);

}  // namespace minescan
