// SPDX-License-Identifier: MIT
#include "formats/npy.h"

#include <fmt/format.h>

#include <bit>
#include <stdexcept>

#include "core/input_file.h"
#include "core/text.h"
#include "formats/binary.h"
#include "formats/cloud_file.h"

namespace minescan {
namespace {

constexpr std::string_view magic = "\x93NUMPY";

struct Header {
  NumberType type = NumberType::float64;
  bool swap = false;
  bool by_columns = false;  // Fortran order
  std::size_t rows = 0;
  std::size_t columns = 0;
};

// The text after "'key':" in the header, which is a Python dictionary of three entries.
std::string_view value_of(std::string_view header, std::string_view key, const std::string& name) {
  for (const char quote : {'\'', '"'}) {
    const std::string quoted = fmt::format("{0}{1}{0}", quote, key);
    const std::size_t at = header.find(quoted);
    if (at == std::string_view::npos) continue;
    const std::string_view rest = trimmed(header.substr(at + quoted.size()));
    if (rest.starts_with(':')) return trimmed(rest.substr(1));
  }
  throw std::runtime_error(fmt::format("{}: the header has no '{}'", name, key));
}

Header parse_header(std::string_view text, const std::string& name) {
  Header header;
  const std::string_view descr = value_of(text, "descr", name);
  const std::string_view type = trimmed(descr.substr(0, descr.find_first_of(",}"))).substr(0, 40);
  if (type.size() != 5 || type[0] != type[4] || (type[1] != '<' && type[1] != '>') ||
      (type.substr(2, 2) != "f4" && type.substr(2, 2) != "f8"))
    throw std::runtime_error(fmt::format(
        "{}: expected numbers of type '<f4', '<f8', '>f4' or '>f8', found {}", name, type));
  header.type = type[3] == '4' ? NumberType::float32 : NumberType::float64;
  header.swap = (type[1] == '>') != (std::endian::native == std::endian::big);

  const std::string_view order = value_of(text, "fortran_order", name);
  header.by_columns = order.starts_with("True");
  if (!header.by_columns && !order.starts_with("False"))
    throw std::runtime_error(fmt::format("{}: expected fortran_order True or False, found '{}'",
                                         name, order.substr(0, 40)));

  const std::string_view rest = value_of(text, "shape", name);
  const std::string_view shape = rest.substr(0, rest.find(')'));
  try {
    if (!shape.starts_with('(')) throw std::invalid_argument("no tuple");
    const std::vector<std::string> sizes = split(shape.substr(1), ',');
    if (sizes.size() != 2) throw std::invalid_argument("not two sizes");
    const std::int64_t rows = parse_integer(sizes[0]), columns = parse_integer(sizes[1]);
    if (rows < 0 || columns < 3) throw std::invalid_argument("sizes out of range");
    header.rows = static_cast<std::size_t>(rows);
    header.columns = static_cast<std::size_t>(columns);
  } catch (const std::invalid_argument&) {
    throw std::runtime_error(fmt::format("{}: expected the shape (N, 3) or (N, more), found {})",
                                         name, shape.substr(0, 40)));
  }
  return header;
}

}  // namespace

std::vector<Eigen::Vector3d> parse_npy(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(magic))
    throw std::runtime_error(name + ": expected '\\x93NUMPY' at the start");
  if (bytes.size() < 12)
    throw std::runtime_error(
        fmt::format("{}: the header does not end; the file has {} bytes", name, bytes.size()));
  const int version = static_cast<unsigned char>(bytes[6]);
  if (version < 1 || version > 3)
    throw std::runtime_error(fmt::format("{}: expected version 1 to 3, found {}", name, version));
  const std::size_t start = version == 1 ? 10 : 12;
  const std::size_t size = version == 1 ? load<std::uint16_t>(bytes.data() + 8, false)
                                        : load<std::uint32_t>(bytes.data() + 8, false);
  if (size > bytes.size() - start)
    throw std::runtime_error(fmt::format("{}: expected a header of {} bytes, the file has {}", name,
                                         size, bytes.size()));
  const Header header = parse_header(bytes.substr(start, size), name);
  const std::string_view data = bytes.substr(start + size);
  const std::size_t width = size_of(header.type);
  // Divided, not multiplied: sizes of 1e15 must not overflow.
  if (header.rows > data.size() / width / header.columns)
    throw std::runtime_error(fmt::format("{}: expected {} x {} numbers of {} bytes, found {}", name,
                                         header.rows, header.columns, width, data.size() / width));
  std::vector<Eigen::Vector3d> points(header.rows);
  const std::size_t row_step = header.by_columns ? 1 : header.columns;
  const std::size_t column_step = header.by_columns ? header.rows : 1;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[i][static_cast<int>(axis)] = load_number(
          data.data() + width * (i * row_step + axis * column_step), header.type, header.swap);
  return points;
}

std::string print_npy_matrix(std::size_t rows, std::size_t columns,
                             std::span<const double> values) {
  if (values.size() != rows * columns)
    throw std::invalid_argument(
        fmt::format("NPY array: expected {} x {} numbers, found {}", rows, columns, values.size()));
  std::string header =
      fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}", rows, columns);
  // Blanks and a line end, so that the numbers begin at a multiple of 64 bytes.
  header.append((64 - (magic.size() + 4 + header.size() + 1) % 64) % 64, ' ');
  header += '\n';
  std::string bytes(magic);
  bytes += '\x01';
  bytes += '\x00';
  append(bytes, static_cast<std::uint16_t>(header.size()));
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  return bytes;
}

std::string print_npy(const std::vector<Eigen::Vector3d>& points) {
  return print_npy_matrix(points.size(), 3,
                          {points.empty() ? nullptr : points[0].data(), 3 * points.size()});
}

}  // namespace minescan
