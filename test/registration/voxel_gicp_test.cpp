// SPDX-License-Identifier: MIT
#include "registration/voxel_gicp.h"

#include <gtest/gtest.h>

#include "clouds.h"
#include "registration/normals.h"

namespace minescan {
namespace {

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

PointCloud with_normals(PointCloud cloud) {
  cloud.normals = found_normals(cloud.points, 10);
  return cloud;
}

/// The sum of the paper, from its definition, with the points of each cell looked for among all.
double value_by_hand(const PointCloud& target, const PointCloud& source, const Pose& T,
                     const VoxelGicpOptions& o) {
  const auto cell_of = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return (p / o.cell_size).array().floor();
  };
  const auto covariance = [&](const Eigen::Vector3d& n) {
    // U diag(flatness, 1, 1) U^T
    const Eigen::Matrix3d U =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), n).toRotationMatrix();
    return Eigen::Matrix3d(U * Eigen::Vector3d(o.flatness, 1, 1).asDiagonal() * U.transpose());
  };
  double sum = 0;
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    const Eigen::Vector3d p = T * source.points[i];
    std::vector<Eigen::Vector3d> cells = {cell_of(p)};
    if (o.neighbourhood == VoxelNeighbourhood::faces)
      for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {
          cells.push_back(cells[0]);
          cells.back()[axis] += side;
        }
    for (const Eigen::Vector3d& cell : cells) {
      double n = 0;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
      for (std::size_t k = 0; k < target.points.size(); ++k) {
        if (cell_of(target.points[k]) != cell) continue;
        n += 1;
        mean += target.points[k];
        C += covariance(target.normals[k]);
      }
      if (n == 0) continue;
      const Eigen::Vector3d d = mean / n - p;
      const Eigen::Matrix3d both =
          C / n + T.linear() * covariance(source.normals[i]) * T.linear().transpose();
      sum += (o.count_weight ? n : 1) * d.dot(both.ldlt().solve(d)) / 2;
    }
  }
  return sum;
}

TEST(VoxelGicp, SumsWhatThePaperDefines) {
  const PointCloud target = with_normals(bumpy_tunnel(2000, 1));
  const PointCloud source = with_normals(bumpy_tunnel(200, 2));
  for (const VoxelNeighbourhood neighbourhood :
       {VoxelNeighbourhood::own, VoxelNeighbourhood::faces}) {
    for (const bool count_weight : {true, false}) {
      const VoxelGicpOptions options{.neighbourhood = neighbourhood, .count_weight = count_weight};
      const VoxelMap map(target.points, target.normals, options.cell_size, options.flatness);
      std::vector<QuadraticPair> pairs;
      const std::size_t met = pair_voxels(map, source, near_identity, options, pairs);
      EXPECT_GT(met, 150u);
      EXPECT_LE(met, 200u);
      const double expected = value_by_hand(target, source, near_identity, options);
      // Rounding, times the condition 1 / flatness of the matrices.
      EXPECT_NEAR(quadratic_score(pairs, near_identity, Curvature::full).value, expected,
                  1e-11 * expected);
    }
  }
}

TEST(RegisterVoxelGicp, FindsTheTrueMotionBetweenDifferentSamples) {
  const PointCloud target = bumpy_tunnel(60000, 1);
  for (std::uint64_t stream = 0; stream < 3; ++stream) {
    Random random(2, stream);
    const Pose truth = random_pose(random, 3, 2);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(30000, 2 + stream));
    for (const VoxelNeighbourhood neighbourhood :
         {VoxelNeighbourhood::own, VoxelNeighbourhood::faces}) {
      for (const bool count_weight : {true, false}) {
        const RegistrationResult result =
            register_voxel_gicp(target, source, near_identity * truth,
                                {.neighbourhood = neighbourhood, .count_weight = count_weight});
        EXPECT_EQ(result.status, Status::converged);
        // Centimetres of bias come with cells of 1 m in waves of 10 cm; 10 times below the start
        // error.
        EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.025);
        EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 0.003);
        EXPECT_EQ(result.used_points, 3000u);
        EXPECT_GT(result.target_bytes, 0u);
        EXPECT_GT(result.covariance.determinant(), 0);
      }
    }
  }
}

// A point is drawn to the mean of its cell, not to its own place, so that the truth is not exactly
// where the sum is lowest.
TEST(RegisterVoxelGicp, RegistersACloudWithItselfNearly) {
  const PointCloud cloud = bumpy_tunnel(20000, 1);
  const RegistrationResult result =
      register_voxel_gicp(cloud, cloud, near_identity, {.sampling = {.ratio = 1}});
  EXPECT_EQ(result.status, Status::converged);
  EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).translation, 0.01);
  EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).rotation, 0.001);
}

// Moving by whole cells maps the lattice onto itself.
TEST(RegisterVoxelGicp, MovesAlongWithTheLattice) {
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(5000, 2);
  const VoxelGicpOptions options{.sampling = {.ratio = 1}};
  const Pose here = register_voxel_gicp(target, source, near_identity, options).T_target_source;
  const Pose move(Eigen::Translation3d(3, -5, 2));
  const Pose there =
      register_voxel_gicp(transformed(move, target), source, move * near_identity, options)
          .T_target_source;
  // Rounding of coordinates of 10 m, through as many steps; normals are the same but for it.
  EXPECT_LT(pose_error(move * here, there).translation, 1e-9);
  EXPECT_LT(pose_error(move * here, there).rotation, 1e-9);
}

TEST(RegisterVoxelGicp, TellsAPlaneFromAPlace) {
  const PointCloud target = plane(5000, 12, 0.01, 1), source = plane(3000, 12, 0.01, 2);
  const RegistrationResult result = register_voxel_gicp(target, source, near_identity);
  EXPECT_EQ(result.status, Status::degenerate);
  EXPECT_TRUE(result.T_target_source.isApprox(near_identity, 0));
  ASSERT_EQ(result.directions.size(), 6u);
}

TEST(RegisterVoxelGicp, TellsCloudsThatDoNotMeet) {
  const PointCloud cloud = bumpy_tunnel(5000, 1);
  const Pose away(Eigen::Translation3d(100, 0, 0));
  const RegistrationResult result = register_voxel_gicp(cloud, cloud, away);
  EXPECT_EQ(result.status, Status::no_overlap);
  EXPECT_TRUE(result.T_target_source.isApprox(away, 0));
  EXPECT_EQ(result.outside_points, 500u);
}

}  // namespace
}  // namespace minescan
