// SPDX-License-Identifier: MIT
// The ways in which 3D-NDT divides the target and looks it up (paper, section 4.3, and later work):
// each is a list of fields whose sums are added.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "core/fields.h"
#include "core/pose.h"
#include "registration/ndt_field.h"
#include "registration/ndt_grid.h"

namespace minescan {

/// How cells are divided further.
enum class Discretisation {
  fixed,     // not at all (section 4.3.1)
  octree,    // where points do not lie along a plane; the leaf that holds a point scores it (4.3.2)
  additive,  // the same, and all leaves of the undivided cell score it (4.3.3)
};
constexpr auto names_of(Discretisation) {
  return std::to_array<std::string_view>({"fixed", "octree", "additive"});
}

/// Which cells score a point.
enum class Neighbourhood {
  own,        // the one that it lies in
  faces,      // and the 6 beyond its faces (DIRECT7 of ndt_omp)
  all,        // and all 26 around it
  overlap,    // one of each of 8 lattices, shifted by half a cell (Biber and Strasser 2003 in 3D)
  trilinear,  // the 8 with the nearest centres, weighted (Magnusson 2009)
  radius,     // those with a mean at most one cell size away (NDT of PCL)
};
constexpr auto names_of(Neighbourhood) {
  return std::to_array<std::string_view>({"own", "faces", "all", "overlap", "trilinear", "radius"});
}

/// Which distribution a point takes in a cell without one (the paper says only "the nearest").
enum class LinkedBy {
  centre,  // that of the cell with the centre nearest to its cell's
  mean,    // that with the mean nearest to its cell's centre
  point,   // that with the mean nearest to the point itself, by a kd-tree of the means
};
constexpr auto names_of(LinkedBy) {
  return std::to_array<std::string_view>({"centre", "mean", "point"});
}

enum class Density {
  normal,   // normal distributions alone (paper, eq. 4)
  mixture,  // with a uniform part for outliers, as fitted by Magnusson (2009, eqs 6.7 to 6.10)
  // The same, each cell's mixture integrating to 1 as the thesis says: a thin cell has a higher
  // peak. `mixture` takes one height for all, as PCL does.
  cell_mixture,
};
constexpr auto names_of(Density) {
  return std::to_array<std::string_view>({"normal", "mixture", "cell_mixture"});
}

/// The defaults are the paper's baseline (section 5).
struct NdtTermOptions {
  Discretisation discretisation = Discretisation::fixed;
  int depth = 1;               // how often a cell may be halved
  double split_spread = 0.05;  // metres; assumed, the paper names no limit
  Neighbourhood neighbourhood = Neighbourhood::own;
  // Exact derivatives of `trilinear`; else its weights are taken for constant, which is cheaper,
  // and leaves the value the same.
  bool weights_change = false;
  bool linked = false;  // section 4.3.5
  LinkedBy linked_by = LinkedBy::centre;
  bool endless = false;  // section 4.3.5
  Density density = Density::normal;
  double outlier_ratio = 0.55;  // PCL's own
  // Of cells in boxes. Cells spread too widely for one, and those of parameters that deform, are in
  // the table of NdtGrid whatever this says.
  Storage storage = Storage::dense;
};

template <class Visitor>
void fields(NdtTermOptions& o, Visitor&& field) {
  field("discretisation", o.discretisation, "how cells are divided further");
  field("depth", o.depth, between(0, 8), "", "octree, additive: how often a cell may be halved");
  field(
      "split-spread", o.split_spread, between(0, 1000), "m",
      "octree, additive: a cell whose points spread further in their thinnest direction (standard "
      "deviation) is divided");
  field("neighbourhood", o.neighbourhood, "which cells score a point");
  field("weights-change", o.weights_change,
        "trilinear: derivatives are those of the weights, too; else these are taken for constant");
  field("linked", o.linked,
        "a cell without a distribution takes that of the nearest cell with one");
  field("linked-by", o.linked_by,
        "linked: what is near to what: a cell's centre to the centre of the empty cell, a mean to "
        "that centre, or a mean to the point, which is searched for every time");
  field("endless", o.endless, "points outside are scored with the nearest cell of the border");
  field("density", o.density, "what a cell says of a point");
  field("outlier-ratio", o.outlier_ratio, above_up_to(0, 0.99), "",
        "mixture, cell_mixture: weight of the uniform part");
  field("storage", o.storage,
        "where cells are kept: an array over their box, which is fastest, or as many as there are "
        "in a hash table, along a Z-order curve, or in runs; poses are the same; cells "
        "in too large a box, and those of renormalise = false, are in a hash table always");
}

/// d1 and d2 of d1 exp(-d2 u / 2), d1 < 0, which with a constant approximates
/// -log(c1 exp(-u / 2) + c2) (Magnusson 2009, eq. 6.10).
struct MixtureFit {
  double d1 = -1;
  double d2 = 1;
};
/// c1 = 10 (1 - outlier_ratio) as in PCL, c2 = outlier_ratio / side^3 in a cell of `side` metres.
MixtureFit mixture_fit(double outlier_ratio, double side);
/// c1 = (1 - outlier_ratio) peak, `peak` being the normal distribution's density at its mean, 1/m^3
/// (what of it lies outside its cell is left out of account), and the same c2.
MixtureFit cell_mixture_fit(double outlier_ratio, double side, double peak);

/// The fields over which the score of these options is summed; empty if no cell has a distribution.
/// `linked` and `endless` hold for each of them.
///
/// throws  std::invalid_argument if a field has more than max_field_cells, a point lies more than
///         2^20 cells from the lattice's origin, cells are divided and not looked up by `own`,
///         looked up by `radius` and linked or endless, or with neighbours and linked by `point`
std::vector<NdtField> ndt_fields(const std::vector<Eigen::Vector3d>& points,
                                 const NdtGridOptions& grid, const NdtTermOptions& options);

/// How many points meet a distribution of any of the fields, and how many lie within the box of
/// one.
struct MetCount {
  std::size_t met = 0;
  std::size_t inside = 0;
};
MetCount count_met(const std::vector<NdtField>& fields, const Pose& T_target_source,
                   const std::vector<Eigen::Vector3d>& points);

}  // namespace minescan
