// SPDX-License-Identifier: MIT
// Numbers into little-endian bytes; the way back is load in core/input_file.h.
#pragma once

#include <bit>
#include <cstring>
#include <string>

namespace minescan {

/// Writes the bytes of `value` to `to`.
template <class T>
void store(char* to, T value) {
  static_assert(std::endian::native == std::endian::little);
  std::memcpy(to, &value, sizeof value);
}

/// Appends the bytes of `value`.
template <class T>
void append(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace minescan
