// SPDX-License-Identifier: MIT
// Search of a kd-tree for several queries at once, each in its lane of wide registers.
#pragma once

#include <cstddef>
#include <cstdint>

namespace minescan {

/// A node of a kd-tree. Inner ones have a split axis and two children; the space between the
/// children is left out.
struct KdNode {
  double low = 0;   // the first child's points are not beyond this along `axis`
  double high = 0;  // the second child's are not before this
  // Of an inner node the number of its second child (the first one follows directly), of a leaf
  // where its points begin.
  std::uint32_t second_or_begin = 0;
  std::uint16_t count = 0;  // points of a leaf
  std::int8_t axis = -1;    // -1: a leaf
};
/// Levels of nodes, at most.
constexpr std::size_t kd_levels = 72;

/// The box around the points of a node, rounded outwards: metres.
struct KdBox {
  float low[3], high[3];
};

/// The arrays of a kd-tree with points.
struct KdArrays {
  const KdNode* nodes = nullptr;  // the root first
  const KdBox* boxes = nullptr;   // of each node
  // Leaf by leaf, x of `group` points, then y, then z of them. Leaves begin with a group and are
  // filled up with points that are nowhere.
  static constexpr std::size_t group = 4;
  const double* xyz = nullptr;
};

/// Queries, and what is known of the points nearest to each.
struct KdPacket {
  static constexpr std::size_t size = 8;
  double x[size], y[size], z[size];  // metres
  // Squared distances, m^2: to the nearest point, and to all others at least. Before the search
  // those beyond which no point counts.
  double nearest[size], rest[size];
  double place[size];  // of the nearest point in the order of xyz, negative: none
};

/// Looks for the points nearer than packet.rest: for all queries in each box that one of them
/// reaches, so that it takes the less time the closer together they are. Distances are the same to
/// the last bit as with one query after the other; of points equally far another may be found.
void search_packet(const KdArrays& tree, KdPacket& packet);

}  // namespace minescan
