// SPDX-License-Identifier: MIT
#include "sim/drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>

namespace minescan {
namespace {

// Letters of 5 by 7 dots, rows from the top.
struct Glyph {
  char letter = ' ';
  std::string_view dots = {};
};
// clang-format off
constexpr auto glyphs = std::to_array<Glyph>({
    {'0', " ### " "#   #" "#  ##" "# # #" "##  #" "#   #" " ### "},
    {'1', "  #  " " ##  " "  #  " "  #  " "  #  " "  #  " " ### "},
    {'2', " ### " "#   #" "    #" "   # " "  #  " " #   " "#####"},
    {'3', "#####" "   # " "  #  " "   # " "    #" "#   #" " ### "},
    {'4', "   # " "  ## " " # # " "#  # " "#####" "   # " "   # "},
    {'5', "#####" "#    " "#### " "    #" "    #" "#   #" " ### "},
    {'6', "  ## " " #   " "#    " "#### " "#   #" "#   #" " ### "},
    {'7', "#####" "    #" "   # " "  #  " "  #  " "  #  " "  #  "},
    {'8', " ### " "#   #" "#   #" " ### " "#   #" "#   #" " ### "},
    {'9', " ### " "#   #" "#   #" " ####" "    #" "   # " " ##  "},
    {'.', "     " "     " "     " "     " "     " " ##  " " ##  "},
    {'-', "     " "     " "     " " ### " "     " "     " "     "},
    {'a', "     " "     " " ### " "    #" " ####" "#   #" " ####"},
    {'b', "#    " "#    " "# ## " "##  #" "#   #" "#   #" "#### "},
    {'d', "    #" "    #" " ## #" "#  ##" "#   #" "#   #" " ####"},
    {'e', "     " "     " " ### " "#   #" "#####" "#    " " ### "},
    {'f', "  ## " " #  #" " #   " "###  " " #   " " #   " " #   "},
    {'g', "     " " ####" "#   #" "#   #" " ####" "    #" " ### "},
    {'h', "#    " "#    " "# ## " "##  #" "#   #" "#   #" "#   #"},
    {'i', "  #  " "     " " ##  " "  #  " "  #  " "  #  " " ### "},
    {'l', " ##  " "  #  " "  #  " "  #  " "  #  " "  #  " " ### "},
    {'m', "     " "     " "## # " "# # #" "# # #" "# # #" "# # #"},
    {'n', "     " "     " "# ## " "##  #" "#   #" "#   #" "#   #"},
    {'o', "     " "     " " ### " "#   #" "#   #" "#   #" " ### "},
    {'p', "     " "     " "#### " "#   #" "#### " "#    " "#    "},
    {'r', "     " "     " "# ## " "##  #" "#    " "#    " "#    "},
    {'t', " #   " " #   " "###  " " #   " " #   " " #  #" "  ## "},
    {'u', "     " "     " "#   #" "#   #" "#   #" "#  ##" " ## #"},
    {'w', "     " "     " "#   #" "#   #" "# # #" "# # #" " # # "},
    {'x', "     " "     " "#   #" " # # " "  #  " " # # " "#   #"},
    {'y', "     " "     " "#   #" " # # " " # # " "  #  " "##   "},
});
// clang-format on

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 1.0) * 255 + 0.5);
}

}  // namespace

void check_edge(const char* what, int pixels) {
  if (pixels < 1 || pixels > largest_edge)
    throw std::invalid_argument(fmt::format("picture: expected a {} of 1 to {} pixels, found {}",
                                            what, largest_edge, pixels));
}

Picture blank_picture(int width, int height, const Eigen::Vector3d& colour) {
  Picture p{.width = width, .height = height};
  p.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < p.rgb.size(); ++i)
    p.rgb[i] = byte_of(colour[static_cast<Eigen::Index>(i % 3)]);
  return p;
}

std::uint8_t* pixel(Picture& p, int x, int y) {
  return &p.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) +
                     static_cast<std::size_t>(x))];
}

void set_pixel(Picture& p, int x, int y, const Eigen::Vector3d& colour) {
  std::uint8_t* rgb = pixel(p, x, y);
  for (int k = 0; k < 3; ++k) rgb[k] = byte_of(colour[k]);
}

void fill_rectangle(Picture& p, int x, int y, int width, int height,
                    const Eigen::Vector3d& colour) {
  for (int j = std::max(y, 0); j < std::min(y + height, p.height); ++j)
    for (int i = std::max(x, 0); i < std::min(x + width, p.width); ++i) set_pixel(p, i, j, colour);
}

int text_width(std::string_view text, int dot) {
  return (static_cast<int>(text.size()) * (glyph_width + 1) - 1) * dot;
}

void write_text(Picture& p, int x, int y, std::string_view text, int dot) {
  for (const char letter : text) {
    for (const Glyph& glyph : glyphs) {
      if (glyph.letter != letter) continue;
      for (int i = 0; i < glyph_width * glyph_height; ++i)
        if (glyph.dots[static_cast<std::size_t>(i)] == '#')
          fill_rectangle(p, x + i % glyph_width * dot, y + i / glyph_width * dot, dot, dot,
                         ink_colour);
    }
    x += (glyph_width + 1) * dot;
  }
}

int dot_size(int width) { return width < 400 ? 1 : std::max(2, width / 800); }

int draw_bar(Picture& p, int x, int y, int length, std::string_view label, int dot) {
  const int tick = 4 * dot;
  fill_rectangle(p, x, y - dot, length, dot, ink_colour);
  fill_rectangle(p, x, y - tick, dot, tick, ink_colour);
  fill_rectangle(p, x + length - dot, y - tick, dot, tick, ink_colour);
  const int behind = x + length + 4 * dot;
  write_text(p, behind, y - glyph_height * dot, label, dot);
  return behind + text_width(label, dot);
}

double round_length(double limit) {
  double power = 1;
  while (power > limit) power /= 10;
  while (power * 10 <= limit) power *= 10;
  if (power * 5 <= limit) return power * 5;
  return power * 2 <= limit ? power * 2 : power;
}

}  // namespace minescan
