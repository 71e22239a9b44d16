// SPDX-License-Identifier: MIT
#include "registration/normals.h"

#include <Eigen/Eigenvalues>
#include <limits>
#include <numeric>

#include "core/parallel.h"

namespace minescan {
namespace {

Eigen::Vector3d normal_at(const Eigen::Vector3d& point, const std::vector<Neighbour>& neighbours,
                          const std::vector<Eigen::Vector3d>& points) {
  if (neighbours.size() < 3) return Eigen::Vector3d::Zero();
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
  if (!(solver.eigenvalues()[1] > 1e-10 * solver.eigenvalues()[2])) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  return n.dot(point) > 0 ? Eigen::Vector3d(-n) : n;
}

}  // namespace

Normals::Normals(const PointCloud& cloud, const KdTree& tree, int neighbours)
    : cloud_(cloud), tree_(tree), neighbours_(static_cast<std::size_t>(neighbours)) {
  if (cloud.normals.empty()) found_.resize(cloud.points.size());
}

Eigen::Vector3d Normals::normal(std::uint32_t index, std::vector<Neighbour>& nearest) const {
  const Eigen::Vector3d& point = cloud_.points[index];
  tree_.nearest(point, neighbours_, std::numeric_limits<double>::infinity(), nearest);
  return normal_at(point, nearest, cloud_.points);
}

const Eigen::Vector3d& Normals::of(std::uint32_t index) {
  if (found_.empty()) return cloud_.normals[index];
  Found& found = found_[index];
  if (!found.looked) {
    found.looked = true;
    found.normal = normal(index, nearest_);
  }
  return found.normal;
}

void Normals::find(const std::vector<std::uint32_t>& indices) {
  if (found_.empty()) return;
  missing_.clear();
  for (const std::uint32_t index : indices) {
    if (found_[index].looked) continue;
    found_[index].looked = true;
    missing_.push_back(index);
  }
  parallel_for(missing_.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<Neighbour> nearest;
    for (std::size_t i = begin; i < end; ++i)
      found_[missing_[i]].normal = normal(missing_[i], nearest);
  });
}

std::vector<Eigen::Vector3d> found_normals(const std::vector<Eigen::Vector3d>& points,
                                           int neighbours, int leaf_size) {
  const PointCloud cloud{.points = points};
  const KdTree tree(points, leaf_size);
  Normals normals(cloud, tree, neighbours);
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0u);
  normals.find(all);
  std::vector<Eigen::Vector3d> list;
  list.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) list.push_back(normals.of(i));
  return list;
}

}  // namespace minescan
