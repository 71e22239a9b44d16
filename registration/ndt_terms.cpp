// SPDX-License-Identifier: MIT
#include "registration/ndt_terms.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <stdexcept>

namespace minescan {
namespace {

/// A cell of the octree that is not divided further.
struct Leaf {
  std::array<int, 3> first = {};  // the smallest of its cells of the finest lattice
  int cells = 1;                  // of those along its side
  FittedCell fitted = {};
};

/// Sums of the same points in cells of one size after the other, the finest first.
class Pyramid {
 public:
  Pyramid(const std::vector<Eigen::Vector3d>& points, const NdtGridOptions& grid, int depth) {
    levels_.push_back(
        sum_cells(points, Lattice(std::ldexp(grid.cell_size, -depth), grid.lattice_origin)));
    for (int i = 0; i < depth; ++i) levels_.push_back(twice_as_large(levels_.back()));
    for (const SummedCells& level : levels_) {
      tables_.emplace_back();
      for (const std::uint64_t key : level.keys) tables_.back().insert(key);
    }
  }
  const SummedCells& finest() const { return levels_.front(); }
  const SummedCells& roots() const { return levels_.back(); }

  /// The leaves below one cell. `level` counts from the finest.
  void leaves(std::size_t level, std::uint64_t key, const NdtGridOptions& grid,
              const NdtTermOptions& options, std::vector<Leaf>& list) const {
    const std::uint32_t number = tables_[level].find(key);
    if (number == KeyTable::not_found) return;
    const SummedCells& cells = levels_[level];
    NdtGridOptions of_level = grid;
    of_level.cell_size = cells.lattice.side();
    const std::optional<FittedCell> fitted =
        fit_cell(cells.sums[number], cells.lattice.corner(key), of_level);
    if (!fitted) return;
    const std::array<int, 3> at = Lattice::indices(key);
    const bool spread = fitted->thinnest > options.split_spread * options.split_spread;
    if (level > 0 && spread && cells.sums[number].count >= 2 * grid.min_cell_points) {
      const std::size_t before = list.size();
      for (int child = 0; child < 8; ++child)
        leaves(
            level - 1,
            Lattice::key(std::array<int, 3>{2 * at[0] + (child & 1), 2 * at[1] + (child >> 1 & 1),
                                            2 * at[2] + (child >> 2)}),
            grid, options, list);
      if (list.size() > before) return;
      // No child has enough points: it stays whole.
    }
    const int size = 1 << level;
    list.push_back(
        {.first = {at[0] * size, at[1] * size, at[2] * size}, .cells = size, .fitted = *fitted});
  }

 private:
  std::vector<SummedCells> levels_;
  std::vector<KeyTable> tables_;
};

/// A field of leaves: every cell of the finest lattice, or of coarser ones, points to its leaf.
NdtField field_of_leaves(const std::vector<Leaf>& leaves, const Lattice& finest, int cells) {
  // As a grid of cells of `cells` finest ones each; a leaf covers one or more of those.
  std::array<int, 3> low = {}, high = {};
  const auto in_field = [&](int index) {  // rounds down
    return index >= 0 ? index / cells : -((-index + cells - 1) / cells);
  };
  for (std::size_t i = 0; i < 3; ++i) low[i] = 1 << 30, high[i] = -(1 << 30);
  for (const Leaf& leaf : leaves) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], in_field(leaf.first[i]));
      high[i] = std::max(high[i], in_field(leaf.first[i] + leaf.cells - 1));
    }
  }
  NdtField field{.side = finest.side() * cells};
  double count = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    field.size[i] = high[i] - low[i] + 1;
    count *= field.size[i];
  }
  if (count > max_field_cells) throw_too_many_cells(field.side);
  field.corner = finest.origin() + field.side * Eigen::Vector3d(low[0], low[1], low[2]);
  field.number.assign(static_cast<std::size_t>(count), -1);
  for (const Leaf& leaf : leaves) {
    const auto number = static_cast<std::int32_t>(field.rows.size());
    field.rows.push_back(row_of(leaf.fitted.cell, leaf.fitted.normal, field.corner));
    std::array<int, 3> from = {}, to = {};
    for (std::size_t i = 0; i < 3; ++i) {
      from[i] = in_field(leaf.first[i]) - low[i];
      to[i] = in_field(leaf.first[i] + leaf.cells - 1) - low[i];
    }
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x)
          field.number[static_cast<std::size_t>((z * field.size[1] + y) * field.size[0] + x)] =
              number;
  }
  field.rows.push_back(unmet_row());
  return field;
}

std::vector<NdtField> divided_fields(const std::vector<Eigen::Vector3d>& points,
                                     const NdtGridOptions& grid, const NdtTermOptions& options) {
  const Pyramid pyramid(points, grid, options.depth);
  const auto top = static_cast<std::size_t>(options.depth);
  const Lattice& finest = pyramid.finest().lattice;
  if (options.discretisation == Discretisation::octree) {
    std::vector<Leaf> leaves;
    for (const std::uint64_t key : pyramid.roots().keys)
      pyramid.leaves(top, key, grid, options, leaves);
    if (leaves.empty()) return {};
    return {field_of_leaves(leaves, finest, 1)};
  }
  // The first leaf of every root makes one field, the second leaves another, and so on.
  std::vector<std::vector<Leaf>> by_rank;
  for (const std::uint64_t key : pyramid.roots().keys) {
    std::vector<Leaf> leaves;
    pyramid.leaves(top, key, grid, options, leaves);
    if (by_rank.size() < leaves.size()) by_rank.resize(leaves.size());
    const std::array<int, 3> root = Lattice::indices(key);
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      Leaf leaf = leaves[k];
      leaf.cells = 1 << options.depth;  // it scores the whole root
      for (std::size_t i = 0; i < 3; ++i) leaf.first[i] = root[i] * leaf.cells;
      by_rank[k].push_back(leaf);
    }
  }
  std::vector<NdtField> fields;
  for (const std::vector<Leaf>& leaves : by_rank)
    fields.push_back(field_of_leaves(leaves, finest, 1 << options.depth));
  return fields;
}

/// `field` as seen by the cells next to its own: what lies at `offset` from them.
NdtField neighbours_of(const NdtField& field, const std::array<int, 3>& offset) {
  NdtField moved = field;
  // The cell that a point lies in looks at the one `offset` cells further on: the box moves back.
  // Means are given from the corner, so they move the other way.
  for (int i = 0; i < 3; ++i) {
    const double shift = offset[static_cast<std::size_t>(i)] * field.side;
    moved.corner[i] -= shift;
    for (NdtField::Row& row : moved.rows) row.mean[i] += static_cast<float>(shift);
  }
  return moved;
}

std::vector<NdtField> with_neighbours(const NdtField& field, Neighbourhood neighbourhood) {
  std::vector<NdtField> fields;
  if (field.number.empty()) return fields;
  if (neighbourhood == Neighbourhood::trilinear) {
    for (int corner = 0; corner < 8; ++corner) {
      fields.push_back(field);
      fields.back().trilinear_corner = corner;
    }
    return fields;
  }
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const int away = std::abs(x) + std::abs(y) + std::abs(z);
        // A mean within one cell size lies at most one cell away.
        const bool around =
            neighbourhood == Neighbourhood::all || neighbourhood == Neighbourhood::radius;
        if (away > 0 && !around && (away > 1 || neighbourhood != Neighbourhood::faces)) continue;
        fields.push_back(neighbours_of(field, {x, y, z}));
        if (neighbourhood == Neighbourhood::radius) fields.back().reach = field.side;
      }
  return fields;
}

MixtureFit fit_mixture(double c1, double c2) {
  const double d3 = -std::log(c2);
  const double d1 = -std::log(c1 + c2) - d3;
  return {.d1 = d1, .d2 = -2 * std::log((-std::log(c1 * std::exp(-0.5) + c2) - d3) / d1)};
}

}  // namespace

MixtureFit mixture_fit(double outlier_ratio, double side) {
  return fit_mixture(10 * (1 - outlier_ratio), outlier_ratio / (side * side * side));
}

MixtureFit cell_mixture_fit(double outlier_ratio, double side, double peak) {
  return fit_mixture((1 - outlier_ratio) * peak, outlier_ratio / (side * side * side));
}

std::vector<NdtField> ndt_fields(const std::vector<Eigen::Vector3d>& points,
                                 const NdtGridOptions& grid, const NdtTermOptions& options) {
  if (options.discretisation != Discretisation::fixed &&
      options.neighbourhood != Neighbourhood::own)
    throw std::invalid_argument(
        "neighbourhood: expected own, the only one for cells that are divided further");
  if (options.neighbourhood == Neighbourhood::radius && (options.linked || options.endless))
    throw std::invalid_argument(
        "neighbourhood: expected other than radius, which looks for means, for cells that are "
        "linked or endless");
  if (options.linked && options.linked_by == LinkedBy::point &&
      options.neighbourhood != Neighbourhood::own &&
      options.neighbourhood != Neighbourhood::overlap)
    throw std::invalid_argument(
        "linked-by: expected other than point for a neighbourhood of more than one cell, since "
        "every empty one of them would be the same mean again");
  const auto link = [&](NdtField& field) {
    if (!options.linked) return;
    if (options.linked_by == LinkedBy::mean)
      link_cells_by_mean(field);
    else if (options.linked_by == LinkedBy::point)
      link_points(field);
    else
      link_cells(field);
  };
  std::vector<NdtField> fields;
  if (options.discretisation != Discretisation::fixed) {
    fields = divided_fields(points, grid, options);
    for (NdtField& field : fields) link(field);
  } else if (options.neighbourhood == Neighbourhood::overlap) {
    for (int shift = 0; shift < 8; ++shift) {
      NdtGridOptions shifted = grid;
      for (int i = 0; i < 3; ++i)
        if (shift >> i & 1) shifted.lattice_origin[i] += grid.cell_size / 2;
      NdtField field = checked_ndt_field(NdtGrid(points, shifted));
      link(field);
      if (!field.number.empty()) fields.push_back(std::move(field));
    }
  } else {
    NdtField field = checked_ndt_field(NdtGrid(points, grid));
    link(field);  // before it is moved for neighbours, and its means with it
    fields = with_neighbours(field, options.neighbourhood);
  }
  for (NdtField& field : fields) {
    field.endless = options.endless;
    field.weights_change = options.weights_change;
    if (options.density == Density::mixture) {
      const MixtureFit fit = mixture_fit(options.outlier_ratio, grid.cell_size);
      field.height = -fit.d1;
      for (NdtField::Row& row : field.rows)
        for (float& x : row.information) x *= static_cast<float>(fit.d2);
    } else if (options.density == Density::cell_mixture) {
      field.row_heights = true;
      for (std::size_t i = 0; i + 1 < field.rows.size(); ++i) {
        NdtField::Row& row = field.rows[i];
        const MixtureFit fit =
            cell_mixture_fit(options.outlier_ratio, grid.cell_size, std::exp(double{row.log_peak}));
        row.height = static_cast<float>(-fit.d1);
        for (float& x : row.information) x *= static_cast<float>(fit.d2);
      }
    }
  }
  for (NdtField& field : fields) field.store(options.storage);
  return fields;
}

MetCount count_met(const std::vector<NdtField>& fields, const Pose& T_target_source,
                   const std::vector<Eigen::Vector3d>& points) {
  MetCount count;
  for (const Eigen::Vector3d& p : points) {
    bool met = false, inside = false;
    for (const NdtField& field : fields) {
      Eigen::Array3d at = (T_target_source * p - field.corner).array() / field.side;
      if (field.trilinear_corner >= 0)
        for (int i = 0; i < 3; ++i) at[i] += (field.trilinear_corner >> i & 1) != 0 ? 0.5 : -0.5;
      const Eigen::Array3d size(field.size[0], field.size[1], field.size[2]);
      const bool within = (at >= 0).all() && (at < size).all();
      inside = inside || within;
      if (!within && !field.endless) continue;
      const Eigen::Array3i cell = at.max(0.0).min(size - 1).cast<int>();
      const std::int32_t place = (cell[2] * field.size[1] + cell[1]) * field.size[0] + cell[0];
      std::int32_t number = field.number_at(place);
      if (number < 0 && field.means) number = field.nearest_row(T_target_source * p - field.corner);
      if (number < 0) continue;
      const auto& [x, y, z] = field.rows[static_cast<std::size_t>(number)].mean;
      const Eigen::Vector3d from_mean =
          T_target_source * p - field.corner - Eigen::Vector3d(x, y, z);
      met = met || field.reach == 0 || from_mean.norm() <= field.reach;
    }
    count.met += met;
    count.inside += inside;
  }
  return count;
}

}  // namespace minescan
