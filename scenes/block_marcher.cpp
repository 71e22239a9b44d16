// SPDX-License-Identifier: MIT
#include "scenes/block_marcher.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bitset>
#include <cfloat>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "scenes/contour.h"

namespace minescan {
namespace {

// Cells along the side of the smallest cube whose range is asked for; a power of two. 1 and 4 are
// slower.
constexpr int leaf_size = 2;

// Vertices keep this part of an edge away from its ends, so that no triangle is degenerate...
constexpr double least_margin = 1e-3;
// ... and at least this many steps of a float.
constexpr double margin_steps = 8;

// Points of a block and one more to each side: whether a cell beyond a face has a vertex inside
// depends on all its corners.
constexpr int known_points = block_size + 3;
constexpr std::uint32_t no_vertex = ~0U;

std::size_t index_of(const Eigen::Vector3i& p) {
  return static_cast<std::size_t>(((p.z() + 1) * known_points + p.y() + 1) * known_points + p.x() +
                                  1);
}

/// Names the vertex on an edge of the lattice, by its lower end and its axis, or with axis 3 the
/// one inside a cell.
std::uint32_t code_of(const Eigen::Vector3i& p, int axis) {
  return static_cast<std::uint32_t>(4 * index_of(p)) + static_cast<std::uint32_t>(axis);
}
constexpr int inside_cell = 3;

Eigen::Vector3i corner_of(const Eigen::Vector3i& cell, int corner) {
  return cell + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
}

/// The corners of one face of a cube, as bits.
int corners_in_face(int axis, int side) {
  constexpr std::array<int, 3> upper = {0xaa, 0xcc, 0xf0};
  return side == 1 ? upper[axis] : 0xff & ~upper[axis];
}

struct CubeFace {
  int axis = 0;
  int side = 0;
};

/// The face of a cube in which two of its edges lie that follow each other in a loop.
CubeFace common_face(int edge_a, int edge_b) {
  const auto& ends = cube_edge_ends();
  const int corners =
      1 << ends[edge_a].from | 1 << ends[edge_a].to | 1 << ends[edge_b].from | 1 << ends[edge_b].to;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      if ((corners & ~corners_in_face(axis, side)) == 0) return {axis, side};
  return {};  // not reached: diagonals are inside, steps of a loop within faces
}

/// The place on the line p + t d within a box that is nearest to p, if there is one.
std::optional<Eigen::Vector3d> moved_into(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p,
                                          const Eigen::Vector3d& d) {
  double low = -std::numeric_limits<double>::infinity();
  double high = -low;
  for (int axis = 0; axis < 3; ++axis) {
    const double to_min = box.min()[axis] - p[axis];
    const double to_max = box.max()[axis] - p[axis];
    if (std::abs(d[axis]) < 1e-9) {  // along the box: rounding only
      if (to_min > 0 || to_max < 0) return std::nullopt;
      continue;
    }
    low = std::max(low, std::min(to_min / d[axis], to_max / d[axis]));
    high = std::min(high, std::max(to_min / d[axis], to_max / d[axis]));
  }
  if (!(low <= high)) return std::nullopt;
  return p + std::clamp(0.0, low, high) * d;
}

/// An exact copy without spare room.
template <class T>
std::vector<T> taken(std::vector<T>& list) {
  std::vector<T> copy(list.begin(), list.end());
  list.clear();
  return copy;
}

}  // namespace

double Patch::bytes() const {
  return static_cast<double>(sizeof(Patch) + vertices.size() * sizeof(vertices[0]) +
                             triangles.size() * sizeof(triangles[0]) + material.size() +
                             foreign.size() * sizeof(Foreign) + rim.size() * sizeof(Rim));
}

BlockMarcher::BlockMarcher(const ImplicitSurface& surface, double edge_length)
    : surface_(surface), edge_(edge_length) {
  constexpr std::size_t points = known_points * known_points * known_points;
  samples_.resize(points);
  sampled_.resize(points);
  vertex_of_code_.resize(4 * points);
}

Patch BlockMarcher::march(const Cell& block) {
  origin_ = low_of(block);
  std::fill(sampled_.begin(), sampled_.end(), std::uint8_t{0});
  std::fill(vertex_of_code_.begin(), vertex_of_code_.end(), no_vertex);
  crossings_.clear();
  tangents_.clear();
  refine(Local::Zero(), block_size);
  std::sort(patch_.rim.begin(), patch_.rim.end(),
            [](const Patch::Rim& a, const Patch::Rim& b) { return a.code < b.code; });
  return {.vertices = taken(patch_.vertices),
          .triangles = taken(patch_.triangles),
          .material = taken(patch_.material),
          .foreign = taken(patch_.foreign),
          .rim = taken(patch_.rim)};
}

/// Halves cubes until they cannot hold surface or are leaves.
void BlockMarcher::refine(const Local& low, int size) {
  const double half = edge_ * size / 2;
  const Interval range =
      surface_.range(point(low) + Eigen::Vector3d::Constant(half), half * std::sqrt(3.0));
  if (range.low > 0 || range.high < 0) return;
  if (size == leaf_size) {
    march_leaf(low);
    return;
  }
  const int step = size / 2;
  for (int z = 0; z < size; z += step)
    for (int y = 0; y < size; y += step)
      for (int x = 0; x < size; x += step) refine(low + Local(x, y, z), step);
}

/// Looks at each corner once for all cells of the leaf.
void BlockMarcher::march_leaf(const Local& low) {
  constexpr int side = leaf_size + 1;
  std::array<std::uint8_t, side* side* side> open = {};
  std::size_t i = 0;
  for (int z = 0; z < side; ++z)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) open[i++] = sample(low + Local(x, y, z)).value < 0;
  for (int z = 0; z < leaf_size; ++z)
    for (int y = 0; y < leaf_size; ++y)
      for (int x = 0; x < leaf_size; ++x) {
        int corners = 0;
        for (int corner = 0; corner < cube_corners; ++corner) {
          const Local c = corner_of({x, y, z}, corner);
          corners |= open[static_cast<std::size_t>((c.z() * side + c.y()) * side + c.x())]
                     << corner;
        }
        if (corners != 0 && corners != 0xff) march_cell(low + Local(x, y, z), corners);
      }
}

void BlockMarcher::march_cell(const Local& cell, int open) {
  if (holds_sharp_edge(cell, open)) {
    march_sharp_cell(cell, open);
    return;
  }
  for (const auto& triangle : marching_cases()[open]) {
    std::array<std::uint32_t, 3> corners = {};
    std::array<std::uint8_t, 3> materials = {};
    for (std::size_t i = 0; i < 3; ++i) {
      const int axis = triangle[i] / 4;
      const Local from = corner_of(cell, cube_edge_ends()[triangle[i]].from);
      corners[i] = vertex(from, axis);
      materials[i] = material(from, axis);
    }
    // The material of most corners.
    add_triangle(corners[0], corners[1], corners[2],
                 materials[1] == materials[2] ? materials[1] : materials[0]);
  }
}

/// Whether the surface in a cell is one piece of several faces: then it gets a vertex inside.
bool BlockMarcher::holds_sharp_edge(const Local& cell, int open) {
  bool all_equal = true;
  const std::uint8_t first = sample(cell).face;
  for (int corner = 1; corner < cube_corners; ++corner)
    if (sample(corner_of(cell, corner)).face != first) all_equal = false;
  if (all_equal || marching_loops()[open].size() != 1) return false;
  std::bitset<256> faces;
  for (const int edge : marching_loops()[open][0])
    faces.set(crossing(corner_of(cell, cube_edge_ends()[edge].from), edge / 4).face);
  return faces.count() >= 2;
}

/// A fan about the vertex inside. Where a sharp edge leaves the cell between two vertices, their
/// edge is replaced by the one between the vertices inside of both cells there; of the two
/// triangles of that quadrilateral this cell makes the one at its loop's first vertex, the other
/// cell the other.
void BlockMarcher::march_sharp_cell(const Local& cell, int open) {
  const std::vector<std::uint8_t>& loop = marching_loops()[open][0];
  const std::uint32_t middle = centre_vertex(cell);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const int edge = loop[i];
    const int next = loop[(i + 1) % loop.size()];
    const Local from = corner_of(cell, cube_edge_ends()[edge].from);
    const Local next_from = corner_of(cell, cube_edge_ends()[next].from);
    const std::uint32_t a = vertex(from, edge / 4);
    Local other;
    const std::uint32_t b = shares_sharp_edge(cell, open, edge, next, other)
                                ? centre_vertex(other)
                                : vertex(next_from, next / 4);
    add_triangle(a, b, middle, crossing(from, edge / 4).material);
  }
}

/// Whether a sharp edge runs between two vertices of a cell's loop to a vertex inside `other`.
/// The same from both sides: their faces belong to the vertices, and as they differ, the cells have
/// vertices inside if they have one loop each.
bool BlockMarcher::shares_sharp_edge(const Local& cell, int open, int edge_a, int edge_b,
                                     Local& other) {
  const Local from_a = corner_of(cell, cube_edge_ends()[edge_a].from);
  const Local from_b = corner_of(cell, cube_edge_ends()[edge_b].from);
  if (crossing(from_a, edge_a / 4).face == crossing(from_b, edge_b / 4).face) return false;
  const CubeFace face = common_face(edge_a, edge_b);
  // With two lines in the face between the cells, two edges would join the same vertices.
  const int corners = corners_in_face(face.axis, face.side);
  int crossed = 0;
  for (const CubeEdge& ends : cube_edge_ends())
    if ((corners >> ends.from & corners >> ends.to & 1) != 0 &&
        (open >> ends.from & 1) != (open >> ends.to & 1))
      ++crossed;
  if (crossed != 2) return false;
  other = cell;
  other[face.axis] += face.side == 1 ? 1 : -1;
  return marching_loops()[open_corners(other)].size() == 1;
}

const ImplicitSurface::Sample& BlockMarcher::sample(const Local& p) {
  const std::size_t i = index_of(p);
  if (sampled_[i] == 0) samples_[i] = surface_.at(point(p));
  sampled_[i] = 1;
  return samples_[i];
}

int BlockMarcher::open_corners(const Local& cell) {
  int open = 0;
  for (int corner = 0; corner < cube_corners; ++corner)
    if (sample(corner_of(cell, corner)).value < 0) open |= 1 << corner;
  return open;
}

/// That of the end nearer to the surface.
std::uint8_t BlockMarcher::material(const Local& from, int axis) {
  const ImplicitSurface::Sample& a = sample(from);
  const ImplicitSurface::Sample& b = sample(from + Local::Unit(axis));
  if (a.face != b.face) return crossing_between_faces(from, axis).material;
  return std::abs(a.value) <= std::abs(b.value) ? a.material : b.material;
}

BlockMarcher::Crossing BlockMarcher::crossing(const Local& from, int axis) {
  const ImplicitSurface::Sample& a = sample(from);
  const ImplicitSurface::Sample& b = sample(from + Local::Unit(axis));
  if (a.face != b.face) return crossing_between_faces(from, axis);
  Crossing result;
  result.place = point(from);
  const double least = margin(result.place);
  result.place[axis] += edge_ * std::clamp(a.value / (a.value - b.value), least, 1 - least);
  result.material = material(from, axis);
  result.face = a.face;
  return result;
}

/// Searches for the place, since the function has a kink between its samples, and takes material
/// and face there.
BlockMarcher::Crossing BlockMarcher::crossing_between_faces(const Local& from, int axis) {
  const auto [known, is_new] = crossings_.try_emplace(code_of(from, axis));
  Crossing& result = known->second;
  if (!is_new) return result;
  const Eigen::Vector3d start = point(from);
  ImplicitSurface::Sample a = sample(from);
  ImplicitSurface::Sample b = sample(from + Local::Unit(axis));
  double t_a = 0, t_b = 1;
  // False position and halving in turn: a kink stops the first, and the second is sure.
  for (int i = 0; i < 40 && t_b - t_a > 1e-12; ++i) {
    const double t =
        i % 3 == 2 ? (t_a + t_b) / 2 : t_a + (t_b - t_a) * (a.value / (a.value - b.value));
    result.place = start;
    result.place[axis] += edge_ * t;
    const ImplicitSurface::Sample here = surface_.at(result.place);
    ((here.value < 0) == (a.value < 0) ? a : b) = here;
    ((here.value < 0) == (sample(from).value < 0) ? t_a : t_b) = t;
    if (std::abs(here.value) <= 1e-12 * edge_) break;
  }
  const bool a_is_nearer = std::abs(a.value) <= std::abs(b.value);
  const double least = margin(start);
  result.place = start;
  result.place[axis] += edge_ * std::clamp(a_is_nearer ? t_a : t_b, least, 1 - least);
  result.material = a_is_nearer ? a.material : b.material;
  result.face = a_is_nearer ? a.face : b.face;
  return result;
}

const BlockMarcher::Tangent& BlockMarcher::tangent(const Local& from, int axis) {
  const auto [known, is_new] = tangents_.try_emplace(code_of(from, axis));
  Tangent& result = known->second;
  if (!is_new) return result;
  const Eigen::Vector3d place = crossing(from, axis).place;
  const ImplicitSurface::Sample here = surface_.at(place);
  // Small against the mesh, large against rounding: 1e-16 m / 1e-4 of an edge.
  const double step = 1e-4 * edge_;
  Eigen::Vector3d gradient;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d along = step * Eigen::Vector3d::Unit(i);
    const ImplicitSurface::Sample after = surface_.at(place + along);
    const ImplicitSurface::Sample before = surface_.at(place - along);
    // Not across a sharp edge, if it can be helped.
    if (after.face != here.face && before.face == here.face) {
      gradient[i] = (here.value - before.value) / step;
    } else if (after.face == here.face && before.face != here.face) {
      gradient[i] = (after.value - here.value) / step;
    } else {
      gradient[i] = (after.value - before.value) / (2 * step);
    }
  }
  const double slope = gradient.norm();
  if (slope > 0) {
    result.normal = gradient / slope;
    result.offset = result.normal.dot(place) - here.value / slope;
  } else {
    result.normal = Eigen::Vector3d::Zero();  // no plane: takes no part
  }
  return result;
}

/// The place nearest to the planes of a cell's crossings: on the sharp edge between two faces, at
/// the tip where three meet.
Eigen::Vector3d BlockMarcher::centre(const Local& cell) {
  const int open = open_corners(cell);
  const std::vector<std::uint8_t>& loop = marching_loops()[open][0];
  const Eigen::Vector3d corner = point(cell);
  // From the corner, in edges.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int edge : loop)
    mean += (crossing(corner_of(cell, cube_edge_ends()[edge].from), edge / 4).place - corner) /
            (edge_ * static_cast<double>(loop.size()));
  std::bitset<256> faces;
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();  // of the normal equations
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const int edge : loop) {
    const Local from = corner_of(cell, cube_edge_ends()[edge].from);
    faces.set(crossing(from, edge / 4).face);
    const Tangent& t = tangent(from, edge / 4);
    squares += t.normal * t.normal.transpose();
    const double rest = (t.offset - t.normal.dot(corner)) / edge_ - t.normal.dot(mean);
    right += t.normal * rest;
  }
  // Two faces meet in a line however bent or rough they are; the place along it that their bends
  // would ask for means nothing. Nor do directions that normals hardly tell apart: 0.01 of the
  // squares are normals 11 degrees apart.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
  const Eigen::Vector3d values = solver.eigenvalues();  // rising
  const Eigen::Matrix3d axes = solver.eigenvectors();
  const int rank = faces.count() >= 3 ? 3 : 2;
  Eigen::Vector3d place = mean;
  for (int i = 3 - rank; i < 3; ++i)
    if (values[i] > 0.01 * values[2]) place += axes.col(i) * (axes.col(i).dot(right) / values[i]);

  const double least = margin(corner);
  Eigen::AlignedBox3d box(Eigen::Vector3d::Constant(least), Eigen::Vector3d::Constant(1 - least));
  if (box.contains(place)) return corner + edge_ * place;
  // Along the line it may still reach into the cell. If not, the line runs past the cell through
  // one of its lattice edges, twice. Then the place may be beyond the faces that no loop crosses:
  // no triangle is there, and no corner on their edges.
  Eigen::AlignedBox3d wide = box;
  constexpr double reach = 0.5;
  for (int axis = 0; axis < 3; ++axis) {
    const auto crossed = [&](int side) {
      const int corners = corners_in_face(axis, side);
      return (open & corners) != 0 && (open & corners) != corners;
    };
    if (!crossed(0)) wide.min()[axis] = -reach;
    if (!crossed(1)) wide.max()[axis] = 1 + reach;
  }
  const bool is_line = values[1] > 0.01 * values[2] && (rank == 2 || values[0] <= 0.01 * values[2]);
  const Eigen::Vector3d line = is_line ? Eigen::Vector3d(axes.col(0)) : Eigen::Vector3d::Zero();
  for (const Eigen::AlignedBox3d& allowed : {box, wide})
    if (const std::optional<Eigen::Vector3d> found = moved_into(allowed, place, line))
      return corner + edge_ * *found;
  return corner + edge_ * place.cwiseMax(box.min()).cwiseMin(box.max());
}

std::uint32_t BlockMarcher::vertex(const Local& from, int axis) {
  const std::uint32_t code = code_of(from, axis);
  if (vertex_of_code_[code] == no_vertex)
    vertex_of_code_[code] = add_vertex(from, code, crossing(from, axis).place);
  return vertex_of_code_[code];
}

std::uint32_t BlockMarcher::centre_vertex(const Local& cell) {
  const std::uint32_t code = code_of(cell, inside_cell);
  if (vertex_of_code_[code] == no_vertex)
    vertex_of_code_[code] = add_vertex(cell, code, centre(cell));
  return vertex_of_code_[code];
}

/// The vertex belongs to the block that holds the lattice point `low`.
std::uint32_t BlockMarcher::add_vertex(const Local& low, std::uint32_t code,
                                       const Eigen::Vector3d& place) {
  Local step = Local::Zero();
  bool at_face = false;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = low[axis] < 0 ? -1 : low[axis] / block_size;
    if (low[axis] == 0 || low[axis] == block_size - 1) at_face = true;
  }
  if (step != Local::Zero()) {
    Patch::Foreign foreign;
    for (int axis = 0; axis < 3; ++axis) foreign.step[axis] = static_cast<std::int8_t>(step[axis]);
    foreign.code = code_of(low - step * block_size, static_cast<int>(code % 4));
    foreign.place = place.cast<float>();
    patch_.foreign.push_back(foreign);
    return Patch::foreign_bit | static_cast<std::uint32_t>(patch_.foreign.size() - 1);
  }
  const auto index = static_cast<std::uint32_t>(patch_.vertices.size());
  patch_.vertices.push_back(place.cast<float>());
  const bool inside = code % 4 == inside_cell;
  if (inside ? at_face : low.minCoeff() == 0) patch_.rim.push_back({code, index});
  return index;
}

void BlockMarcher::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                std::uint8_t material) {
  patch_.triangles.push_back({a, b, c});
  patch_.material.push_back(material);
}

Eigen::Vector3d BlockMarcher::point(const Local& p) const {
  return lattice_point(origin_ + p.cast<std::int64_t>(), edge_);
}

double BlockMarcher::margin(const Eigen::Vector3d& place) const {
  const double steps = margin_steps * FLT_EPSILON * place.cwiseAbs().maxCoeff() / edge_;
  return std::clamp(steps, least_margin, 0.25);
}

}  // namespace minescan
