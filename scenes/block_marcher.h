// SPDX-License-Identifier: MIT
// Contouring block by block: the lattice, and the triangles within one block of it. Private to
// contour.cpp.
//
// Triangles of a cell keep to the cell, and cells agree on the lines in the faces between them; so
// triangles of different cells do not cross. Where a cell holds a piece of a sharp edge, its
// triangles are a fan about a vertex strictly inside. A fan does not cross itself, wherever that
// vertex is: each ray from it leaves the cell once, and the line around the fan, which lies in the
// cell's faces, does not cross itself. Two of these lines meet in a face where the sharp edge goes
// from cell to cell; then a vertex strictly within the face bends both in the same way.
//
// Sharp edges also pass beside cells that nevertheless hold both of its sides, where they cut a
// lattice edge twice and no corner shows it. Such a cell and the one that has the edge join: a
// region of two cells is as convex as one, and all of the above holds for it. For the same reason
// an edge may go on through a cell that shows no surface at all; one of its neighbours takes it in.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "scenes/implicit.h"

namespace minescan {

/// Integer coordinates in the world of a lattice point, of a cell (its low corner), or of a block.
using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

/// Cells along the side of a block. Points on faces are evaluated by both blocks there, so smaller
/// ones cost more time (8 and 16 measured).
inline constexpr int block_size = 32;

/// Where lattice point `p` lies: at (i + 1/2) edge_length for all integers i. Fixed in the world,
/// and off the round coordinates of flat faces.
inline Eigen::Vector3d lattice_point(const Cell& p, double edge_length) {
  return edge_length * (p.cast<double>() + Eigen::Vector3d::Constant(0.5));
}

/// The low corner of a block. Floors are at z = 0, and half a block below it is where the two
/// blocks there would both evaluate them: 3 % more samples of a mine.
inline Cell low_of(const Cell& block) { return block * block_size - Cell(0, 0, block_size / 2); }

/// The part of the mesh within one block. A triangle's corner is an index into `vertices`, or with
/// foreign_bit an index into `foreign`: vertices on the upper faces, and those inside the cells
/// beyond a face, belong to other blocks.
struct Patch {
  static constexpr std::uint32_t foreign_bit = 1U << 31;
  struct Foreign {
    std::array<std::int8_t, 3> step = {};             // from this block to the owner
    std::uint32_t code = 0;                           // the owner's name for it
    Eigen::Vector3f place = Eigen::Vector3f::Zero();  // the same bytes as the owner's
  };
  struct Rim {
    std::uint32_t code = 0;
    std::uint32_t vertex = 0;
  };
  std::vector<Eigen::Vector3f> vertices = {};
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
  std::vector<std::uint8_t> material = {};
  std::vector<Foreign> foreign = {};
  std::vector<Rim> rim = {};  // own vertices that other blocks may ask for, sorted by code

  /// That it takes, about.
  double bytes() const;
};

/// Marches through blocks, one after the other. Keeps its arrays between blocks; one for each
/// thread.
class BlockMarcher {
 public:
  BlockMarcher(const ImplicitSurface& surface, double edge_length);

  /// The triangles of a block; depends on nothing but the surface, the edge length and the block.
  Patch march(const Cell& block);

 private:
  using Local = Eigen::Vector3i;  // lattice point or cell, from the low corner of the block

  /// Where the surface crosses an edge of the lattice.
  struct Crossing {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    std::uint8_t material = 0;
    std::uint8_t face = 0;
  };
  /// The surface there, as a plane: normal . p = offset.
  struct Tangent {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double offset = 0;
  };

  using Step = Local;  // from a cell to one of its six neighbours, or zero

  /// What a cell has to do with sharp edges.
  struct Site {
    int open = 0;           // its corners in the open space, as bits
    bool is_sharp = false;  // it holds one piece of surface, of several faces
    /// The neighbour through which their common edge or tip goes, if it does not go through this
    /// cell.
    Step wanted = Step::Zero();
    /// The neighbours to which the edge goes from here through faces that no surface cuts.
    std::array<Step, 2> exits = {Step::Zero(), Step::Zero()};
  };
  /// One cell or two with one vertex inside. Named by a cell with surface in it.
  struct Region {
    Local cell = Local::Zero();
    Step to_other = Step::Zero();  // zero: alone
  };
  /// The planes of the faces in a region, in edges from the low corner of its first cell.
  struct Feature {
    int rank = 0;                                       // they meet in a plane, a line or a point
    Eigen::Vector3d place = Eigen::Vector3d::Zero();    // there, nearest to the crossings
    Eigen::Vector3d along = Eigen::Vector3d::Zero();    // the line; zero for planes and points
    Eigen::Vector3d on_face = Eigen::Vector3d::Zero();  // middle of one face's crossings
  };

  void refine(const Local& low, int size);
  void march_leaf(const Local& low);
  void march_cell(const Local& cell, int open);
  void march_region(const Local& cell, const Region& region);

  bool is_mixed(const Local& cell);
  const Site& site(const Local& cell);
  void look_for_edge(const Local& cell, Site& site);
  bool makes_one_loop(const Local& cell, const Step& step);
  bool joins(const Local& cell, const Step& step);
  Step joined_with(const Local& cell);
  bool annexes(const Local& cell, const Step& step);
  std::optional<Region> region_of(const Local& cell);

  const ImplicitSurface::Sample& sample(const Local& p);
  std::uint8_t material(const Local& from, int axis);
  Crossing crossing(const Local& from, int axis);
  Crossing crossing_between_faces(const Local& from, int axis);
  const Tangent& tangent(const Local& from, int axis);
  Crossing crossing_of(const Local& cell, int edge);
  Feature feature_of(const Region& region);
  Eigen::AlignedBox3d box_of(const Region& region) const;
  const Eigen::Vector3f& place_inside(const Region& region);

  std::uint32_t vertex(const Local& from, int axis);
  std::uint32_t vertex_inside(const Region& region);
  std::optional<std::uint32_t> vertex_in_face(const Local& cell, int edge_a, int edge_b);
  std::uint32_t add_vertex(const Local& low, std::uint32_t code, const Eigen::Vector3d& place);
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint8_t material);

  Eigen::Vector3d point(const Local& p) const;
  double margin(const Eigen::Vector3d& place) const;

  const ImplicitSurface& surface_;
  double edge_;
  Cell origin_ = Cell::Zero();
  std::vector<ImplicitSurface::Sample> samples_;
  std::vector<std::uint8_t> sampled_;
  std::vector<std::uint32_t> vertex_of_edge_;
  // Of the few cells and crossings at sharp edges, by code.
  std::unordered_map<std::uint32_t, Site> sites_;
  std::unordered_map<std::uint32_t, Eigen::Vector3f> places_inside_;
  std::unordered_map<std::uint32_t, std::uint32_t> more_vertices_;
  std::unordered_map<std::uint32_t, Crossing> crossings_;
  std::unordered_map<std::uint32_t, Tangent> tangents_;
  Patch patch_;
};

}  // namespace minescan
