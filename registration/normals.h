// SPDX-License-Identifier: MIT
// Normals of a surface, from the nearest neighbours of its points.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/cloud.h"
#include "registration/kdtree.h"

namespace minescan {

/// The normals of a cloud, each found when it is first asked for, or the cloud's own if it has any.
///
/// A normal is that of the plane which the nearest `neighbours` points (the point itself among
/// them) lie about, by their covariance; it points to the origin, where the scanner is. Where they
/// lie along a line, as on that of a scanner whose lines are far apart, up to four times as many
/// are taken.
class Normals {
 public:
  /// Refers to both as long as it lives. `tree` is of cloud.points.
  Normals(const PointCloud& cloud, const KdTree& tree, int neighbours);

  /// Of point `index`: a unit vector, or zero where its neighbours are fewer than 3 or lie on one
  /// line.
  const Eigen::Vector3d& of(std::uint32_t index);

  /// Finds those of `indices` that are not known yet, on several threads.
  void find(const std::vector<std::uint32_t>& indices);

 private:
  struct Found {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    bool looked = false;
  };

  const PointCloud& cloud_;
  const KdTree& tree_;
  std::size_t neighbours_ = 0;
  Eigen::Vector3d normal(std::uint32_t index, std::vector<Neighbour>& nearest) const;

  std::vector<Found> found_;  // none if the cloud has normals of its own
  std::vector<Neighbour> nearest_;
  std::vector<std::uint32_t> missing_;
};

/// The same for all points of a cloud without normals. O(N log N).
std::vector<Eigen::Vector3d> found_normals(const std::vector<Eigen::Vector3d>& points,
                                           int neighbours, int leaf_size = 10);

}  // namespace minescan
