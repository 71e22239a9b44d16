// SPDX-License-Identifier: MIT
// Numbers in a line of a text file.
#pragma once

#include <string_view>
#include <vector>

#include "core/input_file.h"

namespace minescan {

/// The number that fills the whole of `word`; nan and inf are numbers here. Fails through `lines`
/// (with file and line) if it is none.
double read_number(std::string_view word, const LineReader& lines);

/// The first `count` numbers of `line`, separated by blanks or commas; nan and inf are numbers
/// here. Fails through `lines` if there are fewer or one is none.
void read_columns(std::string_view line, std::size_t count, std::vector<double>& values,
                  const LineReader& lines);

}  // namespace minescan
