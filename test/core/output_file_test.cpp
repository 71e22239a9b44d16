// SPDX-License-Identifier: MIT
#include "core/output_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <iterator>
#include <string>

namespace minescan {
namespace {

namespace fs = std::filesystem;

// An empty folder of its own for every test, removed at its end.
struct Scratch {
  fs::path path;
  Scratch() {
    std::string name = (fs::temp_directory_path() / "minescan-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path = name;
  }
  ~Scratch() { fs::remove_all(path); }
};

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const Scratch scratch;
  const fs::path path = scratch.path / "a.txt";
  write_file(path, "old");
  {
    OutputFile file(path);
    file.stream() << "half of the n";
    EXPECT_EQ(content(path), "old");
  }
  EXPECT_EQ(content(path), "old");
  write_file(path, "new");
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path), {}), 1)
      << "a temporary file is left";
}

TEST(OutputFile, SaysWhatCannotBeWritten) {
  const Scratch scratch;
  EXPECT_THROW(write_file(scratch.path / "no" / "a.txt", "x"), std::runtime_error);
  EXPECT_THROW(write_file(scratch.path, "x"), std::runtime_error);
  try {
    write_file("/dev/full", "x");
    FAIL() << "a full device took a byte";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/dev/full: cannot be written: No space left on device");
  }
}

TEST(OutputFolder, AppearsWholeOrNotAtAll) {
  const Scratch scratch;
  const fs::path path = scratch.path / "data" / "set";
  {
    const OutputFolder folder(path, false);
    write_file(folder.temporary_path() / "a.txt", "x");
  }
  EXPECT_FALSE(fs::exists(path));
  {
    OutputFolder folder(path, false);
    write_file(folder.temporary_path() / "a.txt", "x");
    folder.commit();
  }
  EXPECT_EQ(content(path / "a.txt"), "x");
  EXPECT_THROW(OutputFolder(path, false), std::runtime_error);
  EXPECT_EQ(content(path / "a.txt"), "x");
  {
    OutputFolder folder(path, true);
    folder.commit();
  }
  EXPECT_TRUE(fs::is_empty(path));
  EXPECT_THROW(OutputFolder("/proc/minescan", false), std::runtime_error);
}

}  // namespace
}  // namespace minescan
