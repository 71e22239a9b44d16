// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/output_file.h"
#include "core/text.h"
#include "reports/assets.h"
#include "reports/figures.h"
#include "reports/report.h"

extern char** environ;  // NOLINT: POSIX declares it nowhere

namespace minescan {
namespace {

namespace fs = std::filesystem;

/// A new folder of our own under the system's folder for temporary files, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "minescan-figures-XXXXXX").string();
    if (!mkdtemp(pattern.data()))
      throw std::runtime_error(
          fmt::format("{}: cannot create the temporary folder: {}", pattern, std::strerror(errno)));
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || file.bad())
    throw std::runtime_error(fmt::format("{}: cannot read the rendered figure", path.string()));
  return text;
}

/// The line of a program's output that tells what went wrong: the last that speaks of an error,
/// else the last. (An uncaught error ends with a stack and the version of Node.js.)
std::string telling_line(const std::string& output) {
  std::string last, error;
  for (const std::string& line : split(output, '\n')) {
    if (!line.empty()) last = line;
    if (line.find("Error") != std::string::npos) error = line;
  }
  return error.empty() ? last : error;
}

/// Runs `node` with the arguments, without a shell; what it prints goes to the file `log`.
void run_node(const std::vector<std::string>& arguments, const fs::path& log) {
  std::vector<std::string> texts = {"node"};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& text : texts) argv.push_back(text.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(),
                                   O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failure = posix_spawnp(&child, "node", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0)
    throw std::runtime_error(fmt::format(
        "figures as SVG need Node.js, but 'node' cannot be started: {}", std::strerror(failure)));

  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR)
      throw std::runtime_error(fmt::format("waiting for 'node': {}", std::strerror(errno)));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string end = WIFEXITED(status) ? fmt::format("status {}", WEXITSTATUS(status))
                                            : fmt::format("signal {}", WTERMSIG(status));
  const std::string line = telling_line(read_text(log));
  throw std::runtime_error(fmt::format("rendering the figures: 'node' ended with {}{}{}", end,
                                       line.empty() ? "" : ": ", line));
}

}  // namespace

std::vector<FigureFile> report_figures(const ReportInput& input) {
  const std::vector<StudyFigures> studies = make_figures(input.outcomes);
  if (studies.empty()) return {};

  const TemporaryFolder folder;
  const fs::path script = folder.path() / "render.mjs", data = folder.path() / "figures.json";
  write_file(script, render_script());
  write_file(data, figures_json(studies, input.runs));
  run_node({script.string(), data.string(), folder.path().string()}, folder.path() / "log");

  std::vector<FigureFile> files;
  for (const StudyFigures& study : studies)
    for (const Figure& figure : study.figures) {
      // Numbered: names of studies are the users', and a file name may be too long for the system.
      const fs::path svg = folder.path() / fmt::format("{}.svg", files.size());
      files.push_back({.name = figure.name + ".svg", .svg = read_text(svg)});
    }
  return files;
}

}  // namespace minescan
