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

// Points of a block and two more to each side: where the vertex inside of a cell beyond a face lies
// depends on that cell's neighbours.
constexpr int more_points = 2;
constexpr int known_points = block_size + 1 + 2 * more_points;
constexpr int block_points = block_size + 1;
constexpr std::size_t points_of_block = block_points * block_points * block_points;
constexpr std::uint32_t no_vertex = ~0U;

std::size_t index_of(const Eigen::Vector3i& p) {
  const Eigen::Vector3i q = p + Eigen::Vector3i::Constant(more_points);
  return static_cast<std::size_t>((q.z() * known_points + q.y()) * known_points + q.x());
}

/// Names the vertex on an edge of the lattice, by its lower end and its axis, or with
/// first_inside + i the one that the i-th loop of a cell has inside.
constexpr int first_inside = 3;
constexpr int codes_per_point = first_inside + 4;  // the most loops of any case
std::uint32_t code_of(const Eigen::Vector3i& p, int kind) {
  return static_cast<std::uint32_t>(codes_per_point * index_of(p)) +
         static_cast<std::uint32_t>(kind);
}
int kind_of(std::uint32_t code) { return static_cast<int>(code % codes_per_point); }

Eigen::Vector3i corner_of(const Eigen::Vector3i& cell, int corner) {
  return cell + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
}

Eigen::Vector3i lower_end(const Eigen::Vector3i& cell, int edge) {
  return corner_of(cell, cube_edge_ends()[edge].from);
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

/// An edge of a cube as the cube beyond one of its faces calls it.
int across(int edge, int axis) {
  const int from = cube_edge_ends()[edge].from ^ 1 << axis;
  int same = 4 * (edge / 4);
  while (cube_edge_ends()[same].from != from) ++same;
  return same;
}

/// The loop that runs through a crossed edge.
int loop_with(int open_corners, int edge) {
  const MarchingLoops& loops = marching_loops()[open_corners];
  int index = 0;
  for (const auto& loop : loops) {
    if (std::find(loop.begin(), loop.end(), edge) != loop.end()) break;
    ++index;
  }
  return index;
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
  vertex_of_edge_.resize(3 * points_of_block);
}

Patch BlockMarcher::march(const Cell& block) {
  origin_ = low_of(block);
  std::fill(sampled_.begin(), sampled_.end(), std::uint8_t{0});
  std::fill(vertex_of_edge_.begin(), vertex_of_edge_.end(), no_vertex);
  vertices_inside_.clear();
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

const std::vector<std::uint8_t>& BlockMarcher::loop_of(const Piece& piece) {
  return marching_loops()[piece.open][static_cast<std::size_t>(piece.loop)];
}

void BlockMarcher::march_cell(const Local& cell, int open) {
  // The table lists the triangles of each loop, two fewer than it has corners, after those of the
  // loops before.
  auto triangle = marching_cases()[open].begin();
  const MarchingLoops& loops = marching_loops()[open];
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto end = triangle + static_cast<std::ptrdiff_t>(loops[i].size()) - 2;
    const Piece piece = {cell, open, static_cast<int>(i)};
    if (has_sharp_edge(piece)) {
      march_sharp(piece);
      triangle = end;
    }
    for (; triangle != end; ++triangle) {
      std::array<std::uint32_t, 3> corners = {};
      std::array<std::uint8_t, 3> materials = {};
      for (std::size_t c = 0; c < 3; ++c) {
        const int axis = (*triangle)[c] / 4;
        const Local from = lower_end(cell, (*triangle)[c]);
        corners[c] = vertex(from, axis);
        materials[c] = material(from, axis);
      }
      // The material of most corners.
      add_triangle(corners[0], corners[1], corners[2],
                   materials[1] == materials[2] ? materials[1] : materials[0]);
    }
  }
}

/// Whether a piece of surface is of several faces: then it gets a vertex inside the cell.
bool BlockMarcher::has_sharp_edge(const Piece& piece) {
  const std::uint8_t first = sample(piece.cell).face;
  bool all_equal = true;
  for (int corner = 1; corner < cube_corners; ++corner)
    if (sample(corner_of(piece.cell, corner)).face != first) all_equal = false;
  if (all_equal) return false;  // almost everywhere
  std::bitset<256> faces;
  for (const int edge : loop_of(piece)) faces.set(crossing_of(piece.cell, edge).face);
  return faces.count() >= 2;
}

/// A fan about the vertex inside. Where a sharp edge leaves the cell between two vertices, their
/// edge is replaced by the one between the vertices inside both cells there; of the two triangles
/// of that quadrilateral this cell makes the one at its loop's first vertex, the other cell the
/// other.
void BlockMarcher::march_sharp(const Piece& piece) {
  const std::vector<std::uint8_t>& loop = loop_of(piece);
  const std::uint32_t middle = vertex_inside(piece);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const int next_edge = loop[(i + 1) % loop.size()];
    const std::uint32_t a = vertex(lower_end(piece.cell, loop[i]), loop[i] / 4);
    const std::uint32_t b = vertex(lower_end(piece.cell, next_edge), next_edge / 4);
    std::uint32_t next = b;
    if (const std::optional<Piece> other = across_sharp_edge(piece, loop[i], next_edge)) {
      const std::uint32_t beyond = vertex_inside(*other);
      if (has_area(a, beyond, middle) && has_area(b, beyond, middle)) next = beyond;
    }
    add_triangle(a, next, middle, crossing_of(piece.cell, loop[i]).material);
  }
}

/// The piece of surface in the next cell to which a sharp edge runs between two vertices of a
/// loop, if one does. The same from both sides: faces belong to vertices, and where they differ,
/// both pieces have vertices inside.
std::optional<BlockMarcher::Piece> BlockMarcher::across_sharp_edge(const Piece& piece, int edge_a,
                                                                   int edge_b) {
  if (crossing_of(piece.cell, edge_a).face == crossing_of(piece.cell, edge_b).face)
    return std::nullopt;
  const CubeFace face = common_face(edge_a, edge_b);
  Piece other;
  other.cell = piece.cell;
  other.cell[face.axis] += face.side == 1 ? 1 : -1;
  other.open = open_corners(other.cell);
  other.loop = loop_with(other.open, across(edge_a, face.axis));
  // Two lines may cross the face between the cells, and be in one loop on either side: two edges
  // would join the same vertices.
  const int corners = corners_in_face(face.axis, face.side);
  for (int edge = 0; edge < cube_edges; ++edge) {
    const CubeEdge ends = cube_edge_ends()[edge];
    const bool in_face = (corners >> ends.from & corners >> ends.to & 1) != 0;
    const bool crossed = (piece.open >> ends.from & 1) != (piece.open >> ends.to & 1);
    if (in_face && crossed && edge != edge_a && edge != edge_b &&
        loop_with(piece.open, edge) == piece.loop &&
        loop_with(other.open, across(edge, face.axis)) == other.loop)
      return std::nullopt;
  }
  return other;
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
  // Relief bends between the samples. Without a second look, waves of a few edges would come out
  // too low on surfaces halfway between lattice points: half of their density at 3 edges.
  double t = a.value / (a.value - b.value);
  Eigen::Vector3d guess = result.place;
  guess[axis] += edge_ * t;
  const double value = surface_.at(guess).value;
  t = (value < 0) == (a.value < 0) ? t + (1 - t) * value / (value - b.value)
                                   : t * a.value / (a.value - value);
  const double least = margin(result.place);
  result.place[axis] += edge_ * std::clamp(t, least, 1 - least);
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
Eigen::Vector3d BlockMarcher::place_inside(const Piece& piece) {
  const std::vector<std::uint8_t>& loop = loop_of(piece);
  const Eigen::Vector3d corner = point(piece.cell);
  // From the corner, in edges.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int edge : loop)
    mean +=
        (crossing_of(piece.cell, edge).place - corner) / (edge_ * static_cast<double>(loop.size()));
  // One plane for each face, the mean of its tangents: so a flat face stays flat where it meets a
  // bent or rough one, and two faces meet in a line whatever their bends.
  struct Plane {
    std::uint8_t face = 0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double offset = 0;
  };
  std::vector<Plane> planes;
  for (const int edge : loop) {
    const std::uint8_t face = crossing_of(piece.cell, edge).face;
    auto plane = std::find_if(planes.begin(), planes.end(),
                              [&](const Plane& known) { return known.face == face; });
    if (plane == planes.end()) plane = planes.insert(plane, {.face = face});
    const Tangent& t = tangent(lower_end(piece.cell, edge), edge / 4);
    plane->normal += t.normal;
    plane->offset += (t.offset - t.normal.dot(corner)) / edge_ - t.normal.dot(mean);
  }
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();  // of the normal equations
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Plane& plane : planes) {
    const double length = plane.normal.norm();
    if (!(length > 0)) continue;
    squares += plane.normal * plane.normal.transpose() / (length * length);
    right += plane.normal * (plane.offset / (length * length));
  }
  // Directions that normals hardly tell apart say nothing: 0.01 of the squares are normals 11
  // degrees apart.
  constexpr double least_square = 0.01;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
  const Eigen::Vector3d values = solver.eigenvalues();  // rising
  const Eigen::Matrix3d axes = solver.eigenvectors();
  Eigen::Vector3d place = mean;
  for (int i = 0; i < 3; ++i)
    if (values[i] > least_square * values[2])
      place += axes.col(i) * (axes.col(i).dot(right) / values[i]);

  const double least = margin(corner);
  Eigen::AlignedBox3d box(Eigen::Vector3d::Constant(least), Eigen::Vector3d::Constant(1 - least));
  if (box.contains(place)) return corner + edge_ * place;
  // Along the line it may still reach into the cell. If not, the line runs past the cell, through
  // one of its lattice edges twice. Then the place may be beyond the faces where no triangle ends:
  // those that no loop crosses, and those whose triangles are turned.
  Eigen::AlignedBox3d wide = box;
  constexpr double reach = 0.5;
  std::array<std::array<bool, 2>, 3> ends = {};
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const int next = loop[(i + 1) % loop.size()];
    const CubeFace face = common_face(loop[i], next);
    if (!across_sharp_edge(piece, loop[i], next)) ends[face.axis][face.side] = true;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!ends[axis][0]) wide.min()[axis] = -reach;
    if (!ends[axis][1]) wide.max()[axis] = 1 + reach;
  }
  // Face 0 is many faces, rough ones in mines: its mean plane is a guess and no reason to leave the
  // cell. There triangles would cross those of neighbours.
  const bool has_rounded =
      std::any_of(planes.begin(), planes.end(), [](const Plane& plane) { return plane.face == 0; });
  const bool is_line =
      values[0] <= least_square * values[2] && values[1] > least_square * values[2];
  const Eigen::Vector3d line = is_line ? Eigen::Vector3d(axes.col(0)) : Eigen::Vector3d::Zero();
  for (const Eigen::AlignedBox3d& allowed : {box, has_rounded ? box : wide})
    if (const std::optional<Eigen::Vector3d> found = moved_into(allowed, place, line))
      return corner + edge_ * *found;
  return corner + edge_ * place.cwiseMax(box.min()).cwiseMin(box.max());
}

BlockMarcher::Crossing BlockMarcher::crossing_of(const Local& cell, int edge) {
  return crossing(lower_end(cell, edge), edge / 4);
}

std::uint32_t BlockMarcher::vertex(const Local& from, int axis) {
  const auto index = static_cast<std::size_t>(
      ((from.z() * block_points + from.y()) * block_points + from.x()) * 3 + axis);
  std::uint32_t& known = vertex_of_edge_[index];
  if (known == no_vertex) known = add_vertex(from, code_of(from, axis), crossing(from, axis).place);
  return known;
}

std::uint32_t BlockMarcher::vertex_inside(const Piece& piece) {
  const std::uint32_t code = code_of(piece.cell, first_inside + piece.loop);
  const auto [known, is_new] = vertices_inside_.try_emplace(code);
  if (is_new) known->second = add_vertex(piece.cell, code, place_inside(piece));
  return known->second;
}

/// Exact: products of differences of floats fit into doubles.
bool BlockMarcher::has_area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const auto place = [&](std::uint32_t v) -> Eigen::Vector3d {
    const Eigen::Vector3f& p = (v & Patch::foreign_bit) != 0
                                   ? patch_.foreign[v & ~Patch::foreign_bit].place
                                   : patch_.vertices[v];
    return p.cast<double>();
  };
  const Eigen::Vector3d origin = place(a);
  return ((place(b) - origin).cross(place(c) - origin).array() != 0).any();
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
    foreign.code = code_of(low - step * block_size, kind_of(code));
    foreign.place = place.cast<float>();
    patch_.foreign.push_back(foreign);
    return Patch::foreign_bit | static_cast<std::uint32_t>(patch_.foreign.size() - 1);
  }
  const auto index = static_cast<std::uint32_t>(patch_.vertices.size());
  patch_.vertices.push_back(place.cast<float>());
  const bool inside = kind_of(code) >= first_inside;
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
