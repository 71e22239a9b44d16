// SPDX-License-Identifier: MIT
#include "formats/png.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

#include "core/random.h"

namespace minescan {
namespace {

using Bytes = std::vector<std::uint8_t>;

// What a PNG file holds, by libpng's reader.
struct Decoded {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  Bytes rgb = {};
};
Decoded decoded(const std::string& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, file.data(), file.size()), 0) << image.message;
  EXPECT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_RGB));
  EXPECT_EQ(image.warning_or_error, 0u) << image.message;
  image.format = PNG_FORMAT_RGB;
  Decoded result{.width = image.width, .height = image.height};
  result.rgb.resize(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, result.rgb.data(), 0, nullptr), 0)
      << image.message;
  return result;
}

std::uint32_t big_endian(const std::string& file, std::size_t place) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i)
    number = number << 8 | static_cast<std::uint8_t>(file.at(place + i));
  return number;
}

Bytes random_pixels(int width, int height) {
  Random random(1, 0);
  Bytes rgb(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::uint8_t& value : rgb) value = static_cast<std::uint8_t>(random.below(256));
  return rgb;
}

// Signature and header as in section 5.2 and 11.2.1 of the PNG specification (W3C, 2003).
TEST(Png, BeginsWithSignatureAndHeader) {
  const std::string file = print_png(3, 2, random_pixels(3, 2));
  ASSERT_GT(file.size(), 33u);
  EXPECT_EQ(file.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(big_endian(file, 8), 13u);
  EXPECT_EQ(file.substr(12, 4), "IHDR");
  EXPECT_EQ(big_endian(file, 16), 3u);
  EXPECT_EQ(big_endian(file, 20), 2u);
  EXPECT_EQ(file[24], 8);  // bits per sample
  EXPECT_EQ(file[25], 2);  // red, green, blue
}

// Random pixels cannot be compressed, so the file must be allowed to be larger than they are.
TEST(Png, IsReadBackAsItWasWritten) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, std::pair{1, 3000}, std::pair{3000, 1}, std::pair{641, 479}}) {
    const Bytes rgb = random_pixels(width, height);
    const Decoded read = decoded(print_png(width, height, rgb));
    EXPECT_EQ(read.width, static_cast<std::uint32_t>(width));
    EXPECT_EQ(read.height, static_cast<std::uint32_t>(height));
    EXPECT_EQ(read.rgb, rgb) << width << " x " << height;
  }
}

TEST(Png, HasTheSameBytesEachTime) {
  const Bytes rgb = random_pixels(64, 48);
  EXPECT_EQ(print_png(64, 48, rgb), print_png(64, 48, rgb));
}

TEST(Png, CompressesEvenColours) {
  const Bytes grey(3 * 1000 * 1000, 128);
  EXPECT_LT(print_png(1000, 1000, grey).size(), grey.size() / 100);
}

TEST(Png, RefusesSizesThatDoNotFit) {
  const Bytes rgb(12);
  EXPECT_NO_THROW(print_png(2, 2, rgb));
  for (const auto& [width, height] :
       {std::pair{0, 4}, std::pair{4, 0}, std::pair{-2, -2}, std::pair{2, 3}, std::pair{1, 2}})
    EXPECT_THROW(print_png(width, height, rgb), std::invalid_argument) << width << " x " << height;
  // 3 (2^17 + 2) 2^15 is this in 32 bits.
  EXPECT_THROW(print_png(131074, 32768, Bytes(196608)), std::invalid_argument);
  const int most = std::numeric_limits<int>::max();
  EXPECT_THROW(print_png(most, most, rgb), std::invalid_argument);
  try {
    print_png(2, 3, rgb);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "PNG image: expected 18 bytes for 2 x 3 pixels, found 12");
  }
}

// libpng takes edges up to a million pixels.
TEST(Png, PassesOnWhatLibpngSays) {
  EXPECT_THROW(print_png(2000000, 1, Bytes(6000000)), std::runtime_error);
}

}  // namespace
}  // namespace minescan
