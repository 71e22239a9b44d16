// SPDX-License-Identifier: MIT
#include "registration/kdtree.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace minescan {

namespace {

// Every squared distance is summed in this order, those to boxes as well as those to points: since
// rounding is monotonic, a box is then never further away than a point in it, not even by a bit.
double sum_of_squares(double x, double y, double z) { return x * x + y * y + z * z; }

}  // namespace

struct KdTree::Search {
  const Eigen::Vector3d& query;
  double error = 0;
  double best = 0;   // squared distance of the best so far, at first of the limit
  double prune = 0;  // boxes at this squared distance or beyond are skipped
  // From the query to the box of the node at hand, along each axis. It changes with the axis that
  // the node's parent splits and keeps the others (Arya and Mount 1993).
  Eigen::Vector3d to_box = Eigen::Vector3d::Zero();
  const Entry* found = nullptr;

  bool reaches_box() const { return sum_of_squares(to_box.x(), to_box.y(), to_box.z()) < prune; }
};

KdTree::KdTree(const std::vector<Eigen::Vector3d>& points, int leaf_size) {
  assert(!points.empty() && leaf_size >= 1);
  entries_.reserve(points.size());
  low_ = high_ = points.front();
  for (std::size_t i = 0; i < points.size(); ++i) {
    entries_.push_back({points[i], static_cast<std::uint32_t>(i)});
    low_ = low_.cwiseMin(points[i]);
    high_ = high_.cwiseMax(points[i]);
  }
  nodes_.reserve(4 * points.size() / static_cast<std::size_t>(leaf_size) + 1);
  build(0, static_cast<std::uint32_t>(points.size()), static_cast<std::uint32_t>(leaf_size));
}

void KdTree::build(std::uint32_t begin, std::uint32_t end, std::uint32_t leaf_size) {
  const std::size_t self = nodes_.size();
  nodes_.push_back({.begin = begin, .end = end});
  if (end - begin <= leaf_size) return;

  Eigen::Vector3d low = entries_[begin].point, high = low;
  for (std::uint32_t i = begin + 1; i < end; ++i) {
    low = low.cwiseMin(entries_[i].point);
    high = high.cwiseMax(entries_[i].point);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);  // the longest side
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::uint32_t i) {
    return entries_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  std::nth_element(at(begin), at(middle), at(end), [axis](const Entry& a, const Entry& b) {
    // The index makes the order, and with it the tree, the same for every standard library.
    return a.point[axis] != b.point[axis] ? a.point[axis] < b.point[axis] : a.index < b.index;
  });
  double below = entries_[begin].point[axis];
  for (std::uint32_t i = begin + 1; i < middle; ++i)
    below = std::max(below, entries_[i].point[axis]);
  nodes_[self].axis = axis;
  nodes_[self].low = below;
  nodes_[self].high = entries_[middle].point[axis];
  build(begin, middle, leaf_size);
  nodes_[self].second = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end, leaf_size);
}

std::optional<Neighbour> KdTree::nearest(const Eigen::Vector3d& query, double max_distance,
                                         double error) const {
  const double limit = max_distance * max_distance;
  Search search{.query = query, .error = error, .best = limit, .prune = limit};
  search.to_box = (low_ - query).cwiseMax(query - high_).cwiseMax(0.0);
  if (search.reaches_box()) visit(0, search);
  if (!search.found) return {};
  return Neighbour{.index = search.found->index, .squared_distance = search.best};
}

void KdTree::visit(std::uint32_t number, Search& search) const {
  const Node& node = nodes_[number];
  const Eigen::Vector3d& q = search.query;
  if (node.axis < 0) {
    const Entry* const end = entries_.data() + node.end;
    for (const Entry* entry = entries_.data() + node.begin; entry != end; ++entry) {
      const Eigen::Vector3d& p = entry->point;
      const double d = sum_of_squares(p.x() - q.x(), p.y() - q.y(), p.z() - q.z());
      if (d < search.best) {
        search.best = d;
        search.found = entry;
        const double reach = std::sqrt(d) - search.error;
        search.prune = search.error == 0 ? d : reach > 0 ? reach * reach : 0;
      }
    }
    return;
  }
  const double to_low = q[node.axis] - node.low;
  const double to_high = q[node.axis] - node.high;
  const bool first_is_near = to_low + to_high < 0;  // before the middle of the gap
  visit(first_is_near ? number + 1 : node.second, search);

  double& side = search.to_box[node.axis];
  const double before = side;
  side = first_is_near ? to_high : to_low;
  if (search.reaches_box()) visit(first_is_near ? node.second : number + 1, search);
  side = before;
}

struct KdTree::SearchOfMany {
  const Eigen::Vector3d& query;
  std::size_t k = 0;
  double limit = 0;               // squared distance
  std::vector<Neighbour>& found;  // a heap, the worst in front
  Eigen::Vector3d to_box = Eigen::Vector3d::Zero();

  static bool nearer(const Neighbour& a, const Neighbour& b) {
    return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                    : a.index < b.index;
  }
  bool full() const { return found.size() == k; }
  /// Boxes as far away as the worst may still hold an equal point with a smaller index.
  bool reaches_box() const {
    const double d = sum_of_squares(to_box.x(), to_box.y(), to_box.z());
    return full() ? d <= found.front().squared_distance : d < limit;
  }
  void offer(const Neighbour& candidate) {
    if (!(candidate.squared_distance < limit)) return;
    if (full()) {
      if (!nearer(candidate, found.front())) return;
      std::pop_heap(found.begin(), found.end(), nearer);
      found.back() = candidate;
    } else {
      found.push_back(candidate);
    }
    std::push_heap(found.begin(), found.end(), nearer);
  }
};

void KdTree::nearest(const Eigen::Vector3d& query, std::size_t k, double max_distance,
                     std::vector<Neighbour>& found) const {
  found.clear();
  if (k == 0) return;
  SearchOfMany search{.query = query, .k = k, .limit = max_distance * max_distance, .found = found};
  search.to_box = (low_ - query).cwiseMax(query - high_).cwiseMax(0.0);
  if (search.reaches_box()) visit(0, search);
  std::sort_heap(found.begin(), found.end(), SearchOfMany::nearer);
}

void KdTree::visit(std::uint32_t number, SearchOfMany& search) const {
  const Node& node = nodes_[number];
  const Eigen::Vector3d& q = search.query;
  if (node.axis < 0) {
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      const Eigen::Vector3d& p = entries_[i].point;
      search.offer(
          {.index = entries_[i].index,
           .squared_distance = sum_of_squares(p.x() - q.x(), p.y() - q.y(), p.z() - q.z())});
    }
    return;
  }
  const double to_low = q[node.axis] - node.low;
  const double to_high = q[node.axis] - node.high;
  const bool first_is_near = to_low + to_high < 0;
  visit(first_is_near ? number + 1 : node.second, search);

  double& side = search.to_box[node.axis];
  const double before = side;
  side = first_is_near ? to_high : to_low;
  if (search.reaches_box()) visit(first_is_near ? node.second : number + 1, search);
  side = before;
}

std::size_t KdTree::bytes() const {
  return entries_.size() * sizeof(Entry) + nodes_.size() * sizeof(Node);
}

}  // namespace minescan
