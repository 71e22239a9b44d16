// SPDX-License-Identifier: MIT
#include "cli/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

namespace minescan {
namespace {

namespace fs = std::filesystem;

// In the child: output and errors into files, then the program.
[[noreturn]] void become_minescan(const std::vector<std::string>& arguments, const fs::path& folder,
                                  const fs::path& output, const fs::path& errors) {
  const int out = open(output.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  const int err = open(errors.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  const int in = open("/dev/null", O_RDONLY);
  std::vector<char*> argv = {const_cast<char*>("minescan")};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  if (out >= 0 && err >= 0 && dup2(in, 0) == 0 && dup2(out, 1) == 1 && dup2(err, 2) == 2 &&
      chdir(folder.c_str()) == 0)
    execv(MINESCAN_PROGRAM, argv.data());
  _exit(127);
}

int exit_code_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

ProgramResult run_minescan(const std::vector<std::string>& arguments, const fs::path& folder) {
  const ScratchFolder talk;
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) become_minescan(arguments, folder, talk / "out", talk / "err");
  int status = 0;
  waitpid(child, &status, 0);
  return {exit_code_of(status), content(talk / "out"), content(talk / "err")};
}

bool run_and_kill(const std::vector<std::string>& arguments, const fs::path& folder,
                  const std::function<bool()>& now) {
  const ScratchFolder talk;
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) become_minescan(arguments, folder, talk / "out", talk / "err");
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (now()) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return WIFSIGNALED(status);
}

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "minescan-test-XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;  // a left-over in /tmp must not end a test
  fs::remove_all(path_, ignored);
}

std::vector<std::string> ScratchFolder::names() const {
  std::vector<std::string> list;
  for (const auto& entry : fs::directory_iterator(path_)) list.push_back(entry.path().filename());
  std::sort(list.begin(), list.end());
  return list;
}

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

const std::vector<std::string>& small_survey() {
  static const std::vector<std::string> settings = {"--quiet",
                                                    "--set",
                                                    "scene.edge-length=0.25",
                                                    "--set",
                                                    "stations.0.plane-beams=100",
                                                    "--set",
                                                    "stations.0.planes=90",
                                                    "--set",
                                                    "stations.1.plane-beams=120",
                                                    "--set",
                                                    "stations.1.planes=100"};
  return settings;
}

const std::vector<std::string>& small_study() {
  static const std::vector<std::string> settings = [] {
    std::vector<std::string> list = small_survey();
    for (std::string& text : list)
      if (text.find('=') != std::string::npos) text = "survey-settings." + text;
    return list;
  }();
  return settings;
}

std::vector<std::string> joined(std::vector<std::string> first,
                                const std::vector<std::string>& rest) {
  first.insert(first.end(), rest.begin(), rest.end());
  return first;
}

}  // namespace minescan
