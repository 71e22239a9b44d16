// SPDX-License-Identifier: MIT
#include "core/text.h"

#include <charconv>
#include <cmath>
#include <stdexcept>

#include "core/random.h"

namespace minescan {

std::string number_text(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, end};
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

double parse_number(std::string_view text) {
  const std::string_view body = trimmed(text);
  const bool plus = body.starts_with('+');
  double value = 0;
  const auto [end, error] =
      std::from_chars(body.data() + (plus ? 1 : 0), body.data() + body.size(), value);
  if (error != std::errc() || end != body.data() + body.size() || !std::isfinite(value))
    throw std::invalid_argument("expected a number, found '" + std::string(text) + "'");
  return value;
}

std::int64_t parse_integer(std::string_view text) {
  const double value = parse_number(text);
  if (!(std::abs(value) <= 9007199254740992.0) || value != std::floor(value))
    throw std::invalid_argument("expected a whole number, found '" + std::string(text) + "'");
  return static_cast<std::int64_t>(value);
}

std::vector<double> parse_numbers(std::string_view text) {
  std::vector<double> values;
  const std::string_view separators = ", \t\r\n";
  std::size_t at = text.find_first_not_of(separators);
  while (at != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(separators, at), text.size());
    values.push_back(parse_number(text.substr(at, end - at)));
    at = text.find_first_not_of(separators, end);
  }
  return values;
}

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  if (trimmed(text).empty()) return parts;
  for (std::size_t at = 0;;) {
    const std::size_t end = text.find(separator, at);
    parts.emplace_back(trimmed(text.substr(at, end - at)));
    if (end == std::string_view::npos) return parts;
    at = end + 1;
  }
}

std::string join(const std::vector<std::string>& parts, std::string_view separator) {
  std::string text;
  for (const std::string& part : parts) {
    if (!text.empty()) text += separator;
    text += part;
  }
  return text;
}

std::string text_hash(std::string_view text) {
  constexpr char digits[] = "0123456789abcdef";
  std::uint64_t bits = derived_seed(0, text);
  std::string hex(16, '0');
  for (std::size_t i = 16; i-- > 0; bits >>= 4) hex[i] = digits[bits & 15];
  return hex;
}

std::string unknown_name(std::string_view what, std::string_view name,
                         const std::vector<std::string>& known) {
  return "unknown " + std::string(what) + " '" + std::string(name) +
         "'; known: " + join(known, ", ");
}

}  // namespace minescan
