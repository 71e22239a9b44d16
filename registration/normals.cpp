// SPDX-License-Identifier: MIT
#include "registration/normals.h"

#include <Eigen/Eigenvalues>
#include <limits>

namespace minescan {
namespace {

LocalPlane plane_of(const std::vector<Neighbour>& neighbours,
                    const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& at) {
  if (neighbours.size() < 3) return {};
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Neighbour& n : neighbours) mean += points[n.index];
  mean /= static_cast<double>(neighbours.size());
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (const Neighbour& n : neighbours) {
    const Eigen::Vector3d d = points[n.index] - mean;
    C += d * d.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(C);
  // On a line, or at one place, any normal would do; rounding leaves 1e-16 of the largest.
  if (!(solver.eigenvalues()[1] > 1e-10 * solver.eigenvalues()[2])) return {};
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  return {.normal = n.dot(at) > 0 ? Eigen::Vector3d(-n) : n, .known = true};
}

}  // namespace

LocalPlane local_plane(const KdTree& tree, const std::vector<Eigen::Vector3d>& points,
                       const Eigen::Vector3d& at, int neighbours) {
  std::vector<Neighbour> found;
  tree.nearest(at, static_cast<std::size_t>(neighbours), std::numeric_limits<double>::infinity(),
               found);
  return plane_of(found, points, at);
}

Eigen::Vector3d Normals::of(std::uint32_t index) {
  if (planes_.empty()) return cloud_.normals[index];
  Plane& plane = planes_[index];
  if (!plane.looked) {
    plane.looked = true;
    tree_.nearest(cloud_.points[index], static_cast<std::size_t>(neighbours_),
                  std::numeric_limits<double>::infinity(), found_);
    const LocalPlane local = plane_of(found_, cloud_.points, cloud_.points[index]);
    if (local.known) plane.normal = local.normal;
  }
  return plane.normal;
}

}  // namespace minescan
