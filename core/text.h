// SPDX-License-Identifier: MIT
// Numbers and lists as text: the one way they are written and read in files, options and messages.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace minescan {

/// The fewest digits that read back to the same double. "nan", "inf" and "-inf" are possible.
std::string number_text(double value);

/// A finite number filling the whole of `text` (blanks around it are dropped). Throws
/// std::invalid_argument naming the text otherwise: "expected a number, found '1.2.3'".
double parse_number(std::string_view text);

/// As parse_number, for whole numbers: 12, 1e6 and 100000 are, 1.5 is not; |value| <= 2^53.
std::int64_t parse_integer(std::string_view text);

/// Numbers separated by commas or white space; empty text gives an empty list.
std::vector<double> parse_numbers(std::string_view text);

/// The parts between `separator`, blanks around each dropped; empty text gives an empty list.
std::vector<std::string> split(std::string_view text, char separator);

/// "a, b, c" with the given separator.
std::string join(const std::vector<std::string>& parts, std::string_view separator);

/// Text without the blanks at both ends.
std::string_view trimmed(std::string_view text);

/// 64 bits that depend on every byte (FNV-1a, then mixed), as 16 hexadecimal digits: names for
/// rows.
std::string text_hash(std::string_view text);

/// What one says of an unknown name: "unknown method 'nd'; known: icp, ndt".
std::string unknown_name(std::string_view what, std::string_view name,
                         const std::vector<std::string>& known);

}  // namespace minescan
