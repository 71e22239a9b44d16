// SPDX-License-Identifier: MIT
// Search tree for the nearest point, exact or with a bounded error.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace minescan {

struct Neighbour {
  std::uint32_t index = 0;      // into the points that the tree was built from
  double squared_distance = 0;  // m^2
};

class KdTree {
 public:
  /// Copies `points` (at least one, all finite). `leaf_size` >= 1 points at most share a leaf.
  /// Build: O(N log N), memory O(N).
  explicit KdTree(const std::vector<Eigen::Vector3d>& points, int leaf_size = 10);

  /// A point whose distance from `query` is at most `error` more than that of the nearest; none if
  /// the nearest is `max_distance` or further away. With error = 0 it is the nearest.
  ///
  /// A subtree is skipped if its box is not closer than the best point so far, less `error`: the
  /// additive reading of "no more than 1 cm from the true nearest neighbour" (paper, section 5;
  /// Greenspan and Yurick 2003 and Arya and Mount's ANN bound other quantities).
  std::optional<Neighbour> nearest(const Eigen::Vector3d& query, double max_distance,
                                   double error = 0) const;

  /// The `k` points nearest to `query` within `max_distance`, nearest first, fewer if there are not
  /// as many; of points equally far those first in the cloud. `found` is overwritten and keeps its
  /// memory.
  void nearest(const Eigen::Vector3d& query, std::size_t k, double max_distance,
               std::vector<Neighbour>& found) const;

  std::size_t bytes() const;

 private:
  // Inner nodes have a split axis and two children; the space between the children is left out.
  struct Node {
    double low = 0;            // the first child's points are not beyond this along `axis`
    double high = 0;           // the second child's are not before this
    std::uint32_t second = 0;  // the first child follows its parent directly
    std::uint32_t begin = 0;   // of a leaf's points
    std::uint32_t end = 0;
    int axis = -1;  // -1: a leaf
  };
  struct Entry {
    Eigen::Vector3d point;
    std::uint32_t index;
  };
  struct Search;
  struct SearchOfMany;

  void build(std::uint32_t begin, std::uint32_t end, std::uint32_t leaf_size);
  void visit(std::uint32_t node, Search& search) const;
  void visit(std::uint32_t node, SearchOfMany& search) const;

  std::vector<Entry> entries_;  // in the order of the leaves
  std::vector<Node> nodes_;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();  // bounding box
  Eigen::Vector3d high_ = Eigen::Vector3d::Zero();
};

}  // namespace minescan
