// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"

namespace minescan {
namespace {

struct Property {
  std::string name;
  NumberType type;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties = {};
  bool has_list = false;
};

struct Header {
  bool ascii = false;
  bool swap = false;
  std::vector<Element> elements = {};
  std::size_t size = 0;  // bytes
};

std::optional<NumberType> number_type(std::string_view word) {
  using enum NumberType;
  static const std::vector<std::pair<std::string_view, NumberType>> types = {
      {"char", int8},   {"uchar", uint8},   {"short", int16},     {"ushort", uint16},
      {"int", int32},   {"uint", uint32},   {"float", float32},   {"double", float64},
      {"int8", int8},   {"uint8", uint8},   {"int16", int16},     {"uint16", uint16},
      {"int32", int32}, {"uint32", uint32}, {"float32", float32}, {"float64", float64}};
  for (const auto& [name, type] : types)
    if (name == word) return type;
  return std::nullopt;
}

Header parse_header(std::string_view bytes, LineReader& lines) {
  std::string_view line;
  if (!lines.next(line) || trimmed(line) != "ply") lines.fail("expected 'ply'");
  Header header;
  bool has_format = false;
  constexpr std::size_t longest_line = 4096;  // binary rubbish has no line ends
  while (lines.next(line)) {
    if (line.size() > longest_line) lines.fail("expected a header line");
    const std::vector<std::string> words = split(trimmed(line), ' ');
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      if (!has_format) lines.fail("the header has no format line");
      header.size = lines.offset();
      return header;
    }
    if (words[0] == "format" && words.size() == 3) {
      has_format = true;
      header.ascii = words[1] == "ascii";
      const bool big = words[1] == "binary_big_endian";
      if (!header.ascii && !big && words[1] != "binary_little_endian")
        lines.fail(fmt::format("unknown format '{}'", words[1]));
      header.swap = !header.ascii && big != (std::endian::native == std::endian::big);
    } else if (words[0] == "element" && words.size() == 3) {
      try {
        const std::int64_t count = parse_integer(words[2]);
        if (count < 0) throw std::invalid_argument("negative");
        header.elements.push_back({.name = words[1], .count = static_cast<std::size_t>(count)});
      } catch (const std::invalid_argument&) {
        lines.fail(fmt::format("expected a number of elements, found '{}'", words[2]));
      }
    } else if (words[0] == "property" && words.size() >= 3 && !header.elements.empty()) {
      Element& element = header.elements.back();
      if (words[1] == "list") {
        element.has_list = true;
        continue;
      }
      const std::optional<NumberType> type = number_type(words[1]);
      if (!type) lines.fail(fmt::format("unknown type '{}'", words[1]));
      element.properties.push_back({words[2], *type});
    } else {
      lines.fail(fmt::format("expected a header line, found '{}'", line.substr(0, 40)));
    }
  }
  lines.fail(fmt::format("the header does not end; the file has {} bytes", bytes.size()));
}

}  // namespace

std::vector<Eigen::Vector3d> parse_ply(std::string_view bytes, const std::string& name) {
  LineReader lines(bytes, name);
  const Header header = parse_header(bytes, lines);
  std::size_t at = header.size;
  for (const Element& element : header.elements) {
    std::size_t stride = 0;
    std::size_t offset[3] = {};
    std::size_t index[3] = {};
    std::optional<NumberType> type[3];
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (property.name != std::string_view("xyz").substr(axis, 1)) continue;
        offset[axis] = stride;
        index[axis] = p;
        type[axis] = property.type;
      }
      stride += size_of(property.type);
    }
    const bool vertex = element.name == "vertex";
    if (vertex && !(type[0] && type[1] && type[2]))
      throw std::runtime_error(name + ": element vertex has no properties x, y and z");
    if (element.has_list)
      throw std::runtime_error(
          fmt::format("{}: element {} has lists; expected points in element vertex before it", name,
                      element.name));
    std::vector<Eigen::Vector3d> points;
    if (header.ascii) {
      std::vector<double> values;
      std::string_view line;
      for (std::size_t i = 0; i < element.count; ++i) {
        if (!lines.next(line))
          throw std::runtime_error(
              fmt::format("{}: expected {} elements {}, the file ends after {}", name,
                          element.count, element.name, i));
        if (!vertex) continue;
        read_columns(line, element.properties.size(), values, lines);
        points.emplace_back(values[index[0]], values[index[1]], values[index[2]]);
      }
    } else {
      // Divided, not multiplied: a count of 1e18 must not overflow.
      if (stride != 0 && element.count > (bytes.size() - at) / stride)
        throw std::runtime_error(
            fmt::format("{}: expected {} elements {} of {} bytes, the file ends after {}", name,
                        element.count, element.name, stride, (bytes.size() - at) / stride));
      if (vertex) points.resize(element.count);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const char* row = bytes.data() + at + i * stride;
        for (std::size_t axis = 0; axis < 3; ++axis)
          points[i][static_cast<int>(axis)] =
              load_number(row + offset[axis], *type[axis], header.swap);
      }
      at += element.count * stride;
    }
    if (vertex) return points;
  }
  throw std::runtime_error(name + ": expected an element vertex");
}

std::string print_ply(const std::vector<Eigen::Vector3d>& points) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\nend_header\n",
      points.size());
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(points[0]));
  return bytes;
}

}  // namespace minescan
