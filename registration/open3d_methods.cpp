// SPDX-License-Identifier: MIT
#include "registration/open3d_methods.h"

#include <omp.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/GeneralizedICP.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Logging.h>

#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

namespace o3d = open3d::pipelines::registration;

/// Keeps Open3D on the calling thread and off the console while it lives.
class Alone {
 public:
  Alone() : threads_(omp_get_max_threads()) {
    omp_set_num_threads(1);
    static const bool silent = [] {
      open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
      return true;
    }();
    static_cast<void>(silent);
  }
  ~Alone() { omp_set_num_threads(threads_); }
  Alone(const Alone&) = delete;
  Alone& operator=(const Alone&) = delete;

 private:
  int threads_;
};

/// An estimation that counts the iterations, which Open3D keeps to itself, and stands still where
/// the linear system has no solution.
template <class Estimation>
struct Counting : Estimation {
  mutable int iterations = 0;
  mutable bool solved = true;

  Eigen::Matrix4d ComputeTransformation(const open3d::geometry::PointCloud& source,
                                        const open3d::geometry::PointCloud& target,
                                        const o3d::CorrespondenceSet& pairs) const override {
    ++iterations;
    const Eigen::Matrix4d step = Estimation::ComputeTransformation(source, target, pairs);
    if (step.allFinite()) return step;
    solved = false;
    return Eigen::Matrix4d::Identity();
  }
};

/// neighbours  of each cloud, from which normals are found; 0: none are needed
/// search      RegistrationICP or RegistrationGeneralizedICP
template <class Estimation, class Search>
void run(const PointCloud& target, const PointCloud& source, const Open3dIcpOptions& options,
         int target_neighbours, int source_neighbours, const Search& search,
         RegistrationResult& result) {
  const Alone alone;
  Stopwatch watch;
  const auto find_normals = [](open3d::geometry::PointCloud& cloud, int neighbours) {
    if (neighbours > 0) cloud.EstimateNormals(open3d::geometry::KDTreeSearchParamKNN(neighbours));
  };
  open3d::geometry::PointCloud moving(used_source(source, options.sampling)->points);
  find_normals(moving, source_neighbours);
  const Pose guess = result.T_target_source;
  result.status = Status::no_overlap;
  result.used_points = moving.points_.size();
  result.time.source = watch.lap();

  // Open3D builds its search tree when it registers.
  open3d::geometry::PointCloud still(used_target(target, options.sampling)->points);
  find_normals(still, target_neighbours);
  result.time.target = watch.lap();

  const Counting<Estimation> estimation;
  const o3d::ICPConvergenceCriteria criteria(options.epsilon, options.epsilon,
                                             options.max_iterations);
  const o3d::RegistrationResult found =
      search(moving, still, options.max_distance, guess.matrix(), estimation, criteria);
  result.iterations = estimation.iterations;
  if (!found.correspondence_set_.empty()) {
    result.T_target_source = normalized(Pose(Eigen::Matrix4d(found.transformation_)));
    result.score = found.inlier_rmse_ * found.inlier_rmse_;
    result.empty_points = result.used_points - found.correspondence_set_.size();
    result.status = !estimation.solved                           ? Status::degenerate
                    : result.iterations < options.max_iterations ? Status::converged
                                                                 : Status::max_iterations;
  }
  result.time.align = watch.lap();
}

void run_icp(const PointCloud& target, const PointCloud& source, const Open3dIcpOptions& options,
             RegistrationResult& result) {
  run<o3d::TransformationEstimationPointToPoint>(target, source, options, 0, 0,
                                                 o3d::RegistrationICP, result);
}

void run_icp_plane(const PointCloud& target, const PointCloud& source,
                   const Open3dNormalOptions& options, RegistrationResult& result) {
  run<o3d::TransformationEstimationPointToPlane>(target, source, options.icp, options.neighbours, 0,
                                                 o3d::RegistrationICP, result);
}

void run_gicp(const PointCloud& target, const PointCloud& source,
              const Open3dNormalOptions& options, RegistrationResult& result) {
  // It takes covariances as they are, but makes flat ones of normals.
  run<o3d::TransformationEstimationForGeneralizedICP>(target, source, options.icp,
                                                      options.neighbours, options.neighbours,
                                                      o3d::RegistrationGeneralizedICP, result);
}

}  // namespace

RegistrationResult register_open3d_icp(const PointCloud& target, const PointCloud& source,
                                       const Pose& T_guess, const Open3dIcpOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::points, run_icp);
}

RegistrationResult register_open3d_icp_plane(const PointCloud& target, const PointCloud& source,
                                             const Pose& T_guess,
                                             const Open3dNormalOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::surfaces, run_icp_plane);
}

RegistrationResult register_open3d_gicp(const PointCloud& target, const PointCloud& source,
                                        const Pose& T_guess, const Open3dNormalOptions& options) {
  return registered_by_peer(target, source, T_guess, options, Matches::surfaces, run_gicp);
}

}  // namespace minescan
