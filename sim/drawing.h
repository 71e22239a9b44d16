// SPDX-License-Identifier: MIT
// What pictures are drawn with: rectangles, letters of 5 by 7 dots, scale bars. Colours are red,
// green, blue in [0, 1]; what pictures look like was chosen by eye.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "sim/picture.h"

namespace minescan {

/// Longest edge of a picture, pixels: three bytes for each of 16384^2 are 0.8 GB.
inline constexpr int largest_edge = 16384;

/// Of letters and bars, and of what is behind everything.
inline const Eigen::Vector3d ink_colour(1, 1, 1);
inline const Eigen::Vector3d ground_colour(0.13, 0.13, 0.15);

/// Size of a letter, in dots.
inline constexpr int glyph_width = 5;
inline constexpr int glyph_height = 7;

/// Throws std::invalid_argument, naming the edge, unless 1 <= pixels <= largest_edge.
void check_edge(const char* what, int pixels);

/// A picture of one colour.
Picture blank_picture(int width, int height, const Eigen::Vector3d& colour);

/// The three bytes of a pixel.
std::uint8_t* pixel(Picture& p, int x, int y);
void set_pixel(Picture& p, int x, int y, const Eigen::Vector3d& colour);

/// Fills the part of the rectangle that is on the picture; x, y is its upper left corner.
void fill_rectangle(Picture& p, int x, int y, int width, int height, const Eigen::Vector3d& colour);

/// Pixels per dot of a letter, so that text can be read on a picture of that width shown entirely.
int dot_size(int width);

/// Pixels that a line of text takes.
int text_width(std::string_view text, int dot);

/// Writes with the upper left corner at x, y; letters without a glyph stay blank.
void write_text(Picture& p, int x, int y, std::string_view text, int dot);

/// A bar of `length` pixels between two ticks, their bottom at y, and the label behind it. Returns
/// where the label ends.
int draw_bar(Picture& p, int x, int y, int length, std::string_view label, int dot);

/// The longest of 1, 2, 5 times a power of ten that is not above `limit`.
double round_length(double limit);

}  // namespace minescan
