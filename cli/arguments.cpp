// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <optional>

#include "cli/command.h"
#include "core/parallel.h"
#include "core/text.h"

namespace minescan {
namespace {

void add_argument(CLI::App& app, const Argument& argument) {
  const bool flag = std::holds_alternative<bool*>(argument.value);
  CLI::Option* option =
      flag ? app.add_flag(argument.name, *std::get<bool*>(argument.value), argument.help)
           : std::visit(
                 [&](auto* value) { return app.add_option(argument.name, *value, argument.help); },
                 argument.value);
  if (argument.required) option->required();
  if (flag) return;
  option->type_name(argument.value_name);
  option->check([](const std::string& text) {
    return text.empty() ? std::string("expected a value, found nothing") : std::string();
  });
  // One value per --set, so that what follows it is not swallowed.
  if (std::holds_alternative<std::vector<std::string>*>(argument.value) &&
      argument.name.starts_with("--"))
    option->type_size(1)->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_common(CLI::App& app, Common& common) {
  app.add_option("--set", common.set, "change one setting; may be given several times")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--seed", common.seed, "names every random choice; default 1")->type_name("N");
  app.add_option("--threads", common.threads, "default: all cores")
      ->type_name("N")
      ->check(CLI::Range(1, 4096));
  app.add_flag("--quiet", common.quiet, "no progress on standard error");
}

int run(const Command& command, const Common& common) {
  std::optional<ThreadLimit> limit;
  if (common.threads > 0) limit.emplace(common.threads);
  return command.run(common);
}

// What is wrong with the command line. CLI11 says of an unknown command only that one is missing.
std::string parse_message(const CLI::ParseError& error, int argc, const char* const* argv,
                          const std::vector<Command>& commands) {
  std::string what = error.what();
  if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> known;
    for (const Command& command : commands) known.push_back(command.name);
    if (std::find(known.begin(), known.end(), argv[1]) == known.end())
      what = unknown_name("command", argv[1], known);
  }
  return what + "; see minescan --help";
}

// One line, whatever it is.
int complain(const std::string& what, int code) {
  std::string line = what;
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  fmt::print(stderr, "minescan: {}\n", trimmed(line));
  return code;
}

}  // namespace

int run_command_line(int argc, const char* const* argv, const std::vector<Command>& commands) {
  CLI::App app("Simulates laser scanners in mines and measures the registration of their scans.",
               "minescan");
  app.require_subcommand(1);
  app.set_version_flag("--version", fmt::format("minescan {}", version()));
  app.footer(
      "Exit codes: 0 done, 1 it could not be done, 2 the command or a configuration is wrong,\n"
      "3 check found a regression, 4 check cannot tell.");
  Common common;
  for (int i = 0; i < argc; ++i) common.command_line += fmt::format("{}{}", i ? " " : "", argv[i]);
  for (const Command& command : commands) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    for (const Argument& argument : command.arguments) add_argument(*sub, argument);
    add_common(*sub, common);
    sub->footer("Examples:\n" + command.examples);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    return complain(parse_message(error, argc, argv, commands), exit_usage);
  }
  try {
    for (const Command& command : commands)
      if (app.got_subcommand(command.name)) return run(command, common);
    return exit_usage;
  } catch (const std::invalid_argument& error) {
    return complain(error.what(), exit_usage);
  } catch (const std::bad_alloc&) {
    return complain("not enough memory", exit_failed);
  } catch (const std::exception& error) {
    return complain(error.what(), exit_failed);
  }
}

}  // namespace minescan
