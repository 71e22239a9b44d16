// SPDX-License-Identifier: MIT
// Files and folders that appear whole or not at all: written under a temporary name beside the
// final one and renamed at the end. A killed program or a full disk leaves nothing half-written
// under the final name.
#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace minescan {

/// A file being written. All errors are std::runtime_error naming the file and the system's reason.
class OutputFile {
 public:
  /// Creates the temporary file. Throws if the folder does not exist or cannot be written. A device
  /// or pipe is written in place.
  explicit OutputFile(std::filesystem::path final_path);
  ~OutputFile();  // removes the temporary file unless committed
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Where to write, for text and binary alike.
  std::ostream& stream() { return stream_; }
  /// Writes what is buffered, puts it on the disk and gives the file its final name.
  void commit();

 private:
  std::filesystem::path final_path_;
  std::filesystem::path temporary_path_;
  std::ofstream stream_;
};

/// The whole file in one call.
void write_file(const std::filesystem::path& path, std::string_view content);

/// A folder being filled; as OutputFile.
class OutputFolder {
 public:
  /// Throws std::runtime_error if `final_path` exists and `replace` is false, or is a file.
  OutputFolder(const std::filesystem::path& final_path, bool replace);
  ~OutputFolder();  // removes the temporary folder unless committed
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  const std::filesystem::path& temporary_path() const { return temporary_path_; }
  /// Gives the folder its final name; the one that is replaced is removed.
  void commit();

 private:
  std::filesystem::path final_path_;
  std::filesystem::path temporary_path_;
};

}  // namespace minescan
