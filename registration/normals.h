// SPDX-License-Identifier: MIT
// The shape of a surface around its points, from their nearest neighbours.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/cloud.h"
#include "registration/kdtree.h"

namespace minescan {

/// The plane that neighbours lie about.
struct LocalPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit vector
  bool known = false;  // false: fewer than 3 neighbours, or all of them on one line
};

/// The plane through the `neighbours` points of `points` nearest to `at` (which may be one of
/// them), by the eigenvectors of their covariance; the normal points to the origin, where the
/// scanner is.
LocalPlane local_plane(const KdTree& tree, const std::vector<Eigen::Vector3d>& points,
                       const Eigen::Vector3d& at, int neighbours);

/// The normals of a cloud, each found when it is first asked for, or the cloud's own if it has any.
class Normals {
 public:
  /// Refers to all three as long as it lives. `tree` is of cloud.points.
  Normals(const PointCloud& cloud, const KdTree& tree, int neighbours)
      : cloud_(cloud), tree_(tree), neighbours_(neighbours) {
    if (cloud.normals.empty()) planes_.resize(cloud.points.size());
  }

  /// Of point `index`; the zero vector where none is known.
  Eigen::Vector3d of(std::uint32_t index);

 private:
  struct Plane {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    bool looked = false;
  };

  const PointCloud& cloud_;
  const KdTree& tree_;
  int neighbours_ = 0;
  std::vector<Plane> planes_;
  std::vector<Neighbour> found_;
};

}  // namespace minescan
