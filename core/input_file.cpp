// SPDX-License-Identifier: MIT
#include "core/input_file.h"

#include <cerrno>
#include <fstream>
#include <sstream>

namespace minescan {

std::string read_file(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    throw std::runtime_error(path.string() + ": expected a file, found a folder");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  // Streaming an empty buffer sets failbit, so an empty file is told apart by its end.
  if (!file || (file.peek() != std::ifstream::traits_type::eof() && !(content << file.rdbuf())))
    throw std::runtime_error(path.string() + ": cannot be read: " + std::strerror(errno));
  return std::move(content).str();
}

bool LineReader::next(std::string_view& line) {
  if (at_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  line = text_.substr(at_, end - at_);
  if (line.ends_with('\r')) line.remove_suffix(1);
  at_ = std::min(end + 1, text_.size());
  ++line_;
  return true;
}

void LineReader::fail(const std::string& what) const {
  throw std::runtime_error(name_ + ":" + std::to_string(line_) + ": " + what);
}

std::size_t size_of(NumberType type) {
  switch (type) {
    case NumberType::int8:
    case NumberType::uint8:
      return 1;
    case NumberType::int16:
    case NumberType::uint16:
      return 2;
    case NumberType::int32:
    case NumberType::uint32:
    case NumberType::float32:
      return 4;
    case NumberType::int64:
    case NumberType::uint64:
    case NumberType::float64:
      return 8;
  }
  throw std::invalid_argument("size_of: not a number type");
}

double load_number(const char* bytes, NumberType type, bool swap) {
  switch (type) {
    case NumberType::int8:
      return load<std::int8_t>(bytes, swap);
    case NumberType::uint8:
      return load<std::uint8_t>(bytes, swap);
    case NumberType::int16:
      return load<std::int16_t>(bytes, swap);
    case NumberType::uint16:
      return load<std::uint16_t>(bytes, swap);
    case NumberType::int32:
      return load<std::int32_t>(bytes, swap);
    case NumberType::uint32:
      return load<std::uint32_t>(bytes, swap);
    case NumberType::int64:
      return static_cast<double>(load<std::int64_t>(bytes, swap));
    case NumberType::uint64:
      return static_cast<double>(load<std::uint64_t>(bytes, swap));
    case NumberType::float32:
      return load<float>(bytes, swap);
    case NumberType::float64:
      return load<double>(bytes, swap);
  }
  throw std::invalid_argument("load_number: not a number type");
}

}  // namespace minescan
