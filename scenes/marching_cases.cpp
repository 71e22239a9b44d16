// SPDX-License-Identifier: MIT
// The table of marching cubes, derived instead of copied.
//
// A cube's surface crosses each face of the cube along lines between crossed edges. Which crossings
// a line joins depends on the signs at the four corners of that face only, so the two cubes at a
// face always agree and no hole can open; where two open corners lie on a diagonal, they are
// separated. The lines of the six faces join to closed loops. A loop is cut into triangles by
// diagonals through the inside of the cube only: a diagonal within a face could be drawn by both
// cubes at the face, and four triangles would share it. Each loop of the 256 cases has such a cut,
// so the mesh is a closed 2-manifold for any signs.
#include <cassert>
#include <optional>
#include <utility>

#include "scenes/contour.h"

namespace minescan {
namespace {

using Loop = MarchingLoops::value_type;

/// The corners of a face, counter-clockwise seen from outside.
std::array<int, 4> face_corners(int axis, int side) {
  const int first = 1 << (axis + 1) % 3;
  const int second = 1 << (axis + 2) % 3;
  const int base = side << axis;
  if (side == 0) return {base, base | second, base | first | second, base | first};
  return {base, base | first, base | first | second, base | second};
}

int edge_between(int a, int b) {
  const auto& ends = cube_edge_ends();
  for (int e = 0; e < cube_edges; ++e)
    if ((ends[e].from == a && ends[e].to == b) || (ends[e].from == b && ends[e].to == a)) return e;
  assert(false && "not an edge");
  return -1;
}

bool share_a_face(int edge_a, int edge_b) {
  const auto& ends = cube_edge_ends();
  const int in_all = ends[edge_a].from & ends[edge_a].to & ends[edge_b].from & ends[edge_b].to;
  const int in_any = ends[edge_a].from | ends[edge_a].to | ends[edge_b].from | ends[edge_b].to;
  return in_all != 0 || in_any != 7;
}

/// The triangles of a loop, all at one of its corners; none if each choice needs a diagonal within
/// a face.
std::optional<MarchingCase> triangulated(const Loop& loop) {
  const std::size_t size = loop.size();
  for (std::size_t first = 0; first < size; ++first) {
    const auto corner = [&](std::size_t i) { return loop[(first + i) % size]; };
    bool all_inside = true;
    MarchingCase triangles;
    for (std::size_t i = 1; i + 1 < size; ++i) {
      if (i > 1 && share_a_face(corner(0), corner(i))) all_inside = false;
      triangles.push_back({corner(0), corner(i), corner(i + 1)});
    }
    if (all_inside) return triangles;
  }
  return std::nullopt;
}

MarchingLoops loops_of(int open_corners) {
  const auto open = [&](int corner) { return (open_corners >> corner & 1) != 0; };
  // Around each face, a run of open corners is cut off by a line from the edge where the run ends
  // to the edge where it begins; in this direction the loops run counter-clockwise seen from the
  // open.
  std::array<int, cube_edges> next = {};
  next.fill(-1);
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const std::array<int, 4> c = face_corners(axis, side);
      for (int begin = 0; begin < 4; ++begin) {
        if (open(c[(begin + 3) % 4]) || !open(c[begin])) continue;
        int end = begin;
        while (open(c[(end + 1) % 4])) end = (end + 1) % 4;
        next[edge_between(c[end], c[(end + 1) % 4])] = edge_between(c[(begin + 3) % 4], c[begin]);
      }
    }
  }
  MarchingLoops loops;
  for (int start = 0; start < cube_edges; ++start) {
    Loop loop;
    for (int edge = start; next[edge] >= 0; edge = std::exchange(next[edge], -1))
      loop.push_back(static_cast<std::uint8_t>(edge));
    if (!loop.empty()) loops.push_back(loop);
  }
  return loops;
}

MarchingCase triangles_of(const MarchingLoops& loops) {
  MarchingCase triangles;
  for (const Loop& loop : loops) {
    const std::optional<MarchingCase> cut = triangulated(loop);
    assert(cut);
    triangles.insert(triangles.end(), cut->begin(), cut->end());
  }
  return triangles;
}

}  // namespace

const std::array<CubeEdge, cube_edges>& cube_edge_ends() {
  static const std::array<CubeEdge, cube_edges> ends = [] {
    std::array<CubeEdge, cube_edges> list = {};
    std::size_t e = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int corner = 0; corner < cube_corners; ++corner)
        if ((corner >> axis & 1) == 0)
          list[e++] = {.from = static_cast<std::uint8_t>(corner),
                       .to = static_cast<std::uint8_t>(corner | 1 << axis)};
    return list;
  }();
  return ends;
}

const std::array<MarchingLoops, 256>& marching_loops() {
  static const std::array<MarchingLoops, 256> loops = [] {
    std::array<MarchingLoops, 256> list = {};
    for (int open_corners = 0; open_corners < 256; ++open_corners)
      list[open_corners] = loops_of(open_corners);
    return list;
  }();
  return loops;
}

const std::array<MarchingCase, 256>& marching_cases() {
  static const std::array<MarchingCase, 256> cases = [] {
    std::array<MarchingCase, 256> list = {};
    for (int open_corners = 0; open_corners < 256; ++open_corners)
      list[open_corners] = triangles_of(marching_loops()[open_corners]);
    return list;
  }();
  return cases;
}

}  // namespace minescan
