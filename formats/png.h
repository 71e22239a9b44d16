// SPDX-License-Identifier: MIT
// PNG images.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace minescan {

/// The bytes of a PNG file of width x height pixels, 3 bytes (red, green, blue) each, rows from the
/// top. Throws std::invalid_argument if `rgb` is not of that size or an edge is < 1.
std::string print_png(int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace minescan
