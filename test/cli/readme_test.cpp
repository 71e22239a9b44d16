// SPDX-License-Identifier: MIT
// Every command that the README shows does what it says: they are run in order in one folder.
#include <gtest/gtest.h>

#include <sstream>

#include "cli/program.h"

namespace minescan {
namespace {

// The words of the lines "minescan ..." between ```sh and ```; a line ends at #, and double quotes
// hold a word with blanks together.
std::vector<std::vector<std::string>> commands_of(const std::string& readme) {
  std::vector<std::vector<std::string>> commands;
  std::istringstream lines(readme);
  bool shell = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) shell = line == "```sh";
    if (!shell || !line.starts_with("minescan ")) continue;
    std::vector<std::string> words(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '#' && !quoted) break;
      if (c == '"')
        quoted = !quoted;
      else if (c != ' ' || quoted)
        words.back() += c;
      else if (!words.back().empty())
        words.emplace_back();
    }
    if (words.back().empty()) words.pop_back();
    words.erase(words.begin());
    commands.push_back(words);
  }
  return commands;
}

/// The text between ```yaml and ```: the mine that a command builds.
std::string mine_of(const std::string& readme) {
  const std::string fence = "```yaml\n";
  const std::size_t begin = readme.find(fence) + fence.size();
  return readme.substr(begin, readme.find("```", begin) - begin);
}

TEST(Readme, CommandsWork) {
  const ScratchFolder folder;
  write_text(folder / "mine.yaml", mine_of(content(MINESCAN_README)));
  const auto commands = commands_of(content(MINESCAN_README));
  ASSERT_GE(commands.size(), 5u) << "the README lost its commands";
  for (const std::vector<std::string>& command : commands) {
    std::string line = "minescan";
    for (const std::string& word : command) line += " " + word;
    const ProgramResult result = run_minescan(command, folder);
    EXPECT_EQ(result.exit_code, 0) << line << "\n" << result.errors;
  }
}

}  // namespace
}  // namespace minescan
