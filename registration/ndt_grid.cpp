// SPDX-License-Identifier: MIT
#include "registration/ndt_grid.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace minescan {

Eigen::Matrix3d information_matrix(const NdtCell& cell) {
  const auto& [xx, xy, xz, yy, yz, zz] = cell.information;
  Eigen::Matrix3d L;
  L << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return L;
}

void CellSums::add(const CellSums& other, const Eigen::Vector3d& offset) {
  const double x = offset.x(), y = offset.y(), z = offset.z();
  const auto [sx, sy, sz] = other.sum;
  const double n = other.count;
  count += n;
  sum[0] += sx + n * x, sum[1] += sy + n * y, sum[2] += sz + n * z;
  const double more[6] = {(2 * sx + n * x) * x,      sx * y + (sy + n * y) * x,
                          sx * z + (sz + n * z) * x, (2 * sy + n * y) * y,
                          sy * z + (sz + n * z) * y, (2 * sz + n * z) * z};
  for (std::size_t i = 0; i < 6; ++i) products[i] += other.products[i] + more[i];
}

std::optional<FittedCell> fit_cell(const CellSums& sums, const Eigen::Vector3d& corner,
                                   const NdtGridOptions& options) {
  const double n = sums.count;
  if (!(n >= options.min_cell_points)) return {};

  const Eigen::Vector3d q = Eigen::Vector3d(sums.sum.data()) / n;  // eq. 2
  const auto& [xx, xy, xz, yy, yz, zz] = sums.products;
  Eigen::Matrix3d C;  // eq. 3
  C << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  C = (C - n * q * q.transpose()) / (n - 1);

  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(C);  // a third of the time; eigenvalues are exact to 1e-15 of the largest
  const double largest = solver.eigenvalues()[2];
  // Points that coincide leave a variance of up to 1e-14 squared cells, by rounding.
  const double rounding = 1e-6 * options.cell_size;
  if (!(largest > rounding * rounding)) return {};

  const Eigen::Vector3d inverse =
      solver.eigenvalues().cwiseMax(largest / options.eigenvalue_ratio).cwiseInverse();
  const Eigen::Matrix3d& V = solver.eigenvectors();
  const Eigen::Matrix3d L = V * inverse.asDiagonal() * V.transpose();
  return FittedCell{.cell = {.mean = corner + q,
                             .information = {L(0, 0), L(0, 1), L(0, 2), L(1, 1), L(1, 2), L(2, 2)}},
                    .normal = V.col(0),
                    .thinnest = std::max(0.0, solver.eigenvalues()[0])};
}

SummedCells sum_cells(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice) {
  NumberedCells touched = number_cells(points, lattice, "cell-size");
  SummedCells cells{.lattice = lattice, .keys = std::move(touched.keys)};
  cells.sums.resize(cells.keys.size());
  std::vector<Eigen::Vector3d> corners;
  corners.reserve(cells.keys.size());
  for (const std::uint64_t key : cells.keys) corners.push_back(lattice.corner(key));
  // Points that follow each other mostly share their cell: its sums stay in registers meanwhile.
  for (std::size_t i = 0; i < points.size();) {
    const std::uint32_t cell = touched.cell_of[i];
    const Eigen::Vector3d corner = corners[cell];
    CellSums sum = cells.sums[cell];
    for (; i < points.size() && touched.cell_of[i] == cell; ++i) sum.add(points[i] - corner);
    cells.sums[cell] = sum;
  }
  return cells;
}

SummedCells twice_as_large(const SummedCells& cells) {
  SummedCells large{.lattice = Lattice(2 * cells.lattice.side(), cells.lattice.origin())};
  KeyTable table;
  for (std::size_t c = 0; c < cells.keys.size(); ++c) {
    const std::array<int, 3> at = Lattice::indices(cells.keys[c]);
    const std::uint64_t key =
        Lattice::key(std::array<int, 3>{at[0] >> 1, at[1] >> 1, at[2] >> 1});  // rounds down
    const std::uint32_t number = table.insert(key);
    if (number == large.keys.size()) {
      large.keys.push_back(key);
      large.sums.emplace_back();
    }
    const double side = cells.lattice.side();
    large.sums[number].add(cells.sums[c],
                           {side * (at[0] & 1), side * (at[1] & 1), side * (at[2] & 1)});
  }
  return large;
}

NdtGrid::NdtGrid(const std::vector<Eigen::Vector3d>& points, const NdtGridOptions& options)
    : NdtGrid(sum_cells(points, Lattice(options.cell_size, options.lattice_origin)), options) {}

NdtGrid::NdtGrid(const SummedCells& cells, const NdtGridOptions& options)
    : lattice_(cells.lattice) {
  NdtGridOptions of_lattice = options;
  of_lattice.cell_size = lattice_.side();
  for (std::size_t c = 0; c < cells.keys.size(); ++c) {
    const Eigen::Vector3d corner = lattice_.corner(cells.keys[c]);
    if (const std::optional<FittedCell> fitted = fit_cell(cells.sums[c], corner, of_lattice)) {
      table_.insert(cells.keys[c]);
      cells_.push_back(fitted->cell);
      keys_.push_back(cells.keys[c]);
      normals_.push_back(fitted->normal);
    }
  }
}

}  // namespace minescan
