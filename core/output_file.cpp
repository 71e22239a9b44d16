// SPDX-License-Identifier: MIT
#include "core/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace minescan {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": " + what + ": " + std::strerror(errno));
}

std::filesystem::path temporary_name(const std::filesystem::path& path) {
  return path.parent_path() /
         (".minescan-" + std::to_string(getpid()) + "-" + path.filename().string());
}

std::filesystem::path without_trailing_slash(const std::filesystem::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path final_path)
    : final_path_(std::move(final_path)), temporary_path_(temporary_name(final_path_)) {
  if (std::filesystem::is_directory(final_path_)) {
    errno = EISDIR;
    fail(final_path_, "cannot be written");
  }
  // A device or pipe (/dev/stdout) is written in place: renaming would replace it by a file.
  if (std::filesystem::exists(final_path_) && !std::filesystem::is_regular_file(final_path_))
    temporary_path_.clear();
  errno = 0;
  stream_.open(temporary_path_.empty() ? final_path_ : temporary_path_,
               std::ios::binary | std::ios::trunc);
  if (!stream_) fail(final_path_, "cannot be written");
}

OutputFile::~OutputFile() {
  if (temporary_path_.empty()) return;
  stream_.close();
  std::error_code ignored;  // a destructor has nobody to tell, and the final name is untouched
  std::filesystem::remove(temporary_path_, ignored);
}

void OutputFile::commit() {
  errno = 0;
  stream_.flush();
  if (!stream_) fail(final_path_, "cannot be written");
  stream_.close();
  if (!stream_) fail(final_path_, "cannot be written");
  if (temporary_path_.empty()) return;
  const int file = open(temporary_path_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = file >= 0 && fsync(file) == 0;
  if (file >= 0) close(file);
  if (!synced) fail(final_path_, "cannot be put on the disk");
  std::error_code error;
  std::filesystem::rename(temporary_path_, final_path_, error);
  if (error)
    throw std::runtime_error(final_path_.string() + ": cannot be written: " + error.message());
  temporary_path_.clear();
}

void write_file(const std::filesystem::path& path, std::string_view content) {
  OutputFile file(path);
  file.stream().write(content.data(), static_cast<std::streamsize>(content.size()));
  file.commit();
}

OutputFolder::OutputFolder(const std::filesystem::path& final_path, bool replace)
    : final_path_(without_trailing_slash(final_path)),
      temporary_path_(temporary_name(final_path_)) {
  std::error_code error;
  const auto status = std::filesystem::status(final_path_, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_directory(status))
    throw std::runtime_error(final_path_.string() + ": expected a folder, found a file");
  if (std::filesystem::exists(status) && !replace)
    throw std::runtime_error(final_path_.string() + ": exists already; --force replaces it");
  std::filesystem::create_directories(temporary_path_, error);
  if (error)
    throw std::runtime_error(final_path_.string() + ": cannot be written: " + error.message());
}

OutputFolder::~OutputFolder() {
  if (temporary_path_.empty()) return;
  std::error_code ignored;  // as above
  std::filesystem::remove_all(temporary_path_, ignored);
}

void OutputFolder::commit() {
  std::error_code error;
  std::filesystem::remove_all(final_path_, error);
  if (!error) std::filesystem::rename(temporary_path_, final_path_, error);
  if (error)
    throw std::runtime_error(final_path_.string() + ": cannot be written: " + error.message());
  temporary_path_.clear();
}

}  // namespace minescan
