// SPDX-License-Identifier: MIT
#include "registration/ndt_field.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace minescan {

NdtField::Row row_of(const NdtCell& cell, const Eigen::Vector3d& normal,
                     const Eigen::Vector3d& corner) {
  NdtField::Row row;
  for (int i = 0; i < 3; ++i) {
    row.mean[i] = static_cast<float>(cell.mean[i] - corner[i]);
    row.normal[i] = static_cast<float>(normal[i]);
  }
  const Eigen::Matrix3d L = information_matrix(cell);
  row.set_information(L);
  row.log_peak =
      static_cast<float>(std::log(L.determinant()) / 2 - 1.5 * std::log(2 * std::numbers::pi));
  return row;
}

NdtField::Row unmet_row() {
  NdtField::Row row;
  for (float& x : row.mean) x = nowhere;
  row.set_information(Eigen::Matrix3d::Identity());
  return row;
}

std::optional<NdtField> ndt_field(const NdtGrid& grid, int margin) {
  if (grid.cells().empty()) return {};
  std::array<int, 3> low = Lattice::indices(grid.keys().front()), high = low;
  for (const std::uint64_t key : grid.keys()) {
    const std::array<int, 3> at = Lattice::indices(key);
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], at[i]);
      high[i] = std::max(high[i], at[i]);
    }
  }
  NdtField field{.side = grid.lattice().side()};
  double cells = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] -= margin;
    field.size[i] = high[i] + margin - low[i] + 1;
    cells *= field.size[i];
  }
  if (cells > max_field_cells) return {};
  field.corner = grid.lattice().corner(low);
  field.number.assign(static_cast<std::size_t>(cells), -1);
  field.rows.resize(grid.cells().size() + 1);
  field.rows.back() = unmet_row();
  for (std::size_t c = 0; c < grid.cells().size(); ++c) {
    const std::array<int, 3> at = Lattice::indices(grid.keys()[c]);
    const std::int32_t x = at[0] - low[0], y = at[1] - low[1], z = at[2] - low[2];
    field.number[static_cast<std::size_t>((z * field.size[1] + y) * field.size[0] + x)] =
        static_cast<std::int32_t>(c);
    field.rows[c] = row_of(grid.cells()[c], grid.normal(grid.cells()[c]), field.corner);
  }
  return field;
}

void NdtField::store(Storage storage) {
  if (storage == Storage::dense) return;
  stored.emplace(number, size, storage);
  number = {};
}

void NdtField::Row::set_information(const Eigen::Matrix3d& L) {
  const double list[6] = {L(0, 0), L(0, 1), L(0, 2), L(1, 1), L(1, 2), L(2, 2)};
  for (int i = 0; i < 6; ++i) information[i] = static_cast<float>(list[i]);
}

namespace {

/// What a cell is linked to, and how far away that is.
struct Link {
  std::int32_t number = -1;
  double squared = std::numeric_limits<double>::infinity();  // distance, in cells
};

/// Links along one line of cells: the lower envelope of parabolas, one over each cell that has a
/// link already (the distance transform of Felzenszwalb and Huttenlocher 2012). `line` is a copy of
/// the line before, `seats` the parabolas of the envelope with the places where they begin.
void link_line(Link* first, std::size_t stride, std::size_t count, std::vector<Link>& line,
               std::vector<std::pair<double, std::size_t>>& seats) {
  line.resize(count);
  seats.clear();
  const auto height = [&](std::size_t seat) {
    const auto at = static_cast<double>(seat);
    return line[seat].squared + at * at;
  };
  for (std::size_t i = 0; i < count; ++i) {
    line[i] = first[i * stride];
    if (line[i].number < 0) continue;
    double begin = -std::numeric_limits<double>::infinity();
    while (!seats.empty()) {
      const std::size_t last = seats.back().second;
      begin =
          (height(i) - height(last)) / (2 * (static_cast<double>(i) - static_cast<double>(last)));
      if (begin > seats.back().first) break;
      seats.pop_back();
      begin = -std::numeric_limits<double>::infinity();
    }
    seats.emplace_back(begin, i);
  }
  std::size_t k = 0;
  for (std::size_t i = 0; i < count && !seats.empty(); ++i) {
    while (k + 1 < seats.size() && seats[k + 1].first < static_cast<double>(i)) ++k;
    const std::size_t seat = seats[k].second;
    const double away = static_cast<double>(i) - static_cast<double>(seat);
    first[i * stride] = {.number = line[seat].number, .squared = line[seat].squared + away * away};
  }
}

}  // namespace

void link_cells(NdtField& field) {
  const auto nx = static_cast<std::size_t>(field.size[0]),
             ny = static_cast<std::size_t>(field.size[1]),
             nz = static_cast<std::size_t>(field.size[2]);
  std::vector<Link> links(field.number.size());
  for (std::size_t i = 0; i < links.size(); ++i)
    if (field.number[i] >= 0) links[i] = {.number = field.number[i], .squared = 0};
  std::vector<Link> line;
  std::vector<std::pair<double, std::size_t>> seats;
  for (std::size_t i = 0; i < ny * nz; ++i) link_line(&links[i * nx], 1, nx, line, seats);
  for (std::size_t z = 0; z < nz; ++z)
    for (std::size_t x = 0; x < nx; ++x) link_line(&links[z * ny * nx + x], nx, ny, line, seats);
  for (std::size_t i = 0; i < nx * ny; ++i) link_line(&links[i], nx * ny, nz, line, seats);
  for (std::size_t i = 0; i < links.size(); ++i) field.number[i] = links[i].number;
}

std::int32_t NdtField::nearest_row(const Eigen::Vector3d& from_corner) const {
  return static_cast<std::int32_t>(
      means->nearest(from_corner, std::numeric_limits<double>::infinity())->index);
}

void link_points(NdtField& field) {
  if (field.rows.size() < 2) return;
  std::vector<Eigen::Vector3d> means;
  for (auto row = field.rows.begin(); row + 1 != field.rows.end(); ++row)
    means.emplace_back(static_cast<double>(row->mean[0]), static_cast<double>(row->mean[1]),
                       static_cast<double>(row->mean[2]));
  field.means = std::make_shared<const KdTree>(means);
}

void link_cells_by_mean(NdtField& field) {
  link_points(field);
  if (!field.means) return;
  std::size_t cell = 0;
  for (int z = 0; z < field.size[2]; ++z)
    for (int y = 0; y < field.size[1]; ++y)
      for (int x = 0; x < field.size[0]; ++x, ++cell)
        if (field.number[cell] < 0)
          field.number[cell] =
              field.nearest_row(field.side * (Eigen::Vector3d(x, y, z).array() + 0.5));
  field.means.reset();
}

NdtField checked_ndt_field(const NdtGrid& grid, int margin) {
  std::optional<NdtField> field = ndt_field(grid, margin);
  if (field) return *std::move(field);
  if (!grid.cells().empty()) throw_too_many_cells(grid.lattice().side());
  return {};
}

void throw_too_many_cells(double side) {
  throw std::invalid_argument(
      fmt::format("cell-size: the box around the cells of {} m that hold enough points has more "
                  "than 2^24 cells; choose larger cells or leave out far points",
                  side));
}

}  // namespace minescan
