// SPDX-License-Identifier: MIT
// The cells of 3D-NDT laid out for the processor: a box with the number of a distribution for each
// cell. registration/ndt_sums.h sums over points with it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "registration/cell_numbers.h"
#include "registration/kdtree.h"
#include "registration/ndt_grid.h"

namespace minescan {

/// A coordinate, metres, that no point of a cloud has: of what fills up registers.
inline constexpr float nowhere = 1e9f;

/// A box of cells, each with the number of the distribution that points in it are scored with.
struct NdtField {
  /// What one distribution takes, relative to `corner`.
  struct Row {
    float mean[3] = {};
    float information[6] = {};  // xx, xy, xz, yy, yz, zz; 1/m^2
    float normal[3] = {};
    float height = 1;      // of the density at the mean, where the field's rows have heights
    float log_peak = 0;    // log of the density at the mean that integrates to 1, in 1/m^3
    float unused[2] = {};  // to 64 bytes

    void set_information(const Eigen::Matrix3d& L);
  };

  Eigen::Vector3d corner = Eigen::Vector3d::Zero();  // of the box, target frame
  double side = 1;                                   // of a cell, metres
  std::array<std::int32_t, 3> size = {};             // cells along x, y, z
  std::vector<std::int32_t> number = {};             // of the row, x fastest; -1: none
  /// The same in less memory, in place of `number`, which is empty then. Scores are the same bits;
  /// looking up takes longer.
  std::optional<CellNumbers> stored = {};
  std::vector<Row> rows = {};  // the last one is never met
  /// The means of the rows, from `corner`, where a point whose cell has no row takes the one with
  /// the mean nearest to the point.
  std::shared_ptr<const KdTree> means = {};
  /// Whether points outside are scored with the nearest cell of the box's border.
  bool endless = false;
  /// 0 to 7: a point is scored with this one of the 8 cells with the nearest centres (bit 0: the
  /// one further along x, bit 1: y, bit 2: z), weighted by the trilinear weight of that centre. -1:
  /// with the cell that it lies in.
  int trilinear_corner = -1;
  /// Whether derivatives are those of the weights, too, or take them for constant.
  bool weights_change = false;
  /// Metres: a point further from a mean is not scored with it. 0: there is no limit.
  double reach = 0;
  double height = 1;         // of a density at its mean
  bool row_heights = false;  // whether those of the rows count, too

  std::int32_t number_at(std::int32_t place) const {
    return stored ? stored->find(place) : number[static_cast<std::size_t>(place)];
  }
  /// Of a field with means.
  std::int32_t nearest_row(const Eigen::Vector3d& from_corner) const;
  /// Moves the numbers of cells; nothing works on them afterwards but sums.
  void store(Storage storage);

  std::size_t bytes() const {
    return number.size() * sizeof(number[0]) + (stored ? stored->bytes() : 0) +
           rows.size() * sizeof(rows[0]) + (means ? means->bytes() : 0);
  }
};

/// A row relative to `corner`, and one that no point can be near to.
NdtField::Row row_of(const NdtCell& cell, const Eigen::Vector3d& normal,
                     const Eigen::Vector3d& corner);
NdtField::Row unmet_row();

/// The cells of a box that fields are made for; a cloud spread wider than that is better off with
/// the table of NdtGrid.
inline constexpr double max_field_cells = 1 << 24;

/// The cells of `grid` in the smallest box that holds them, with a margin of `margin` cells on each
/// side. None if that has more than max_field_cells or the grid is empty.
std::optional<NdtField> ndt_field(const NdtGrid& grid, int margin = 0);

/// The same; empty (no cells, no rows) for an empty grid. Throws std::invalid_argument for a box of
/// too many cells.
NdtField checked_ndt_field(const NdtGrid& grid, int margin = 0);
[[noreturn]] void throw_too_many_cells(double side);

/// Gives every cell of the box the distribution of the cell nearest to it, by the distance between
/// their centres (the paper's linked cells, section 4.3.5); of several equally far, one. O(cells).
void link_cells(NdtField& field);

/// The same by the distance from a cell's centre to the means of the distributions, which need not
/// give the same: a wall that cuts a corner of its cell has its mean there. O(cells log rows).
void link_cells_by_mean(NdtField& field);

/// Links points, not cells: one whose cell has no distribution takes that with the mean nearest to
/// it. O(rows log rows), and a search for each such point at every pose.
void link_points(NdtField& field);

}  // namespace minescan
