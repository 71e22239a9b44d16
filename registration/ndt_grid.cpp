// SPDX-License-Identifier: MIT
#include "registration/ndt_grid.h"

#include <Eigen/Eigenvalues>

namespace minescan {

Eigen::Matrix3d information_matrix(const NdtCell& cell) {
  const auto& [xx, xy, xz, yy, yz, zz] = cell.information;
  Eigen::Matrix3d L;
  L << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return L;
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

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(C);
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
                    .normal = V.col(0)};
}

NdtGrid::NdtGrid(const std::vector<Eigen::Vector3d>& points, const NdtGridOptions& options)
    : lattice_(options.cell_size, options.lattice_origin) {
  struct TouchedCell {
    std::uint64_t key = 0;
    Eigen::Vector3d corner = {};
    CellSums sums = {};
  };
  KeyTable touched;
  std::vector<TouchedCell> touched_cells;
  std::uint64_t last_key = Lattice::no_key;
  std::uint32_t last = 0;
  for (const Eigen::Vector3d& p : points) {
    const std::uint64_t key = lattice_.checked_key(p, "cell-size");
    if (key != last_key) {  // neighbours in a scan mostly share their cell
      last_key = key;
      last = touched.insert(key);
      if (last == touched_cells.size())
        touched_cells.push_back({.key = key, .corner = lattice_.corner(key)});
    }
    TouchedCell& cell = touched_cells[last];
    cell.sums.add(p - cell.corner);
  }

  for (const TouchedCell& cell : touched_cells) {
    if (const std::optional<FittedCell> fitted = fit_cell(cell.sums, cell.corner, options)) {
      table_.insert(cell.key);
      cells_.push_back(fitted->cell);
      normals_.push_back(fitted->normal);
    }
  }
}

}  // namespace minescan
