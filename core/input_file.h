// SPDX-License-Identifier: MIT
// Reading files that may be anything: bytes with bounds, text with line numbers.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace minescan {

/// All bytes of a file. Throws std::runtime_error naming it and the reason.
std::string read_file(const std::filesystem::path& path);

/// Walks through text line by line and knows where it is.
class LineReader {
 public:
  LineReader(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  /// Moves to the next line (without its end) if there is one.
  bool next(std::string_view& line);
  /// The byte after the last line read.
  std::size_t offset() const { return at_; }
  /// Throws std::runtime_error "file:line: what".
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
};

/// The T at `bytes`, in the byte order of the machine or the other.
template <class T>
T load(const char* bytes, bool swap) {
  char raw[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) raw[i] = bytes[swap ? sizeof(T) - 1 - i : i];
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

/// Kinds of numbers in binary files.
enum class NumberType {
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64
};

std::size_t size_of(NumberType type);

/// The number at `bytes` as a double (64-bit integers are rounded).
double load_number(const char* bytes, NumberType type, bool swap);

}  // namespace minescan
