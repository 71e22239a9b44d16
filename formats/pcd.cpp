// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <lzf.h>

#include <bit>
#include <map>
#include <optional>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/columns.h"

namespace minescan {
namespace {

struct Header {
  std::vector<std::string> fields = {}, sizes = {}, types = {}, counts = {};
  std::size_t points = 0;
  std::string data = {};
};

// Where a coordinate is: column in text, byte within a point, byte per point of all fields before.
struct Coordinate {
  std::optional<NumberType> type = {};
  std::size_t column = 0;
  std::size_t offset = 0;
};

struct Layout {
  Coordinate axes[3] = {};
  std::size_t columns = 0;
  std::size_t stride = 0;
};

std::size_t parse_count(const std::string& word, const LineReader& lines) {
  try {
    const std::int64_t count = parse_integer(word);
    if (count >= 0) return static_cast<std::size_t>(count);
  } catch (const std::invalid_argument&) {
    // told below
  }
  lines.fail(fmt::format("expected a count, found '{}'", word));
}

Header parse_header(LineReader& lines) {
  Header header;
  constexpr std::size_t longest_line = 4096;  // binary rubbish has no line ends
  for (std::string_view line; lines.next(line);) {
    if (line.size() > longest_line) lines.fail("expected a header line of a PCD file");
    std::vector<std::string> words = split(trimmed(line), ' ');
    std::erase(words, "");
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string key = words[0];
    words.erase(words.begin());
    if (key == "FIELDS" || key == "COLUMNS")
      header.fields = words;
    else if (key == "SIZE")
      header.sizes = words;
    else if (key == "TYPE")
      header.types = words;
    else if (key == "COUNT")
      header.counts = words;
    else if (key == "POINTS" && words.size() == 1)
      header.points = parse_count(words[0], lines);
    else if (key == "DATA" && words.size() == 1) {
      header.data = words[0];
      return header;
    } else if (key != "VERSION" && key != "WIDTH" && key != "HEIGHT" && key != "VIEWPOINT")
      lines.fail(
          fmt::format("expected a header line of a PCD file, found '{}'", key.substr(0, 40)));
  }
  lines.fail("the header has no DATA line");
}

NumberType number_type(const std::string& type, const std::string& size, const LineReader& lines) {
  using enum NumberType;
  static const std::map<std::string, NumberType> types = {
      {"I1", int8},   {"U1", uint8}, {"I2", int16},  {"U2", uint16},  {"I4", int32},
      {"U4", uint32}, {"I8", int64}, {"U8", uint64}, {"F4", float32}, {"F8", float64}};
  const auto found = types.find(type + size);
  if (found == types.end()) lines.fail(fmt::format("unknown TYPE {} with SIZE {}", type, size));
  return found->second;
}

Layout layout_of(const Header& header, const LineReader& lines) {
  const std::size_t n = header.fields.size();
  if (n == 0 || header.sizes.size() != n || header.types.size() != n ||
      (!header.counts.empty() && header.counts.size() != n))
    lines.fail("FIELDS, SIZE, TYPE and COUNT differ in length or are missing");
  Layout layout;
  for (std::size_t f = 0; f < n; ++f) {
    const NumberType type = number_type(header.types[f], header.sizes[f], lines);
    const std::size_t count = header.counts.empty() ? 1 : parse_count(header.counts[f], lines);
    if (count > 1'000'000)
      lines.fail(fmt::format("COUNT {} of field {} is out of range", count, header.fields[f]));
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (header.fields[f] == std::string_view("xyz").substr(axis, 1) && count == 1)
        layout.axes[axis] = {type, layout.columns, layout.stride};
    layout.columns += count;
    layout.stride += count * size_of(type);
  }
  for (const Coordinate& axis : layout.axes)
    if (!axis.type) lines.fail("expected the fields x, y and z");
  return layout;
}

[[noreturn]] void fail_truncated(const std::string& name, std::size_t expected, std::size_t found) {
  throw std::runtime_error(
      fmt::format("{}: expected {} points, the file ends after {}", name, expected, found));
}

}  // namespace

std::vector<Eigen::Vector3d> parse_pcd(std::string_view bytes, const std::string& name) {
  LineReader lines(bytes, name);
  const Header header = parse_header(lines);
  const Layout layout = layout_of(header, lines);
  std::vector<Eigen::Vector3d> points;

  if (header.data == "ascii") {
    std::vector<double> values;
    std::string_view line;
    while (points.size() < header.points && lines.next(line)) {
      if (trimmed(line).empty()) continue;
      read_columns(trimmed(line), layout.columns, values, lines);
      points.emplace_back(values[layout.axes[0].column], values[layout.axes[1].column],
                          values[layout.axes[2].column]);
    }
    if (points.size() < header.points) fail_truncated(name, header.points, points.size());
    return points;
  }

  std::string_view data = bytes.substr(lines.offset());
  std::string unpacked;
  const bool compressed = header.data == "binary_compressed";
  if (compressed) {
    // Two sizes, then LZF; the fields follow one another, each for all points.
    if (data.size() < 8) fail_truncated(name, header.points, 0);
    const std::size_t packed_size = load<std::uint32_t>(data.data(), false);
    const std::size_t size = load<std::uint32_t>(data.data() + 4, false);
    data.remove_prefix(8);
    if (packed_size > data.size())
      throw std::runtime_error(fmt::format("{}: expected {} bytes of compressed points, found {}",
                                           name, packed_size, data.size()));
    // LZF packs at most about 264 : 1; more is rubbish that must not be allocated.
    if (size > 300 * packed_size + 1024)
      throw std::runtime_error(
          fmt::format("{}: {} bytes cannot unpack to {}", name, packed_size, size));
    unpacked.resize(size);
    if (size != 0 && lzf_decompress(data.data(), static_cast<unsigned>(packed_size),
                                    unpacked.data(), static_cast<unsigned>(size)) != size)
      throw std::runtime_error(name + ": the compressed points are damaged");
    data = unpacked;
  } else if (header.data != "binary") {
    throw std::runtime_error(fmt::format(
        "{}: unknown DATA '{}'; known: ascii, binary, binary_compressed", name, header.data));
  }
  if (header.points > data.size() / layout.stride)
    fail_truncated(name, header.points, data.size() / layout.stride);
  points.resize(header.points);
  for (int axis = 0; axis < 3; ++axis) {
    const Coordinate& at = layout.axes[axis];
    const std::size_t step = compressed ? size_of(*at.type) : layout.stride;
    const char* first = data.data() + at.offset * (compressed ? header.points : 1);
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i][axis] = load_number(first + i * step, *at.type, false);
  }
  return points;
}

std::string print_pcd(const std::vector<Eigen::Vector3d>& points) {
  std::string bytes = fmt::format(
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  static_assert(std::endian::native == std::endian::little);
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3f single = point.cast<float>();
    bytes.append(reinterpret_cast<const char*>(single.data()), sizeof single);
  }
  return bytes;
}

}  // namespace minescan
