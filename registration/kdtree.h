// SPDX-License-Identifier: MIT
// Search tree for the nearest points, exact or approximate.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "registration/kdtree_packet.h"

namespace minescan {

struct Neighbour {
  std::uint32_t index = 0;      // into the points that the tree was built from
  double squared_distance = 0;  // m^2
};

/// What a search promises of the point that it returns.
enum class TreeSearch {
  exact,     // none is nearer
  relative,  // at most (1 + bound) times as far as the nearest (Arya and Mount 1993, library ANN)
  additive,  // at most `bound` metres further than the nearest (the paper's 1 cm, section 5)
  leaf,      // the nearest in the leaf that holds the query (Greenspan and Yurick 2003)
};
constexpr auto names_of(TreeSearch) {
  return std::to_array<std::string_view>({"exact", "relative", "additive", "leaf"});
}

struct TreePolicy {
  TreeSearch search = TreeSearch::exact;
  double bound = 0;  // of `relative` (a ratio) and `additive` (metres)
};

class KdTree {
 public:
  static constexpr int max_leaf_size = 65535;
  /// Copies `points` (at least one, all finite). `leaf_size` points at most share a leaf, 1 to
  /// max_leaf_size.
  /// Build: O(N log N), memory O(N).
  explicit KdTree(const std::vector<Eigen::Vector3d>& points, int leaf_size = 10);

  /// A point near `query` as `policy` promises; none if the nearest is `max_distance` or further
  /// away (or, for a leaf, the nearest in it). A subtree is skipped if its box is not closer than
  /// the best point so far, less what the policy allows.
  std::optional<Neighbour> nearest(const Eigen::Vector3d& query, double max_distance,
                                   const TreePolicy& policy = {}) const;

  /// The nearest point within `max_distance`, and how far all others are at least.
  struct NearestAndRest {
    std::optional<Neighbour> nearest = {};
    double rest = 0;  // metres; up to max_distance
  };
  NearestAndRest nearest_and_rest(const Eigen::Vector3d& query, double max_distance) const;

  /// The same for several queries at once, 1 to KdPacket::size. For queries close together it takes
  /// a quarter of the time with registers of 512 bits, as long as one by one with those of 128.
  using NearestAndRestOfEach = std::array<NearestAndRest, KdPacket::size>;
  NearestAndRestOfEach nearest_and_rest(std::span<const Eigen::Vector3d> queries,
                                        double max_distance) const;

  /// The `k` points nearest to `query` within `max_distance`, nearest first, fewer if there are not
  /// as many; of points equally far those first in the cloud. `found` is overwritten and keeps its
  /// memory.
  void nearest(const Eigen::Vector3d& query, std::size_t k, double max_distance,
               std::vector<Neighbour>& found) const;

  /// The numbers of all points, leaf by leaf: of points close together most are close in the list.
  std::vector<std::uint32_t> order() const;

  /// The box around the points.
  const Eigen::Vector3d& low() const { return low_; }
  const Eigen::Vector3d& high() const { return high_; }

  std::size_t bytes() const;

 private:
  struct Entry {
    Eigen::Vector3d point;
    std::uint32_t index;
  };
  struct Search;
  struct SearchOfTwo;
  struct SearchOfMany;

  void build(std::vector<Entry>& entries, std::size_t begin, std::size_t end, std::size_t leaf_size,
             int depth);
  void add_leaf(const std::vector<Entry>& entries, std::size_t begin, std::size_t end,
                KdNode& node);
  const KdNode& leaf_of(const Eigen::Vector3d& query) const;
  template <class AnySearch>
  void run(AnySearch& search) const;
  /// Calls visit(squared distance, place) for the points of a leaf, and of what fills it up.
  template <class Visit>
  static void for_each_distance(const KdTree& tree, const KdNode& leaf,
                                const Eigen::Vector3d& query, Visit&& visit);

  std::vector<KdNode> nodes_;
  std::vector<KdBox> boxes_;  // of each node
  std::vector<double> xyz_;   // as KdArrays has them
  std::vector<std::uint32_t> index_;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_ = Eigen::Vector3d::Zero();
};

}  // namespace minescan
