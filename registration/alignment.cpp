// SPDX-License-Identifier: MIT
#include "registration/alignment.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cassert>

namespace minescan {
namespace {

struct Centred {
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // sum of source * target^T
};

/// None if the weights leave nothing.
std::optional<Centred> centred(const std::vector<Eigen::Vector3d>& target,
                               const std::vector<Eigen::Vector3d>& source,
                               const std::vector<double>& weights) {
  assert(target.size() == source.size());
  assert(weights.empty() || weights.size() == target.size());
  if (target.size() < 3) return {};
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1 : weights[i]; };
  Centred c;
  double sum = 0;
  for (std::size_t i = 0; i < target.size(); ++i) {
    c.target_mean += weight(i) * target[i];
    c.source_mean += weight(i) * source[i];
    sum += weight(i);
  }
  if (!(sum > 0)) return {};
  c.target_mean /= sum;
  c.source_mean /= sum;
  // After the means: products of coordinates far from the origin would lose digits.
  for (std::size_t i = 0; i < target.size(); ++i)
    c.covariance +=
        weight(i) * (source[i] - c.source_mean) * (target[i] - c.target_mean).transpose();
  return c;
}

Pose pose_of(const Centred& c, const Eigen::Matrix3d& R) {
  Pose T = Pose::Identity();
  T.linear() = R;
  T.translation() = c.target_mean - R * c.source_mean;
  return T;
}

// The second singular value of the covariance is zero if the points lie on a line. Rounding leaves
// about 1e-16 of the largest; below 1e-12 the rotation about the line is noise.
constexpr double line_limit = 1e-12;

}  // namespace

std::optional<Pose> align_svd(const std::vector<Eigen::Vector3d>& target,
                              const std::vector<Eigen::Vector3d>& source,
                              const std::vector<double>& weights) {
  const std::optional<Centred> found = centred(target, source, weights);
  if (!found) return {};
  const Centred& c = *found;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(c.covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > line_limit * svd.singularValues()[0])) return {};
  Eigen::Vector3d sign(1, 1, 1);
  if ((svd.matrixV() * svd.matrixU().transpose()).determinant() < 0) sign.z() = -1;
  return pose_of(c, svd.matrixV() * sign.asDiagonal() * svd.matrixU().transpose());
}

std::optional<Pose> align_quaternion(const std::vector<Eigen::Vector3d>& target,
                                     const std::vector<Eigen::Vector3d>& source,
                                     const std::vector<double>& weights) {
  const std::optional<Centred> found = centred(target, source, weights);
  if (!found) return {};
  const Centred& c = *found;
  const Eigen::Matrix3d& S = c.covariance;
  Eigen::Matrix4d N;  // Horn 1987, section 4A
  N.topLeftCorner<1, 1>() << S.trace();
  N.block<3, 1>(1, 0) << S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0);
  N.block<1, 3>(0, 1) = N.block<3, 1>(1, 0).transpose();
  N.bottomRightCorner<3, 3>() = S + S.transpose();
  N.bottomRightCorner<3, 3>().diagonal().array() -= S.trace();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(N);
  // On a line the two largest eigenvalues coincide.
  const Eigen::Vector4d& values = solver.eigenvalues();
  if (!(values[3] - values[2] > line_limit * values[3])) return {};
  const Eigen::Vector4d q = solver.eigenvectors().col(3);
  return pose_of(c, Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix());
}

}  // namespace minescan
