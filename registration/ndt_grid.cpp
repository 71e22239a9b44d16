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
                    .normal = V.col(0)};
}

NdtGrid::NdtGrid(const std::vector<Eigen::Vector3d>& points, const NdtGridOptions& options)
    : lattice_(options.cell_size, options.lattice_origin) {
  const NumberedCells touched = number_cells(points, lattice_, "cell-size");
  std::vector<CellSums> sums(touched.keys.size());
  std::vector<Eigen::Vector3d> corners;
  corners.reserve(touched.keys.size());
  for (const std::uint64_t key : touched.keys) corners.push_back(lattice_.corner(key));
  // Points that follow each other mostly share their cell: its sums stay in registers meanwhile.
  for (std::size_t i = 0; i < points.size();) {
    const std::uint32_t cell = touched.cell_of[i];
    const Eigen::Vector3d corner = corners[cell];
    CellSums sum = sums[cell];
    for (; i < points.size() && touched.cell_of[i] == cell; ++i) sum.add(points[i] - corner);
    sums[cell] = sum;
  }

  for (std::size_t c = 0; c < sums.size(); ++c) {
    if (const std::optional<FittedCell> fitted = fit_cell(sums[c], corners[c], options)) {
      table_.insert(touched.keys[c]);
      cells_.push_back(fitted->cell);
      keys_.push_back(touched.keys[c]);
      normals_.push_back(fitted->normal);
    }
  }
}

}  // namespace minescan
