// SPDX-License-Identifier: MIT
#include "registration/kdtree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "registration/bounds.h"

namespace minescan {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t lanes = KdArrays::group;
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));

// Every squared distance is summed in this order, those to boxes as well as those to points: since
// rounding is monotonic, a box is then never further away than a point in it, not even by a bit.
double sum_of_squares(double x, double y, double z) { return x * x + y * y + z * z; }

void load(const double* from, Lanes& v) { std::memcpy(&v, from, sizeof(v)); }

// Levels of the tree at which boxes are split half way (see build); assumed. 72 k points of a scan
// take about 20. The others halve the points, as often as an index has bits.
constexpr int midpoint_levels = 40;
static_assert(midpoint_levels + 32 == kd_levels);

KdBox rounded_outwards(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  constexpr float everything = std::numeric_limits<float>::infinity();
  KdBox box;
  for (int i = 0; i < 3; ++i) {
    box.low[i] = static_cast<float>(low[i]);
    box.high[i] = static_cast<float>(high[i]);
    if (box.low[i] > low[i]) box.low[i] = std::nextafter(box.low[i], -everything);
    if (box.high[i] < high[i]) box.high[i] = std::nextafter(box.high[i], everything);
  }
  return box;
}

std::size_t whole_registers(std::size_t count) { return (count + lanes - 1) / lanes * lanes; }

}  // namespace

template <class Visit>
void KdTree::for_each_distance(const KdTree& tree, const KdNode& leaf, const Eigen::Vector3d& query,
                               Visit&& visit) {
  const std::size_t begin = leaf.second_or_begin, end = begin + whole_registers(leaf.count);
  for (std::size_t at = begin; at < end; at += lanes) {
    Lanes x, y, z;
    const double* const four = &tree.xyz_[3 * at];
    load(four, x);
    load(four + lanes, y);
    load(four + 2 * lanes, z);
    x -= query.x(), y -= query.y(), z -= query.z();
    const Lanes d = x * x + y * y + z * z;
    for (std::size_t i = 0; i < lanes; ++i) visit(d[i], at + i);
  }
}

// What a search keeps: the query, which boxes are near enough to look into (those at a squared
// distance below `prune`), and what it has found.
struct KdTree::Search {
  const Eigen::Vector3d& query;
  TreePolicy policy = {};
  double best = 0;  // squared distance of the best so far, at first of the limit
  double prune = 0;
  std::size_t found = std::numeric_limits<std::size_t>::max();  // place of the best

  bool reaches(double squared) const { return squared < prune; }
  void scan(const KdTree& tree, const KdNode& leaf) {
    const std::size_t before = found;
    for_each_distance(tree, leaf, query, [&](double squared, std::size_t at) {
      if (!(squared < best)) return;
      best = squared;
      found = at;
    });
    if (found == before) return;
    prune = best;
    if (policy.search == TreeSearch::relative || policy.search == TreeSearch::additive) {
      const double reach = policy.search == TreeSearch::relative
                               ? std::sqrt(best) / (1 + policy.bound)
                               : std::sqrt(best) - policy.bound;
      prune = reach > 0 ? reach * reach : 0;
    }
  }
};

struct KdTree::SearchOfTwo {
  const Eigen::Vector3d& query;
  double best = 0;    // squared distances
  double second = 0;  // of all others at least
  std::size_t found = std::numeric_limits<std::size_t>::max();

  bool reaches(double squared) const { return squared < second; }
  void scan(const KdTree& tree, const KdNode& leaf) {
    for_each_distance(tree, leaf, query, [&](double squared, std::size_t at) {
      if (!(squared < second)) return;
      if (squared < best) {
        second = best;
        best = squared;
        found = at;
      } else {
        second = squared;
      }
    });
  }
};

struct KdTree::SearchOfMany {
  const Eigen::Vector3d& query;
  std::size_t k = 0;
  double limit = 0;               // squared distance
  std::vector<Neighbour>& found;  // nearest first

  static bool nearer(const Neighbour& a, const Neighbour& b) {
    return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                    : a.index < b.index;
  }
  bool full() const { return found.size() == k; }
  /// Boxes as far away as the worst may still hold an equal point with a smaller index.
  bool reaches(double squared) const {
    return full() ? squared <= found.back().squared_distance : squared < limit;
  }
  /// Into its place: for the ten or twenty that are asked for a heap takes longer.
  void offer(const Neighbour& candidate) {
    if (full()) {
      if (!nearer(candidate, found.back())) return;
      found.pop_back();
    }
    found.push_back(candidate);
    for (std::size_t i = found.size() - 1; i > 0 && nearer(candidate, found[i - 1]); --i)
      std::swap(found[i], found[i - 1]);
  }
  void scan(const KdTree& tree, const KdNode& leaf) {
    for_each_distance(tree, leaf, query, [&](double squared, std::size_t at) {
      if (squared < limit) offer({.index = tree.index_[at], .squared_distance = squared});
    });
  }
};

KdTree::KdTree(const std::vector<Eigen::Vector3d>& points, int leaf_size) {
  assert(!points.empty() && leaf_size >= 1 && leaf_size <= max_leaf_size);
  std::vector<Entry> entries;
  entries.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    entries.push_back({points[i], static_cast<std::uint32_t>(i)});
  const Bounds bounds = bounds_of(points);
  low_ = bounds.low;
  high_ = bounds.high;
  const auto size = static_cast<std::size_t>(leaf_size);
  nodes_.reserve(4 * points.size() / size + 1);
  boxes_.reserve(4 * points.size() / size + 1);
  xyz_.reserve(5 * points.size());
  index_.reserve(points.size() * 3 / 2 + lanes);
  build(entries, 0, points.size(), size, 0);
}

void KdTree::build(std::vector<Entry>& entries, std::size_t begin, std::size_t end,
                   std::size_t leaf_size, int depth) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  Eigen::Vector3d low = entries[begin].point, high = low;
  for (std::size_t i = begin + 1; i < end; ++i) {
    low = low.cwiseMin(entries[i].point);
    high = high.cwiseMax(entries[i].point);
  }
  boxes_.push_back(rounded_outwards(low, high));
  if (end - begin <= leaf_size) {
    // By index: in which order a partition leaves them is the standard library's affair.
    const auto at = entries.begin();
    std::sort(at + static_cast<std::ptrdiff_t>(begin), at + static_cast<std::ptrdiff_t>(end),
              [](const Entry& a, const Entry& b) { return a.index < b.index; });
    add_leaf(entries, begin, end, nodes_[self]);
    return;
  }
  int axis = 0;
  const double longest = (high - low).maxCoeff(&axis);
  const auto at = [&](std::size_t i) { return entries.begin() + static_cast<std::ptrdiff_t>(i); };
  std::size_t middle = 0;
  // Half way along the longest side, which takes one pass. Points that crowd ever closer together
  // would make the tree as deep as there are points: after many levels half of them go to each
  // side.
  if (depth < midpoint_levels && longest > 0) {
    const double split = low[axis] + longest / 2;
    middle = static_cast<std::size_t>(
        std::partition(at(begin), at(end), [&](const Entry& e) { return e.point[axis] <= split; }) -
        entries.begin());
  }
  if (middle <= begin || middle >= end) {
    middle = begin + (end - begin) / 2;
    std::nth_element(at(begin), at(middle), at(end), [axis](const Entry& a, const Entry& b) {
      // The index makes the halves, and with them the tree, the same for every standard library.
      return a.point[axis] != b.point[axis] ? a.point[axis] < b.point[axis] : a.index < b.index;
    });
  }
  double below = entries[begin].point[axis], above = entries[middle].point[axis];
  for (std::size_t i = begin; i < middle; ++i) below = std::max(below, entries[i].point[axis]);
  for (std::size_t i = middle; i < end; ++i) above = std::min(above, entries[i].point[axis]);
  nodes_[self].axis = static_cast<std::int8_t>(axis);
  nodes_[self].low = below;
  nodes_[self].high = above;
  build(entries, begin, middle, leaf_size, depth + 1);
  nodes_[self].second_or_begin = static_cast<std::uint32_t>(nodes_.size());
  build(entries, middle, end, leaf_size, depth + 1);
}

void KdTree::add_leaf(const std::vector<Entry>& entries, std::size_t begin, std::size_t end,
                      KdNode& node) {
  node.second_or_begin = static_cast<std::uint32_t>(index_.size());
  node.count = static_cast<std::uint16_t>(end - begin);
  for (std::size_t i = begin; i < end; i += lanes) {
    for (int axis = 0; axis < 3; ++axis)
      for (std::size_t k = i; k < i + lanes; ++k)
        xyz_.push_back(k < end ? entries[k].point[axis] : infinity);
    for (std::size_t k = i; k < i + lanes; ++k) index_.push_back(k < end ? entries[k].index : 0);
  }
}

const KdNode& KdTree::leaf_of(const Eigen::Vector3d& query) const {
  std::uint32_t at = 0;
  while (nodes_[at].axis >= 0) {
    const KdNode& node = nodes_[at];
    const double q = query[node.axis];
    at = (q - node.low) + (q - node.high) < 0 ? at + 1 : node.second_or_begin;
  }
  return nodes_[at];
}

std::optional<Neighbour> KdTree::nearest(const Eigen::Vector3d& query, double max_distance,
                                         const TreePolicy& policy) const {
  const double limit = max_distance * max_distance;
  Search search{.query = query, .policy = policy, .best = limit, .prune = limit};
  if (policy.search == TreeSearch::leaf) {
    search.scan(*this, leaf_of(query));
  } else {
    run(search);
  }
  if (search.found >= index_.size()) return {};
  return Neighbour{.index = index_[search.found], .squared_distance = search.best};
}

KdTree::NearestAndRest KdTree::nearest_and_rest(const Eigen::Vector3d& query,
                                                double max_distance) const {
  const double limit = max_distance * max_distance;
  SearchOfTwo search{.query = query, .best = limit, .second = limit};
  run(search);
  NearestAndRest result{.rest = std::sqrt(search.second)};
  if (search.found < index_.size())
    result.nearest = {.index = index_[search.found], .squared_distance = search.best};
  return result;
}

KdTree::NearestAndRestOfEach KdTree::nearest_and_rest(std::span<const Eigen::Vector3d> queries,
                                                      double max_distance) const {
  assert(!queries.empty() && queries.size() <= KdPacket::size);
  KdPacket packet;
  for (std::size_t i = 0; i < KdPacket::size; ++i) {
    const Eigen::Vector3d& query = queries[std::min(i, queries.size() - 1)];
    packet.x[i] = query.x();
    packet.y[i] = query.y();
    packet.z[i] = query.z();
    packet.nearest[i] = packet.rest[i] = max_distance * max_distance;
    packet.place[i] = -1;
  }
  search_packet({.nodes = nodes_.data(), .boxes = boxes_.data(), .xyz = xyz_.data()}, packet);
  NearestAndRestOfEach result;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    result[i].rest = std::sqrt(packet.rest[i]);
    if (packet.place[i] >= 0)
      result[i].nearest = {.index = index_[static_cast<std::size_t>(packet.place[i])],
                           .squared_distance = packet.nearest[i]};
  }
  return result;
}

std::vector<std::uint32_t> KdTree::order() const {
  std::vector<std::uint32_t> list;
  list.reserve(index_.size());
  for (const KdNode& node : nodes_) {
    if (node.axis >= 0) continue;
    const auto begin = index_.begin() + node.second_or_begin;
    list.insert(list.end(), begin, begin + node.count);
  }
  return list;
}

void KdTree::nearest(const Eigen::Vector3d& query, std::size_t k, double max_distance,
                     std::vector<Neighbour>& found) const {
  found.clear();
  if (k == 0) return;
  SearchOfMany search{.query = query, .k = k, .limit = max_distance * max_distance, .found = found};
  run(search);
}

template <class AnySearch>
void KdTree::run(AnySearch& search) const {
  // Boxes still to be looked into. The way from the query to a box differs from that to its
  // parent's along one axis only (Arya and Mount 1993).
  struct Box {
    double x, y, z;  // along each axis
    double squared;
    std::uint32_t node;
  };
  // Each level leaves one box.
  Box boxes[kd_levels];  // not initialised: that would take longer than the search
  std::size_t count = 0;
  const auto side = [&](int i) {
    return std::max({low_[i] - search.query[i], search.query[i] - high_[i], 0.0});
  };
  Box box{.x = side(0), .y = side(1), .z = side(2), .squared = 0, .node = 0};
  box.squared = sum_of_squares(box.x, box.y, box.z);
  if (!search.reaches(box.squared)) return;
  for (;;) {
    while (nodes_[box.node].axis >= 0) {
      const KdNode& node = nodes_[box.node];
      const double to_low = search.query[node.axis] - node.low;
      const double to_high = search.query[node.axis] - node.high;
      const bool first_is_near = to_low + to_high < 0;  // before the middle of the gap
      const double to_far = first_is_near ? to_high : to_low;
      const std::uint32_t near = first_is_near ? box.node + 1 : node.second_or_begin;
      Box& far = boxes[count];
      far.x = node.axis == 0 ? to_far : box.x;
      far.y = node.axis == 1 ? to_far : box.y;
      far.z = node.axis == 2 ? to_far : box.z;
      far.squared = sum_of_squares(far.x, far.y, far.z);
      far.node = first_is_near ? node.second_or_begin : box.node + 1;
      count += static_cast<std::size_t>(search.reaches(far.squared));
      box.node = near;
    }
    search.scan(*this, nodes_[box.node]);
    do {
      if (count == 0) return;
      --count;
    } while (!search.reaches(boxes[count].squared));
    box = boxes[count];
  }
}

std::size_t KdTree::bytes() const {
  return nodes_.size() * (sizeof(KdNode) + sizeof(KdBox)) + xyz_.size() * sizeof(double) +
         index_.size() * sizeof(index_[0]);
}

}  // namespace minescan
