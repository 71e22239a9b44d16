// SPDX-License-Identifier: MIT
#include "registration/pcl_methods.h"

#include <fmt/format.h>
#include <pcl/console/print.h>
#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/ndt.h>
#include <pcl/registration/sample_consensus_prerejective.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <stdexcept>

#include "registration/bounds.h"
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

// ICP with the number of iterations, which PCL keeps to itself.
template <class Point>
struct CountingIcp : pcl::IterativeClosestPoint<Point, Point> {
  int iterations() const { return this->nr_iterations_; }
  const pcl::Correspondences& pairs() const { return *this->correspondences_; }
};

/// Runs an ICP that has its clouds and puts down what it has found.
template <class Point>
void align(CountingIcp<Point>& icp, const PclIcpOptions& options, const Eigen::Matrix4f& guess,
           RegistrationResult& result) {
  icp.setMaxCorrespondenceDistance(options.max_distance);
  icp.setTransformationEpsilon(options.epsilon);
  icp.setMaximumIterations(options.max_iterations);
  pcl::PointCloud<Point> aligned;
  icp.align(aligned, guess);
  using Criteria = pcl::registration::DefaultConvergenceCriteria<float>;
  const auto state = icp.getConvergeCriteria()->getConvergenceState();
  result.iterations = icp.iterations();
  if (state == Criteria::CONVERGENCE_CRITERIA_NO_CORRESPONDENCES) return;
  result.T_target_source = pose_of(icp.getFinalTransformation());
  result.status = state == Criteria::CONVERGENCE_CRITERIA_ITERATIONS ? Status::max_iterations
                                                                     : Status::converged;
  for (const pcl::Correspondence& pair : icp.pairs())
    result.score += static_cast<double>(pair.distance);
  result.score /= static_cast<double>(icp.pairs().size());
}

/// PCL numbers the cells of the bounding box with 32 bits, and else leaves out all of them.
/// `option` is the one that gives their side.
void check_cells(const PointCloud& cloud, const char* name, const char* option, double side) {
  const Bounds box = bounds_of(cloud.points);
  const double cells = ((box.high - box.low) / side + Eigen::Vector3d::Constant(2)).prod();
  if (cells < std::numeric_limits<std::int32_t>::max()) return;
  throw std::invalid_argument(
      fmt::format("{} = {}: the {}'s bounding box has {:.3g} such cells, PCL takes up to 2^31",
                  option, side, name, cells));
}

void run_pcl_ndt(const PointCloud& target, const PointCloud& source, const PclNdtOptions& options,
                 RegistrationResult& result) {
  silence_pcl();
  Stopwatch watch;
  const PclCloud::Ptr points = pcl_cloud(used_source(source, options.sampling)->points);
  const Eigen::Matrix4f guess = result.T_target_source.matrix().cast<float>();
  result.status = Status::no_overlap;
  result.used_points = points->size();
  result.time.source = watch.lap();

  pcl::NormalDistributionsTransform<pcl::PointXYZ, pcl::PointXYZ> ndt;
  const UsedCloud built_from = used_target(target, options.sampling);
  check_cells(*built_from, "target", "cell-size", options.cell_size);
  ndt.setMinPointPerVoxel(static_cast<unsigned>(options.min_cell_points));
  ndt.setResolution(static_cast<float>(options.cell_size));
  ndt.setStepSize(options.step_size);
  ndt.setOulierRatio(options.outlier_ratio);
  ndt.setTransformationEpsilon(options.epsilon);
  ndt.setMaximumIterations(options.max_iterations);
  ndt.setInputTarget(pcl_cloud(built_from->points));
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

void run_pcl_icp(const PointCloud& target, const PointCloud& source, const PclIcpOptions& options,
                 RegistrationResult& result) {
  silence_pcl();
  Stopwatch watch;
  const PclCloud::Ptr points = pcl_cloud(used_source(source, options.sampling)->points);
  const Eigen::Matrix4f guess = result.T_target_source.matrix().cast<float>();
  result.status = Status::no_overlap;
  result.used_points = points->size();
  result.time.source = watch.lap();

  CountingIcp<pcl::PointXYZ> icp;
  icp.setInputTarget(pcl_cloud(used_target(target, options.sampling)->points));
  icp.setInputSource(points);
  icp.getSearchMethodTarget()->setInputCloud(icp.getInputTarget());
  icp.setSearchMethodTarget(icp.getSearchMethodTarget(), true);
  result.time.target = watch.lap();
  align(icp, options, guess, result);
  result.time.align = watch.lap();
}

using PointNormal = pcl::PointNormal;
using NormalCloud = pcl::PointCloud<PointNormal>;

NormalCloud::Ptr with_normals(const PclCloud::Ptr& cloud, int neighbours, double radius) {
  pcl::NormalEstimation<pcl::PointXYZ, PointNormal> estimation;
  const NormalCloud::Ptr normals(new NormalCloud);
  estimation.setInputCloud(cloud);
  if (neighbours > 0)
    estimation.setKSearch(neighbours);
  else
    estimation.setRadiusSearch(radius);
  estimation.compute(*normals);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    (*normals)[i].x = (*cloud)[i].x;
    (*normals)[i].y = (*cloud)[i].y;
    (*normals)[i].z = (*cloud)[i].z;
  }
  // Points without neighbours have no normal, and PCL's features end the program at such a one.
  const NormalCloud::Ptr known(new NormalCloud);
  for (const PointNormal& p : *normals)
    if (std::isfinite(p.normal_x) && std::isfinite(p.normal_y) && std::isfinite(p.normal_z))
      known->push_back(p);
  return known;
}

/// Surfaces that leave a direction free give its linear system no solution, and PCL's search for
/// neighbours then ends the program at the first coordinate that is not a number: here it stands
/// still and tells.
struct CheckedPlaneEstimation
    : pcl::registration::TransformationEstimationPointToPlaneLLS<PointNormal, PointNormal> {
  using Base = pcl::registration::TransformationEstimationPointToPlaneLLS<PointNormal, PointNormal>;
  bool* solved = nullptr;

  using Base::estimateRigidTransformation;
  void estimateRigidTransformation(const NormalCloud& source, const NormalCloud& target,
                                   const pcl::Correspondences& pairs,
                                   Matrix4& matrix) const override {
    Base::estimateRigidTransformation(source, target, pairs, matrix);
    if (matrix.allFinite()) return;
    matrix.setIdentity();
    *solved = false;
  }
};

void run_pcl_icp_plane(const PointCloud& target, const PointCloud& source,
                       const PclNormalOptions& options, RegistrationResult& result) {
  silence_pcl();
  Stopwatch watch;
  const PclCloud::Ptr points = pcl_cloud(used_source(source, options.icp.sampling)->points);
  const NormalCloud::Ptr moving(new NormalCloud);  // its normals are not looked at
  for (const pcl::PointXYZ& p : *points) {
    moving->emplace_back();
    moving->back().x = p.x, moving->back().y = p.y, moving->back().z = p.z;
  }
  const Eigen::Matrix4f guess = result.T_target_source.matrix().cast<float>();
  result.status = Status::no_overlap;
  result.used_points = points->size();
  result.time.source = watch.lap();

  CountingIcp<PointNormal> icp;
  const auto estimation = new CheckedPlaneEstimation;
  bool solved = true;
  estimation->solved = &solved;
  icp.setTransformationEstimation(CheckedPlaneEstimation::Base::Ptr(estimation));
  const NormalCloud::Ptr still = with_normals(
      pcl_cloud(used_target(target, options.icp.sampling)->points), options.neighbours, 0);
  icp.setInputTarget(still);
  icp.setInputSource(moving);
  result.time.target = watch.lap();
  if (still->empty()) return;
  align(icp, options.icp, guess, result);
  if (!solved) result.status = Status::degenerate;
  result.time.align = watch.lap();
}

struct CountingGicp : pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> {
  int iterations() const { return nr_iterations_; }
};

void run_pcl_gicp(const PointCloud& target, const PointCloud& source,
                  const PclNormalOptions& options, RegistrationResult& result) {
  silence_pcl();
  Stopwatch watch;
  const PclCloud::Ptr points = pcl_cloud(used_source(source, options.icp.sampling)->points);
  const Eigen::Matrix4f guess = result.T_target_source.matrix().cast<float>();
  result.status = Status::no_overlap;
  result.used_points = points->size();
  result.time.source = watch.lap();

  // Its covariances need as many points, or it goes on without them.
  const auto needed = static_cast<std::size_t>(options.neighbours);
  const PclCloud::Ptr still = pcl_cloud(used_target(target, options.icp.sampling)->points);
  if (points->size() < needed || still->size() < needed) return;
  CountingGicp gicp;
  gicp.setMaxCorrespondenceDistance(options.icp.max_distance);
  gicp.setCorrespondenceRandomness(options.neighbours);
  // It compares the largest change of any number of the matrix, over this, with 1.
  gicp.setTransformationEpsilon(std::sqrt(options.icp.epsilon));
  gicp.setRotationEpsilon(std::sqrt(options.icp.epsilon));
  gicp.setMaximumIterations(options.icp.max_iterations);
  gicp.setInputTarget(still);
  gicp.setInputSource(points);
  result.time.target = watch.lap();

  PclCloud aligned;
  gicp.align(aligned, guess);
  result.iterations = gicp.iterations();
  const double fitness = gicp.getFitnessScore(options.icp.max_distance);
  if (gicp.getFinalTransformation().allFinite() && gicp.hasConverged() &&
      fitness < std::numeric_limits<double>::max()) {
    result.T_target_source = pose_of(gicp.getFinalTransformation());
    result.score = fitness;
    result.status =
        result.iterations < options.icp.max_iterations ? Status::converged : Status::max_iterations;
  }
  result.time.align = watch.lap();
}

using Feature = pcl::FPFHSignature33;
using FeatureCloud = pcl::PointCloud<Feature>;

PclCloud::Ptr thinned(const std::vector<Eigen::Vector3d>& points, double leaf) {
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(pcl_cloud(points));
  const auto side = static_cast<float>(leaf);
  grid.setLeafSize(side, side, side);
  const PclCloud::Ptr thin(new PclCloud);
  grid.filter(*thin);
  return thin;
}

FeatureCloud::Ptr features_of(const NormalCloud::Ptr& cloud, double radius) {
  pcl::FPFHEstimation<PointNormal, PointNormal, Feature> estimation;
  estimation.setInputCloud(cloud);
  estimation.setInputNormals(cloud);
  estimation.setRadiusSearch(radius);
  const FeatureCloud::Ptr features(new FeatureCloud);
  if (cloud->empty()) return features;
  estimation.compute(*features);
  return features;
}

void run_pcl_global(const PointCloud& target, const PointCloud& source,
                    const PclGlobalOptions& options, RegistrationResult& result) {
  silence_pcl();
  Stopwatch watch;
  check_cells(target, "target", "leaf", options.leaf);
  check_cells(source, "source", "leaf", options.leaf);
  result.status = Status::no_overlap;
  const NormalCloud::Ptr moving =
      with_normals(thinned(source.points, options.leaf), 0, options.normal_radius);
  const FeatureCloud::Ptr moving_features = features_of(moving, options.feature_radius);
  result.used_points = moving->size();
  result.time.source = watch.lap();
  const NormalCloud::Ptr still =
      with_normals(thinned(target.points, options.leaf), 0, options.normal_radius);
  const FeatureCloud::Ptr still_features = features_of(still, options.feature_radius);
  result.time.target = watch.lap();
  // Of so many like features it takes one at random.
  constexpr std::size_t candidates = 5;
  if (moving->size() >= candidates && still->size() >= candidates) {
    pcl::SampleConsensusPrerejective<PointNormal, PointNormal, Feature> search;
    search.setInputSource(moving);
    search.setSourceFeatures(moving_features);
    search.setInputTarget(still);
    search.setTargetFeatures(still_features);
    search.setMaximumIterations(options.max_iterations);
    search.setNumberOfSamples(3);
    search.setCorrespondenceRandomness(candidates);
    search.setSimilarityThreshold(static_cast<float>(options.similarity));
    search.setMaxCorrespondenceDistance(options.inlier_distance);
    search.setInlierFraction(static_cast<float>(options.inlier_part));
    NormalCloud aligned;
    {
      // One at a time: the generator is the whole program's.
      static std::mutex generator;
      const std::lock_guard<std::mutex> lock(generator);
      std::srand(1);
      search.align(aligned);
    }
    result.iterations = options.max_iterations;
    if (search.hasConverged() && search.getFinalTransformation().allFinite()) {
      result.T_target_source = pose_of(search.getFinalTransformation());
      result.score =
          -static_cast<double>(search.getInliers().size()) / static_cast<double>(moving->size());
      result.status = Status::converged;
    }
  }
  result.time.align = watch.lap();
}

}  // namespace

RegistrationResult register_pcl_ndt(const PointCloud& target, const PointCloud& source,
                                    const Pose& T_guess, const PclNdtOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::surfaces, run_pcl_ndt);
}

RegistrationResult register_pcl_icp(const PointCloud& target, const PointCloud& source,
                                    const Pose& T_guess, const PclIcpOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::points, run_pcl_icp);
}

RegistrationResult register_pcl_icp_plane(const PointCloud& target, const PointCloud& source,
                                          const Pose& T_guess, const PclNormalOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::surfaces, run_pcl_icp_plane);
}

RegistrationResult register_pcl_gicp(const PointCloud& target, const PointCloud& source,
                                     const Pose& T_guess, const PclNormalOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::surfaces, run_pcl_gicp);
}

RegistrationResult register_pcl_global(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const PclGlobalOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::surfaces, run_pcl_global);
}

}  // namespace minescan
