// SPDX-License-Identifier: MIT
#include "formats/columns.h"

#include <fmt/format.h>

#include <charconv>

namespace minescan {

double read_number(std::string_view word, const LineReader& lines) {
  const std::size_t sign = word.starts_with('+') ? 1 : 0;  // from_chars does not take it
  double value = 0;
  const auto [stop, error] = std::from_chars(word.data() + sign, word.data() + word.size(), value);
  if (error != std::errc() || stop != word.data() + word.size())
    lines.fail(fmt::format("expected a number, found '{}'", word.substr(0, 40)));
  return value;
}

void read_columns(std::string_view line, std::size_t count, std::vector<double>& values,
                  const LineReader& lines) {
  constexpr std::string_view separators = " \t,";
  values.clear();
  std::size_t at = line.find_first_not_of(separators);
  while (values.size() < count && at != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(separators, at), line.size());
    values.push_back(read_number(line.substr(at, end - at), lines));
    at = line.find_first_not_of(separators, end);
  }
  if (values.size() < count)
    lines.fail(fmt::format("expected {} numbers, found {}", count, values.size()));
}

}  // namespace minescan
