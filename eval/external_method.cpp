// SPDX-License-Identifier: MIT
#include "eval/external_method.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "core/output_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "registration/registered.h"
#include "registration/stopwatch.h"

extern char** environ;

namespace minescan {
namespace {

// Bytes of an answer: a matrix takes some hundred (assumed).
constexpr std::size_t longest_answer = 65536;

/// A folder that is there as long as this is.
class PrivateFolder {
 public:
  PrivateFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "minescan-XXXXXX").string();
    if (!mkdtemp(name.data()))
      throw std::runtime_error(
          fmt::format("{}: cannot make a folder: {}", name, std::strerror(errno)));
    path_ = name;
  }
  ~PrivateFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at))
    text.replace(at, what.size(), by), at += by.size();
  return text;
}

/// What a program printed, and the processor time that it took.
struct Answer {
  std::string text = {};
  double cpu = 0;
};

/// A running program, in a process group of its own, with its standard output.
class Child {
 public:
  explicit Child(std::vector<std::string> command) : name_(command.front()) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
      throw std::runtime_error(fmt::format("{}: no pipe: {}", name_, std::strerror(errno)));
    output_ = ends[0];
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    std::vector<char*> arguments;
    for (std::string& argument : command) arguments.push_back(argument.data());
    arguments.push_back(nullptr);
    const int error =
        posix_spawnp(&pid_, name_.c_str(), &files, &attributes, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    close(ends[1]);
    if (error != 0) {
      close(output_);
      throw std::runtime_error(
          fmt::format("{}: cannot be started: {}", name_, std::strerror(error)));
    }
  }
  ~Child() {
    close(output_);
    if (reaped_) return;
    kill(-pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  Answer wait(double timeout) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                     std::chrono::duration<double>(timeout));
    const auto left = [&] {
      return std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    };
    const auto check_time = [&] {
      if (left() <= 0)
        throw std::runtime_error(fmt::format("{}: not done after {} s, stopped", name_, timeout));
    };
    Answer answer;
    for (;;) {
      check_time();
      pollfd ready{.fd = output_, .events = POLLIN, .revents = 0};
      const int count = poll(&ready, 1, static_cast<int>(std::clamp<long>(left(), 1, 1000)));
      if (count <= 0) continue;
      char buffer[4096];
      const ssize_t size = read(output_, buffer, sizeof(buffer));
      if (size < 0 && errno == EINTR) continue;
      if (size <= 0) break;
      answer.text.append(buffer, static_cast<std::size_t>(size));
      if (answer.text.size() > longest_answer)
        throw std::runtime_error(fmt::format(
            "{}: printed more than {} bytes, expected a 4 x 4 matrix", name_, longest_answer));
    }
    // It has closed its output; that it ends as well may take a while.
    siginfo_t ended{};
    const auto id = static_cast<id_t>(pid_);
    while (waitid(P_PID, id, &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid == 0) {
      check_time();
      usleep(1000);
    }
    // What it has started and left behind, as long as its number is still its own.
    kill(-pid_, SIGKILL);
    int status = 0;
    rusage usage{};
    wait4(pid_, &status, 0, &usage);
    reaped_ = true;
    if (WIFSIGNALED(status))
      throw std::runtime_error(fmt::format("{}: ended by signal {} ({})", name_, WTERMSIG(status),
                                           strsignal(WTERMSIG(status))));
    if (WEXITSTATUS(status) != 0)
      throw std::runtime_error(fmt::format("{}: exit code {}", name_, WEXITSTATUS(status)));
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    answer.cpu = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    return answer;
  }

 private:
  std::string name_;
  pid_t pid_ = -1;
  int output_ = -1;
  bool reaped_ = false;
};

Pose pose_of(const std::string& name, const std::string& text) {
  std::vector<double> numbers;
  std::string word;
  const auto add = [&] {
    if (word.empty()) return;
    numbers.push_back(read_number(word, any_number, false));
    word.clear();
  };
  try {
    for (const char c : text) {
      if (c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == ',')
        add();
      else
        word += c;
    }
    add();
    if (numbers.size() != 16)
      throw std::invalid_argument(fmt::format("found {} numbers", numbers.size()));
    return pose_from_matrix(numbers);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(
        fmt::format("{}: printed no 4 x 4 matrix of a pose: {}", name, error.what()));
  }
}

std::string matrix_text(const Pose& pose) {
  std::string text;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      text += number_text(pose.matrix()(row, column)) + (column < 3 ? " " : "\n");
  return text;
}

RegistrationResult run(const PointCloud& target, const PointCloud& source, const Pose& T_guess,
                       const ExternalProgram& program) {
  check_clouds(target, source, T_guess);
  check_options(program);
  Stopwatch watch;
  RegistrationResult result{.status = Status::converged,
                            .target_points = target.points.size(),
                            .source_points = source.points.size(),
                            .used_points = source.points.size()};
  const PrivateFolder folder;
  const std::string files[][2] = {{"{target}", folder.file("target.ply")},
                                  {"{source}", folder.file("source.ply")},
                                  {"{guess}", folder.file("guess.txt")}};
  write_cloud(files[0][1], target);
  result.time.target = watch.lap();
  write_cloud(files[1][1], source);
  write_file(files[2][1], matrix_text(T_guess));
  result.time.source = watch.lap();
  std::vector<std::string> command = program.command;
  for (std::string& argument : command)
    for (const auto& [name, path] : files) argument = replaced(std::move(argument), name, path);
  const Answer answer = Child(command).wait(program.timeout_s);
  result.T_target_source = pose_of(program.name, answer.text);
  result.time.align = watch.lap();
  result.cpu = answer.cpu;
  return result;
}

}  // namespace

bool is_external_method(const std::string& name) {
  return name.ends_with(".yaml") || name.ends_with(".yml");
}

ExternalMethod external_method(const std::filesystem::path& path) {
  const ExternalProgram program =
      with_settings(ExternalProgram{}, resolve(read_config(path), fields_of(ExternalProgram{})));
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(fmt::format("{}: {}", path.string(), what));
  };
  if (program.name.empty()) refuse("expected a key 'name'");
  if (program.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") != std::string::npos)
    refuse(fmt::format("name = '{}': expected lower-case letters, digits, - and _", program.name));
  for (const Method& method : methods())
    if (method.name == program.name)
      refuse(fmt::format("name = '{}': there is a method of that name", program.name));
  if (program.command.empty() || program.command.front().empty())
    refuse("expected a key 'command': a list of the program and its arguments");
  std::vector<Field> list = fields_of(ExternalProgram{});
  std::erase_if(list, [](const Field& field) { return field.name == "name"; });
  Settings settings{{"command", value_text(program.command)}};
  if (program.timeout_s != ExternalProgram{}.timeout_s)
    settings["timeout_s"] = value_text(program.timeout_s);
  return {.method = {.name = program.name,
                     .description = "the program " + program.command.front(),
                     .fields = std::move(list),
                     .run =
                         [name = program.name](const PointCloud& target, const PointCloud& source,
                                               const Pose& T_guess, const Settings& wanted) {
                           ExternalProgram started = with_settings(ExternalProgram{}, wanted);
                           started.name = name;
                           if (started.command.empty())
                             throw std::invalid_argument(name + ": no command in the settings");
                           return run(target, source, T_guess, started);
                         }},
          .settings = std::move(settings)};
}

}  // namespace minescan
