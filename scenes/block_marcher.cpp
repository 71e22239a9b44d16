// SPDX-License-Identifier: MIT
#include "scenes/block_marcher.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bitset>
#include <cassert>
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

// Points of a block and more to each side: what a cell joins depends on its neighbours, and on what
// these join. From a cell of the block to the one beyond a face, to an empty one there, to another
// cell with an exit to it, to the one that this wants, and to another one that wants that.
constexpr int more_points = 5;
constexpr int known_points = block_size + 1 + 2 * more_points;
constexpr int block_points = block_size + 1;
constexpr std::size_t points_of_block = block_points * block_points * block_points;
constexpr std::uint32_t no_vertex = ~0U;

std::size_t index_of(const Eigen::Vector3i& p) {
  const Eigen::Vector3i q = p + Eigen::Vector3i::Constant(more_points);
  assert(q.minCoeff() >= 0 && q.maxCoeff() < known_points);
  return static_cast<std::size_t>((q.z() * known_points + q.y()) * known_points + q.x());
}

/// Names the vertex on an edge of the lattice, by its lower end and its axis; with `inside` the one
/// inside of a cell, by its low corner, and with in_face + axis the one in the cell's lower face.
constexpr int inside = 3;
constexpr int in_face = 4;
constexpr int codes_per_point = 7;
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

/// How many lines cross a face of a cube: 0 to 2.
int lines_in_face(int open_corners, const CubeFace& face) {
  const int corners = corners_in_face(face.axis, face.side);
  int ends = 0;
  for (const CubeEdge& edge : cube_edge_ends())
    if ((corners >> edge.from & corners >> edge.to & 1) != 0 &&
        (open_corners >> edge.from & 1) != (open_corners >> edge.to & 1))
      ++ends;
  return ends / 2;
}

bool is_empty(int open_corners) { return open_corners == 0 || open_corners == 0xff; }

Eigen::Vector3i step_through(const CubeFace& face) {
  return (face.side == 1 ? 1 : -1) * Eigen::Vector3i::Unit(face.axis);
}

const std::array<Eigen::Vector3i, 6>& steps() {
  static const std::array<Eigen::Vector3i, 6> list = {step_through({0, 0}), step_through({0, 1}),
                                                      step_through({1, 0}), step_through({1, 1}),
                                                      step_through({2, 0}), step_through({2, 1})};
  return list;
}

/// The face of the unit cube through which a line leaves it, from a place inside.
CubeFace way_out(const Eigen::Vector3d& p, const Eigen::Vector3d& d) {
  CubeFace face;
  double first = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) continue;
    const int side = d[axis] > 0 ? 1 : 0;
    const double t = (side - p[axis]) / d[axis];
    if (t >= first) continue;
    first = t;
    face = {axis, side};
  }
  return face;
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

/// The last place within a box on the way from p to q, if there is one; or else the nearest to p.
Eigen::Vector3d nearest_in(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p,
                           const Eigen::Vector3d& q) {
  if (const auto found = moved_into(box, p, q - p)) return *found;
  return p.cwiseMax(box.min()).cwiseMin(box.max());
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
  sites_.clear();
  places_inside_.clear();
  more_vertices_.clear();
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
  if (const std::optional<Region> region = region_of(cell)) return march_region(cell, *region);
  for (const auto& triangle : marching_cases()[open]) {
    std::array<std::uint32_t, 3> corners = {};
    std::array<std::uint8_t, 3> materials = {};
    for (std::size_t c = 0; c < 3; ++c) {
      const int axis = triangle[c] / 4;
      const Local from = lower_end(cell, triangle[c]);
      corners[c] = vertex(from, axis);
      materials[c] = material(from, axis);
    }
    // The material of most corners.
    add_triangle(corners[0], corners[1], corners[2],
                 materials[1] == materials[2] ? materials[1] : materials[0]);
  }
}

/// A cell's part of its region's fan.
void BlockMarcher::march_region(const Local& cell, const Region& region) {
  const Step to_other = cell == region.cell ? region.to_other : Step(-region.to_other);
  const std::uint32_t middle = vertex_inside(region);
  for (const auto& loop : marching_loops()[site(cell).open])
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const int edge_a = loop[i], edge_b = loop[(i + 1) % loop.size()];
      if (step_through(common_face(edge_a, edge_b)) == to_other) continue;
      const std::uint32_t a = vertex(lower_end(cell, edge_a), edge_a / 4);
      const std::uint32_t b = vertex(lower_end(cell, edge_b), edge_b / 4);
      const std::uint8_t material_a = crossing_of(cell, edge_a).material;
      if (const std::optional<std::uint32_t> bend = vertex_in_face(cell, edge_a, edge_b)) {
        add_triangle(a, *bend, middle, material_a);
        add_triangle(*bend, b, middle, crossing_of(cell, edge_b).material);
      } else {
        add_triangle(a, b, middle, material_a);
      }
    }
}

/// Whether different faces are nearest to a cell's corners.
bool BlockMarcher::is_mixed(const Local& cell) {
  const std::uint8_t first = sample(cell).face;
  for (int corner = 1; corner < cube_corners; ++corner)
    if (sample(corner_of(cell, corner)).face != first) return true;
  return false;
}

const BlockMarcher::Site& BlockMarcher::site(const Local& cell) {
  const auto [known, is_new] = sites_.try_emplace(code_of(cell, inside));
  Site& result = known->second;
  if (!is_new) return result;
  for (int corner = 0; corner < cube_corners; ++corner)
    if (sample(corner_of(cell, corner)).value < 0) result.open |= 1 << corner;
  const MarchingLoops& loops = marching_loops()[result.open];
  if (loops.size() != 1 || !is_mixed(cell)) return result;
  std::bitset<256> faces;
  for (const int edge : loops.front()) faces.set(crossing_of(cell, edge).face);
  result.is_sharp = faces.count() >= 2;
  if (result.is_sharp) look_for_edge(cell, result);
  return result;
}

/// Where the sharp edge goes from here, or where it is instead.
void BlockMarcher::look_for_edge(const Local& cell, Site& site) {
  const Feature feature = feature_of({cell});
  if (feature.rank == 1) return;
  if (const auto here = moved_into(box_of({cell}), feature.place, feature.along)) {
    if (feature.rank != 2) return;
    for (std::size_t i = 0; i < 2; ++i) {
      const CubeFace face =
          way_out(*here, i == 0 ? feature.along : Eigen::Vector3d(-feature.along));
      if (lines_in_face(site.open, face) == 0) site.exits[i] = step_through(face);
    }
    return;
  }
  double nearest = std::numeric_limits<double>::infinity();
  for (const Step& step : steps()) {
    const auto there = moved_into(box_of({cell, step}), feature.place, feature.along);
    if (!there) continue;
    const double distance = (*there - feature.place).norm();
    if (!(distance < nearest)) continue;
    nearest = distance;
    site.wanted = step;
  }
}

/// Whether the surface in two cells together is cut by their outer faces along one loop.
bool BlockMarcher::makes_one_loop(const Local& cell, const Step& step) {
  using Line = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Line> lines;
  for (const auto& [part, to_other] :
       {std::pair(cell, step), std::pair(Local(cell + step), Step(-step))})
    for (const auto& loop : marching_loops()[site(part).open])
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const int edge_a = loop[i], edge_b = loop[(i + 1) % loop.size()];
        if (step_through(common_face(edge_a, edge_b)) == to_other) continue;
        lines.emplace_back(code_of(lower_end(part, edge_a), edge_a / 4),
                           code_of(lower_end(part, edge_b), edge_b / 4));
      }
  std::sort(lines.begin(), lines.end());
  std::size_t length = 1;
  for (Line line = lines.front(); line.second != lines.front().first; ++length)
    line = *std::lower_bound(lines.begin(), lines.end(), Line(line.second, 0));
  return length == lines.size();
}

/// Whether a cell joins the neighbour that it wants. That one may want this one but no third, and
/// of several that want it the first has it.
bool BlockMarcher::joins(const Local& cell, const Step& step) {
  if (step == Step::Zero() || site(cell).wanted != step) return false;
  const Local other = cell + step;
  const Site& there = site(other);
  if (there.wanted != Step::Zero() && there.wanted != -step) return false;
  if (!is_empty(there.open) && !(is_mixed(other) && makes_one_loop(cell, step))) return false;
  for (const Step& back : steps()) {
    if (back == -step) break;
    if (site(other + back).wanted == -back) return false;
  }
  return true;
}

BlockMarcher::Step BlockMarcher::joined_with(const Local& cell) {
  if (const Step wanted = site(cell).wanted; joins(cell, wanted)) return wanted;
  for (const Step& step : steps())
    if (joins(cell + step, -step)) return step;
  return Step::Zero();
}

/// Whether a cell that has not joined another one takes in the empty one to which its edge goes, so
/// that the edge can go on from there. Of several such cells only the first may.
bool BlockMarcher::annexes(const Local& cell, const Step& step) {
  if (step == Step::Zero() || !is_empty(site(cell + step).open)) return false;
  bool is_first = true;
  for (const Step& back : steps()) {
    if (back == -step) {
      is_first = false;
      continue;
    }
    const Local third = cell + step + back;
    const Site& there = site(third);
    if (there.wanted == -back) return false;
    const bool goes_there = there.exits[0] == -back || there.exits[1] == -back;
    if (is_first && goes_there && joined_with(third) == Step::Zero()) return false;
  }
  return true;
}

/// The region of a cell with surface, if it is at a sharp edge.
std::optional<BlockMarcher::Region> BlockMarcher::region_of(const Local& cell) {
  if (!is_mixed(cell)) return std::nullopt;  // almost everywhere
  const Step other = joined_with(cell);
  if (other != Step::Zero()) {
    const bool is_first = is_empty(site(cell + other).open) || other.sum() > 0;
    return is_first ? Region{cell, other} : Region{cell + other, -other};
  }
  if (!site(cell).is_sharp) return std::nullopt;
  for (const Step& exit : site(cell).exits)
    if (annexes(cell, exit)) return Region{cell, exit};
  return Region{cell};
}

const ImplicitSurface::Sample& BlockMarcher::sample(const Local& p) {
  const std::size_t i = index_of(p);
  if (sampled_[i] == 0) samples_[i] = surface_.at(point(p));
  sampled_[i] = 1;
  return samples_[i];
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

/// Where the planes of all crossings in a region meet: on the sharp edge between two faces, at the
/// tip of three.
BlockMarcher::Feature BlockMarcher::feature_of(const Region& region) {
  std::vector<std::pair<Local, int>> crossings;
  const auto add_crossings = [&](const Local& cell) {
    for (const auto& loop : marching_loops()[site(cell).open])
      for (const int edge : loop) crossings.emplace_back(lower_end(cell, edge), edge / 4);
  };
  add_crossings(region.cell);
  if (region.to_other != Step::Zero()) add_crossings(region.cell + region.to_other);

  const Eigen::Vector3d corner = point(region.cell);
  const auto in_edges = [&](const auto& at) -> Eigen::Vector3d {
    return (crossing(at.first, at.second).place - corner) / edge_;
  };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& at : crossings) mean += in_edges(at) / static_cast<double>(crossings.size());
  // One plane for each face, the mean of its tangents: so a flat face stays flat where it meets a
  // bent or rough one, and two faces meet in a line whatever their bends.
  struct Plane {
    std::uint8_t face = 0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double offset = 0;
    Eigen::Vector3d places = Eigen::Vector3d::Zero();
    int count = 0;
  };
  std::vector<Plane> planes;
  for (const auto& at : crossings) {
    const std::uint8_t face = crossing(at.first, at.second).face;
    auto plane = std::find_if(planes.begin(), planes.end(),
                              [&](const Plane& known) { return known.face == face; });
    if (plane == planes.end()) plane = planes.insert(plane, {.face = face});
    const Tangent& t = tangent(at.first, at.second);
    plane->normal += t.normal;
    plane->offset += (t.offset - t.normal.dot(corner)) / edge_ - t.normal.dot(mean);
    plane->places += in_edges(at);
    ++plane->count;
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
  Feature feature;
  feature.place = mean;
  for (int i = 0; i < 3; ++i) {
    if (!(values[i] > least_square * values[2])) continue;
    feature.place += axes.col(i) * (axes.col(i).dot(right) / values[i]);
    ++feature.rank;
  }
  if (feature.rank == 2) feature.along = axes.col(0);
  const Plane& last = *std::max_element(
      planes.begin(), planes.end(), [](const Plane& a, const Plane& b) { return a.face < b.face; });
  feature.on_face = last.places / last.count;
  return feature;
}

/// Where a region's vertex may be, from the low corner of its first cell, in edges.
Eigen::AlignedBox3d BlockMarcher::box_of(const Region& region) const {
  const double least = margin(point(region.cell));
  const Eigen::Vector3d step = region.to_other.cast<double>();
  return {step.cwiseMin(0.0) + Eigen::Vector3d::Constant(least),
          step.cwiseMax(0.0) + Eigen::Vector3d::Constant(1 - least)};
}

/// On the sharp edge or tip if that is in the region; otherwise as near as one gets on one of the
/// faces, the last one, since face 0 is rough and others may be flat.
const Eigen::Vector3f& BlockMarcher::place_inside(const Region& region) {
  const auto [known, is_new] = places_inside_.try_emplace(code_of(region.cell, inside));
  if (!is_new) return known->second;
  const Feature feature = feature_of(region);
  const Eigen::AlignedBox3d box = box_of(region);
  std::optional<Eigen::Vector3d> place = moved_into(box, feature.place, feature.along);
  if (!place) place = nearest_in(box, feature.place, feature.on_face);
  known->second = (point(region.cell) + edge_ * *place).cast<float>();
  return known->second;
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

std::uint32_t BlockMarcher::vertex_inside(const Region& region) {
  const std::uint32_t code = code_of(region.cell, inside);
  const auto [known, is_new] = more_vertices_.try_emplace(code);
  if (is_new) known->second = add_vertex(region.cell, code, place_inside(region).cast<double>());
  return known->second;
}

/// Where a sharp edge goes through a face of a cell, between two vertices of a loop; none where
/// there is no sharp edge. The same from both sides.
std::optional<std::uint32_t> BlockMarcher::vertex_in_face(const Local& cell, int edge_a,
                                                          int edge_b) {
  if (crossing_of(cell, edge_a).face == crossing_of(cell, edge_b).face) return std::nullopt;
  // Two bent lines in one face might cross each other.
  const CubeFace face = common_face(edge_a, edge_b);
  if (lines_in_face(site(cell).open, face) != 1) return std::nullopt;
  const Local low_cell = face.side == 1 ? cell : Local(cell - Local::Unit(face.axis));
  const Local high_cell = low_cell + Local::Unit(face.axis);
  const std::optional<Region> low = region_of(low_cell);
  const std::optional<Region> high = region_of(high_cell);
  if (!low || !high) return std::nullopt;
  const std::uint32_t code = code_of(high_cell, in_face + face.axis);
  const auto [known, is_new] = more_vertices_.try_emplace(code);
  if (!is_new) return known->second;

  // Between two regions side by side, it may be in the other half of their common face if there is
  // nothing else.
  Region both = {high_cell};
  const Step beside = high->cell == high_cell ? high->to_other : Step(-high->to_other);
  if (beside == (low->cell == low_cell ? low->to_other : Step(-low->to_other)) &&
      lines_in_face(site(high_cell + beside).open, {face.axis, 0}) == 0)
    both.to_other = beside;
  Eigen::AlignedBox3d box = box_of(both);
  box.min()[face.axis] = -1;
  const Eigen::Vector3d corner = point(high_cell);
  const Eigen::Vector3d from = place_inside(*low).cast<double>();
  const Eigen::Vector3d to = place_inside(*high).cast<double>();
  const double part = (corner[face.axis] - from[face.axis]) / (to[face.axis] - from[face.axis]);
  const Eigen::Vector3d place = (from + part * (to - from) - corner) / edge_;
  // On the last face, as in place_inside.
  const Crossing a = crossing_of(cell, edge_a), b = crossing_of(cell, edge_b);
  const Eigen::Vector3d& on_face = a.face > b.face ? a.place : b.place;
  Eigen::Vector3d bend = nearest_in(box, place, (on_face - corner) / edge_);
  bend[face.axis] = 0;
  known->second = add_vertex(high_cell, code, corner + edge_ * bend);
  return known->second;
}

/// The vertex belongs to the block that holds the lattice point `low`.
std::uint32_t BlockMarcher::add_vertex(const Local& low, std::uint32_t code,
                                       const Eigen::Vector3d& place) {
  Local step = Local::Zero();
  bool at_face = false;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = low[axis] < 0 ? -1 : low[axis] / block_size;
    // Regions that other blocks see are named by a cell at a face or the one before.
    if (low[axis] == 0 || low[axis] >= block_size - 2) at_face = true;
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
  if (kind_of(code) >= inside ? at_face : low.minCoeff() == 0) patch_.rim.push_back({code, index});
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
