// SPDX-License-Identifier: MIT
#include "registration/registered.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "registration/bounds.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

// Metres. Beyond the reach of any scanner in a mine: such a cloud is not in a scanner's frame.
constexpr double far = 500;
// By multiples of this the target is moved: lattices of cells of 2^n m stay where they are.
constexpr double target_stride = 1024;
// And the source, which turns about its origin: that has to be among the points.
constexpr double source_stride = 1;

/// Throws unless it is a cloud to work with; returns the box around it.
Bounds checked_bounds(const PointCloud& cloud, const char* name) {
  const std::size_t count = cloud.points.size();
  if (count == 0) throw std::invalid_argument(fmt::format("the {} cloud is empty", name));
  if (count > std::numeric_limits<std::uint32_t>::max()) {
    throw std::invalid_argument(
        fmt::format("the {} cloud has {} points, expected fewer than 2^32", name, count));
  }
  const Bounds bounds = bounds_of(cloud.points);
  if (bounds.finite) return bounds;
  const auto none = std::find_if(cloud.points.begin(), cloud.points.end(),
                                 [](const Eigen::Vector3d& p) { return !p.allFinite(); });
  throw std::invalid_argument(
      fmt::format("point {} of the {} cloud is ({}, {}, {}), expected finite coordinates",
                  none - cloud.points.begin(), name, none->x(), none->y(), none->z()));
}

/// What is taken off the points so that they lie near the origin.
Eigen::Vector3d offset_of(const Bounds& bounds, double stride) {
  const Eigen::Vector3d middle = bounds.low / 2 + bounds.high / 2;
  if (middle.cwiseAbs().maxCoeff() < far) return Eigen::Vector3d::Zero();
  return (middle / stride).array().round().matrix() * stride;
}

PointCloud moved(const PointCloud& cloud, const Eigen::Vector3d& offset) {
  PointCloud local = cloud;
  for (Eigen::Vector3d& p : local.points) p -= offset;
  return local;
}

/// Of both clouds, which are checked.
std::array<Bounds, 2> checked_clouds(const PointCloud& target, const PointCloud& source,
                                     const Pose& T_guess) {
  const std::array<Bounds, 2> bounds = {checked_bounds(target, "target"),
                                        checked_bounds(source, "source")};
  if (!T_guess.matrix().allFinite())
    throw std::invalid_argument("the start pose has a number that is not finite");
  return bounds;
}

/// 0, 1, 2 or 3: whether all points lie at one place, on one line, in one plane or not, to
/// rounding.
int dimensions_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) C += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(C, Eigen::EigenvaluesOnly).eigenvalues();
  // Squares of lengths, rounded to 1e-16 of the largest; of rounded coordinates to 1e-13 or so.
  return static_cast<int>((spread.array() > 1e-12 * spread[2]).count());
}

}  // namespace

void check_clouds(const PointCloud& target, const PointCloud& source, const Pose& T_guess) {
  checked_clouds(target, source, T_guess);
}

RegistrationResult registered(
    const PointCloud& target, const PointCloud& source, const Pose& T_guess,
    const std::function<void(const PointCloud& target, const PointCloud& source,
                             RegistrationResult& result)>& work) {
  const auto [target_bounds, source_bounds] = checked_clouds(target, source, T_guess);
  const Stopwatch watch;
  RegistrationResult result{.T_target_source = T_guess,
                            .status = Status::max_iterations,
                            .target_points = target.points.size(),
                            .source_points = source.points.size()};

  const Eigen::Vector3d from_target = offset_of(target_bounds, target_stride),
                        from_source = offset_of(source_bounds, source_stride);
  if (from_target.isZero(0) && from_source.isZero(0)) {
    work(target, source, result);
  } else {
    // x_target - b = (R a + t - b) + R (x_source - a)
    result.T_target_source.translation() = T_guess * from_source - from_target;
    work(moved(target, from_target), moved(source, from_source), result);
    const Eigen::Matrix3d R = result.T_target_source.linear();
    result.T_target_source.translation() += from_target - R * from_source;
    // Turning about the local origin moves the far one.
    Matrix6d to_far = Matrix6d::Identity();
    to_far.topRightCorner<3, 3>() = skew(R * from_source);
    result.covariance = to_far * result.covariance * to_far.transpose();
  }

  if (result.status == Status::no_overlap || result.status == Status::degenerate)
    result.T_target_source = T_guess;
  if (!result.T_target_source.matrix().allFinite())
    throw std::runtime_error("the registration ended at a pose that is not finite");
  result.cpu = watch.cpu();
  return result;
}

void doubt(const PointCloud& target, const PointCloud& source, const Pose& T_guess, Matches what,
           RegistrationResult& result) {
  if (result.status != Status::converged && result.status != Status::max_iterations) return;
  const int needed = what == Matches::points ? 2 : 3;
  for (const PointCloud* cloud : {&target, &source}) {
    if (static_cast<double>(cloud->points.size()) < needed_points(0, 0))
      result.status = Status::no_overlap;
    else if (dimensions_of(cloud->points) < needed)
      result.status = Status::degenerate;
    else
      continue;
    result.T_target_source = T_guess;
    return;
  }
}

double needed_points(std::size_t used, double min_overlap) {
  return std::max(6.0, min_overlap * static_cast<double>(used));
}

Status status_of(const RegistrationResult& result, std::size_t met, double needed, double min_rank,
                 bool converged) {
  if (static_cast<double>(met) < needed) return Status::no_overlap;
  // True for NaN.
  if (!(result.directions.front().hold >= min_rank)) return Status::degenerate;
  return converged ? Status::converged : Status::max_iterations;
}

std::vector<Direction> directions_of(const Matrix6d& information, double length) {
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>() /= length;
  const Matrix6d scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scaled);
  const double largest = solver.eigenvalues()[5];
  std::vector<Direction> list(6);
  for (int i = 0; i < 6; ++i)
    list[static_cast<std::size_t>(i)] = {
        .step = solver.eigenvectors().col(i),
        .hold = largest > 0 ? std::max(0.0, solver.eigenvalues()[i] / largest) : 0};
  return list;
}

std::string direction_name(const Direction& direction, const Eigen::Vector3d& axis) {
  const Eigen::Vector3d shift = direction.step.head<3>(), turn = direction.step.tail<3>();
  const bool turns = turn.norm() > shift.norm();
  const Eigen::Vector3d v = turns ? turn : shift;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d along = (axis - axis.dot(up) * up).normalized();
  const double parts[] = {std::abs(v.dot(along)), std::abs(v.dot(up.cross(along))),
                          std::abs(v.dot(up))};
  const char* names[] = {"along", "across", "vertical"};
  const auto most = std::max_element(std::begin(parts), std::end(parts)) - std::begin(parts);
  return std::string(turns ? "turn about " : "") + names[most];
}

}  // namespace minescan
