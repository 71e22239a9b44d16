// SPDX-License-Identifier: MIT
// PNG images.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace minescan {

/// The bytes of a PNG file of width x height pixels, 3 bytes (red, green, blue) each, rows from the
/// top; equal pixels give equal bytes. Throws std::invalid_argument if `rgb` is not of that size or
/// an edge is < 1, std::runtime_error if libpng fails (it takes edges up to 1 000 000).
std::string print_png(int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace minescan
