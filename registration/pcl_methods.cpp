// SPDX-License-Identifier: MIT
#include "registration/pcl_methods.h"

#include <fmt/format.h>
#include <pcl/console/print.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/ndt.h>

#include <limits>
#include <stdexcept>

#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {

namespace {

using PclCloud = pcl::PointCloud<pcl::PointXYZ>;

/// PCL reports on the console; what went wrong comes back as a status instead.
void silence_pcl() {
  static const bool done = [] {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
    return true;
  }();
  static_cast<void>(done);
}

PclCloud::Ptr pcl_cloud(const std::vector<Eigen::Vector3d>& points) {
  const PclCloud::Ptr cloud(new PclCloud);
  cloud->reserve(points.size());
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3f f = p.cast<float>();
    cloud->push_back({f.x(), f.y(), f.z()});
  }
  return cloud;
}

/// The rotation of a float matrix is one only to 1e-7.
Pose pose_of(const Eigen::Matrix4f& matrix) { return normalized(Pose(matrix.cast<double>())); }

// With the number of iterations, which PCL keeps to itself.
struct CountingIcp : pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> {
  int iterations() const { return nr_iterations_; }
  const pcl::Correspondences& pairs() const { return *correspondences_; }
};

/// PCL numbers the cells of the bounding box with 32 bits, and else leaves out all of them.
void check_cells(const std::vector<Eigen::Vector3d>& points, double cell_size) {
  Eigen::Vector3d low = points.front(), high = low;
  for (const Eigen::Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double cells = ((high - low) / cell_size + Eigen::Vector3d::Constant(2)).prod();
  if (cells < std::numeric_limits<std::int32_t>::max()) return;
  throw std::invalid_argument(fmt::format(
      "cell-size = {}: the target's bounding box has {:.3g} such cells, PCL takes up to 2^31",
      cell_size, cells));
}

void run_pcl_ndt(const PointCloud& target, const PointCloud& source, const PclNdtOptions& options,
                 RegistrationResult& result) {
  silence_pcl();
  check_cells(target.points, options.cell_size);
  Stopwatch watch;
  const PclCloud::Ptr points = pcl_cloud(sampled_points(source.points, options.sampling));
  const Eigen::Matrix4f guess = result.T_target_source.matrix().cast<float>();
  result.status = Status::no_overlap;
  result.used_points = points->size();
  result.time.source = watch.lap();

  pcl::NormalDistributionsTransform<pcl::PointXYZ, pcl::PointXYZ> ndt;
  ndt.setMinPointPerVoxel(static_cast<unsigned>(options.min_cell_points));
  ndt.setResolution(static_cast<float>(options.cell_size));
  ndt.setStepSize(options.step_size);
  ndt.setOulierRatio(options.outlier_ratio);
  ndt.setTransformationEpsilon(options.epsilon);
  ndt.setMaximumIterations(options.max_iterations);
  ndt.setInputTarget(pcl_cloud(target.points));
  ndt.setInputSource(points);
  result.time.target = watch.lap();

  PclCloud aligned;
  ndt.align(aligned, guess);
  result.iterations = ndt.getFinalNumIteration();
  const double likelihood = ndt.getTransformationLikelihood();
  if (result.iterations > 0 && likelihood != 0) {
    result.T_target_source = pose_of(ndt.getFinalTransformation());
    result.score = -likelihood * static_cast<double>(points->size());
    // PCL calls running out of iterations convergence, too.
    result.status = result.iterations < options.max_iterations && ndt.hasConverged()
                        ? Status::converged
                        : Status::max_iterations;
  }
  result.time.align = watch.lap();
}

}  // namespace

RegistrationResult register_pcl_ndt(const PointCloud& target, const PointCloud& source,
                                    const Pose& T_guess, const PclNdtOptions& options) {
  return registered(target, source, T_guess, options, run_pcl_ndt);
}

namespace {

void run_pcl_icp(const PointCloud& target, const PointCloud& source, const PclIcpOptions& options,
                 RegistrationResult& result) {
  silence_pcl();
  Stopwatch watch;
  const PclCloud::Ptr points = pcl_cloud(sampled_points(source.points, options.sampling));
  const Eigen::Matrix4f guess = result.T_target_source.matrix().cast<float>();
  result.status = Status::no_overlap;
  result.used_points = points->size();
  result.time.source = watch.lap();

  CountingIcp icp;
  icp.setMaxCorrespondenceDistance(options.max_distance);
  icp.setTransformationEpsilon(options.epsilon);
  icp.setMaximumIterations(options.max_iterations);
  icp.setInputTarget(pcl_cloud(target.points));
  icp.setInputSource(points);
  icp.getSearchMethodTarget()->setInputCloud(icp.getInputTarget());
  icp.setSearchMethodTarget(icp.getSearchMethodTarget(), true);
  result.time.target = watch.lap();

  PclCloud aligned;
  icp.align(aligned, guess);
  using Criteria = pcl::registration::DefaultConvergenceCriteria<float>;
  const auto state = icp.getConvergeCriteria()->getConvergenceState();
  result.iterations = icp.iterations();
  if (state != Criteria::CONVERGENCE_CRITERIA_NO_CORRESPONDENCES) {
    result.T_target_source = pose_of(icp.getFinalTransformation());
    result.status = state == Criteria::CONVERGENCE_CRITERIA_ITERATIONS ? Status::max_iterations
                                                                       : Status::converged;
    for (const pcl::Correspondence& pair : icp.pairs())
      result.score += static_cast<double>(pair.distance);
    result.score /= static_cast<double>(icp.pairs().size());
  }
  result.time.align = watch.lap();
}

}  // namespace

RegistrationResult register_pcl_icp(const PointCloud& target, const PointCloud& source,
                                    const Pose& T_guess, const PclIcpOptions& options) {
  return registered(target, source, T_guess, options, run_pcl_icp);
}

}  // namespace minescan
