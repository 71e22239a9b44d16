// SPDX-License-Identifier: MIT
// The kd-tree of nanoflann, to hold ours against.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <nanoflann.hpp>
#include <vector>

#include "registration/kdtree.h"

namespace minescan {

class NanoflannTree {
 public:
  /// `points` must outlive it.
  explicit NanoflannTree(const std::vector<Eigen::Vector3d>& points, std::size_t leaf_size = 10)
      : points_{points}, tree_(3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size)) {}

  /// The `k` points nearest to `query`, nearest first; all if there are fewer.
  std::vector<Neighbour> nearest(const Eigen::Vector3d& query, std::size_t k) const {
    std::vector<std::uint32_t> index(k);
    std::vector<double> squared(k);
    const std::size_t count = tree_.knnSearch(query.data(), k, index.data(), squared.data());
    std::vector<Neighbour> found;
    for (std::size_t i = 0; i < count; ++i)
      found.push_back({.index = index[i], .squared_distance = squared[i]});
    return found;
  }
  Neighbour nearest(const Eigen::Vector3d& query) const {
    Neighbour found;
    tree_.knnSearch(query.data(), 1, &found.index, &found.squared_distance);
    return found;
  }

 private:
  // The interface that nanoflann asks for.
  struct Points {
    const std::vector<Eigen::Vector3d>& list;
    std::size_t kdtree_get_point_count() const { return list.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return list[i][static_cast<Eigen::Index>(axis)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  Points points_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3>
      tree_;
};

}  // namespace minescan
