// SPDX-License-Identifier: MIT
// The program from outside: start it, read what it says and how it ends.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace minescan {

struct ProgramResult {
  int exit_code = -1;  // 128 + signal if a signal ended it
  std::string output = {};
  std::string errors = {};
};

/// Runs minescan in `folder` until it ends.
ProgramResult run_minescan(const std::vector<std::string>& arguments,
                           const std::filesystem::path& folder);

/// Starts it and kills it with SIGKILL as soon as `now` says so; returns whether it came to that.
bool run_and_kill(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                  const std::function<bool()>& now);

/// An empty folder, removed at the end of its life.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  operator const std::filesystem::path&() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// Names of all files and folders in it, sorted.
  std::vector<std::string> names() const;

 private:
  std::filesystem::path path_;
};

/// All bytes of a file; empty if there is none.
std::string content(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

/// A junction that takes a second: a coarse mesh and few beams.
const std::vector<std::string>& small_survey();
/// The same, for the settings of a study.
const std::vector<std::string>& small_study();

/// `first` and then `rest`.
std::vector<std::string> joined(std::vector<std::string> first,
                                const std::vector<std::string>& rest);

}  // namespace minescan
