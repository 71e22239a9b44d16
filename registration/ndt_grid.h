// SPDX-License-Identifier: MIT
// The target of 3D-NDT: a normal distribution for every cell of space that holds enough points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/fields.h"
#include "registration/lattice.h"

namespace minescan {

/// The normal distribution of the points in one cell, scaled to 1 at its mean (paper: c = 1).
struct NdtCell {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  /// Inverse covariance, 1/m^2: xx, xy, xz, yy, yz, zz.
  std::array<double, 6> information = {};
};

/// The inverse covariance of a cell as a matrix.
Eigen::Matrix3d information_matrix(const NdtCell& cell);

struct NdtGridOptions {
  double cell_size = 1.0;   // metres; paper, section 5
  int min_cell_points = 5;  // paper, section 5
  // A cell's covariance is widened until no eigenvalue is below the largest / this ratio: the paper
  // leaves singular covariances open; 100 is Magnusson's later choice (thesis 2009, eq. 6.11).
  double eigenvalue_ratio = 100;
  // A corner of the lattice, metres in the target frame. The scanner itself by default, so that
  // cells do not depend on which points a scan happens to have.
  Eigen::Vector3d lattice_origin = Eigen::Vector3d::Zero();
};

template <class Visitor>
void fields(NdtGridOptions& o, Visitor&& field) {
  field("cell-size", o.cell_size, between(0.001, 1000), "m", "side of a cell");
  field("min-cell-points", o.min_cell_points, between(4, 1e6), "", "points that a cell needs");
  field("eigenvalue-ratio", o.eigenvalue_ratio, between(1, 1e9), "",
        "largest ratio of the eigenvalues of a cell's covariance; small ones are raised to it");
  field("lattice-x", o.lattice_origin.x(), between(-1000, 1000), "m", "a corner of the lattice");
  field("lattice-y", o.lattice_origin.y(), between(-1000, 1000), "m", "a corner of the lattice");
  field("lattice-z", o.lattice_origin.z(), between(-1000, 1000), "m", "a corner of the lattice");
}

/// Sums over the points of one cell. Points are taken relative to the cell's corner: sums of
/// squares of coordinates far from the origin would lose the thickness of a wall to rounding.
struct CellSums {
  double count = 0;
  std::array<double, 3> sum = {};
  std::array<double, 6> products = {};  // xx, xy, xz, yy, yz, zz

  void add(const Eigen::Vector3d& offset) {
    const double x = offset.x(), y = offset.y(), z = offset.z();
    count += 1;
    sum[0] += x, sum[1] += y, sum[2] += z;
    products[0] += x * x, products[1] += x * y, products[2] += x * z;
    products[3] += y * y, products[4] += y * z, products[5] += z * z;
  }
  /// The sums of another cell, whose corner is `offset` away from this one's.
  void add(const CellSums& other, const Eigen::Vector3d& offset);
};

/// What the points of a cloud add up to in every cell that they touch, from which distributions are
/// made, and the sums of cells twice as large.
struct SummedCells {
  Lattice lattice;
  std::vector<std::uint64_t> keys = {};  // in the order in which the cloud first touches them
  std::vector<CellSums> sums = {};       // about the cell's corner; also of too few points
};

/// cost    O(N) time; O(cells that hold a point) memory
/// throws  std::invalid_argument for a point more than 2^20 cells away from the lattice's origin
SummedCells sum_cells(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice);

/// The same points in cells twice as large: what sum_cells would return for them, but for rounding
/// (paper, section 4.3.4, proposes it). O(cells).
SummedCells twice_as_large(const SummedCells& cells);

/// The distribution of a cell's points (paper, eqs 2 and 3, divisor n - 1) with its eigenvalues
/// raised to the largest / eigenvalue_ratio, and the unit vector along which it is thinnest: on a
/// wall, the normal.
struct FittedCell {
  NdtCell cell = {};
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double thinnest = 0;  // variance along the normal before it was raised, m^2
};

/// None if there are fewer than min_cell_points or if all points coincide.
std::optional<FittedCell> fit_cell(const CellSums& sums, const Eigen::Vector3d& corner,
                                   const NdtGridOptions& options);

/// All cells of a cloud.
class NdtGrid {
 public:
  /// cost    O(N) time; O(cells that hold a point) memory
  /// throws  std::invalid_argument for a point more than 2^20 cells away from the lattice's origin
  NdtGrid(const std::vector<Eigen::Vector3d>& points, const NdtGridOptions& options);
  /// Of points that are summed already, in the lattice of the sums.
  NdtGrid(const SummedCells& cells, const NdtGridOptions& options);

  /// The cell that holds `p`, or null where there is no distribution.
  const NdtCell* find(const Eigen::Vector3d& p) const {
    const std::uint64_t key = lattice_.key(p);
    const std::uint32_t number = table_.find(key);
    return number == KeyTable::not_found ? nullptr : &cells_[number];
  }
  /// Those with a distribution, in the order in which the cloud first touches them.
  const std::vector<NdtCell>& cells() const { return cells_; }
  /// Their keys in lattice().
  const std::vector<std::uint64_t>& keys() const { return keys_; }
  const Lattice& lattice() const { return lattice_; }
  /// The direction in which a cell of this grid is thinnest.
  const Eigen::Vector3d& normal(const NdtCell& cell) const {
    return normals_[static_cast<std::size_t>(&cell - cells_.data())];
  }
  std::size_t bytes() const {
    return cells_.size() * (sizeof(NdtCell) + sizeof(keys_[0]) + sizeof(normals_[0])) +
           table_.bytes();
  }

 private:
  Lattice lattice_;
  KeyTable table_;
  std::vector<NdtCell> cells_;
  std::vector<std::uint64_t> keys_;
  std::vector<Eigen::Vector3d> normals_;  // apart from the cells: needed once, at the end
};

}  // namespace minescan
