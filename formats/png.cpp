// SPDX-License-Identifier: MIT
#include "formats/png.h"

#include <fmt/format.h>
#include <png.h>

#include <stdexcept>

namespace minescan {

std::string print_png(int width, int height, std::span<const std::uint8_t> rgb) {
  if (width < 1 || height < 1)
    throw std::invalid_argument(
        fmt::format("PNG image: expected edges of at least 1 pixel, found {} x {}", width, height));
  const std::uint64_t expected =
      3 * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  if (rgb.size() != expected)
    throw std::invalid_argument(
        fmt::format("PNG image: expected {} bytes for {} x {} pixels, found {}", expected, width,
                    height, rgb.size()));

  // The simplified interface: its errors come back as a message, no jump passes through here.
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  // Room for the worst case; to ask for the exact size is to compress twice. libpng's macro for
  // that computes in 32 bits: a filter byte per row, and zlib's bound for what cannot be
  // compressed, generously with 1 / 512, 12 bytes around each 8192 and 4096 for the rest.
  const std::uint64_t raw = expected + static_cast<std::uint64_t>(height);
  std::string bytes(raw + raw / 512 + 12 * (raw / 8192 + 1) + 4096, '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0)
    throw std::runtime_error(
        fmt::format("PNG image of {} x {} pixels: {}", width, height, image.message));
  bytes.resize(size);
  return bytes;
}

}  // namespace minescan
