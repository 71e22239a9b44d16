// SPDX-License-Identifier: MIT
#include "registration/ndt.h"

#include <gtest/gtest.h>

#include "clouds.h"

namespace minescan {
namespace {

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

TEST(RegisterNdt, FindsTheTrueMotionFromNearby) {
  const PointCloud target = bumpy_tunnel(30000, 1);
  for (std::uint64_t stream = 0; stream < 5; ++stream) {
    Random random(1, stream);
    const Pose truth = random_pose(random, 2, 3);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(20000, 2 + stream));
    const RegistrationResult result = register_ndt(target, source, near_identity * truth);
    EXPECT_EQ(result.status, Status::converged);
    // Millimetres of bias come with 1 m cells (see the pinned bias); 30 times below the start
    // error.
    EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.01);
    EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 0.001);
    EXPECT_EQ(result.target_points, 30000u);
    EXPECT_EQ(result.source_points, 20000u);
    EXPECT_EQ(result.used_points, 2000u);
    EXPECT_GT(result.target_bytes, 0u);
    EXPECT_LT(result.score, 0);
    EXPECT_NEAR((result.T_target_source.linear() * result.T_target_source.linear().transpose() -
                 Eigen::Matrix3d::Identity())
                    .norm(),
                0, 1e-14);
  }
}

TEST(RegisterNdt, FindsItCoarseToFineFromFurther) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const Pose guess = displaced(Pose::Identity(), {0.5, 0.6, -0.5}, {0.5, -0.3, 0.8}, 0.15);
  const RegistrationResult result =
      register_ndt(target, source, guess, {.grid = {.cell_size = 0.5}, .levels = 3});
  EXPECT_EQ(result.status, Status::converged);
  EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).translation, 0.01);
  EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).rotation, 0.001);
}

// Sums of sums differ from sums of points by rounding.
TEST(RegisterNdt, MergedLevelsAreThoseOfThePoints) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const auto run = [&](bool merged) {
    return register_ndt(target, source, near_identity,
                        {.grid = {.cell_size = 0.5}, .levels = 3, .merged = merged});
  };
  const RegistrationResult merged = run(true), apart = run(false);
  EXPECT_EQ(merged.status, Status::converged);
  EXPECT_EQ(merged.iterations, apart.iterations);
  EXPECT_EQ(merged.target_bytes, apart.target_bytes);
  EXPECT_LT(pose_error(apart.T_target_source, merged.T_target_source).translation, 1e-9);
}

TEST(RegisterNdt, MergesOnlyUndividedCellsByTwo) {
  const PointCloud cloud = bumpy_tunnel(1000, 1);
  const auto refuses = [&](NdtOptions options) {
    options.merged = true;
    EXPECT_THROW(register_ndt(cloud, cloud, Pose::Identity(), options), std::invalid_argument);
  };
  refuses({.level_ratio = 1.5});
  refuses({.far_distance = 5});
  refuses({.terms = {.discretisation = Discretisation::octree}});
  refuses({.terms = {.neighbourhood = Neighbourhood::faces}});
  refuses({.terms = {.linked = true}});
  refuses({.terms = {.endless = true}});
  refuses({.terms = {.density = Density::mixture}});
}

TEST(RegisterNdt, FindsTheSamePoseInEveryStorage) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const Pose guess = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);
  const auto result_of = [&](Storage storage) {
    return register_ndt(target, source, guess, {.terms = {.storage = storage}});
  };
  const RegistrationResult dense = result_of(Storage::dense);
  std::vector<std::size_t> bytes = {dense.target_bytes};
  for (const Storage storage : {Storage::hash, Storage::morton, Storage::runs}) {
    const RegistrationResult other = result_of(storage);
    EXPECT_EQ(other.T_target_source.matrix(), dense.T_target_source.matrix());
    EXPECT_EQ(other.score, dense.score);
    EXPECT_EQ(other.empty_points, dense.empty_points);
    for (const std::size_t taken : bytes) EXPECT_NE(other.target_bytes, taken);
    bytes.push_back(other.target_bytes);
  }
}

TEST(RegisterNdt, OneLevelIsTheBaselineWhateverTheRatio) {
  const PointCloud target = bumpy_tunnel(10000, 1), source = bumpy_tunnel(10000, 2);
  const auto run = [&](double level_ratio) {
    return register_ndt(target, source, near_identity, {.level_ratio = level_ratio});
  };
  EXPECT_TRUE(run(2).T_target_source.isApprox(run(3).T_target_source, 0));
}

// Longer in the direction in which only relief holds the pose: the tunnel's axis.
TEST(RegisterNdt, CovarianceIsLargestAlongTheTunnel) {
  const RegistrationResult result =
      register_ndt(bumpy_tunnel(30000, 1), bumpy_tunnel(20000, 2), near_identity);
  EXPECT_GT(result.covariance(0, 0), 2 * result.covariance(1, 1));
  EXPECT_GT(result.covariance(0, 0), 2 * result.covariance(2, 2));
  EXPECT_GT(result.covariance.determinant(), 0);
  EXPECT_TRUE(result.covariance.isApprox(result.covariance.transpose(), 1e-9));
}

// The lattice is mapped onto itself, so that nothing but rounding changes.
TEST(RegisterNdt, MotionsThatPreserveTheLatticeLeaveTheResult) {
  const PointCloud target = bumpy_tunnel(10000, 1), source = bumpy_tunnel(10000, 2);
  const Pose plain = register_ndt(target, source, near_identity).T_target_source;
  Pose motion = Pose::Identity();
  motion.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  motion.translation() << 12, -7, 3;
  const Pose moved =
      register_ndt(transformed(motion, target), source, motion * near_identity).T_target_source;
  // Where points lie near a cell's border rounding may move one over: the score's jump is less than
  // one point of the 1000, but the path of the search may differ, up to the convergence limit 1e-4.
  EXPECT_LT(pose_error(motion * plain, moved).translation, 1e-4);
  EXPECT_LT(pose_error(motion * plain, moved).rotation, 1e-4);
}

TEST(RegisterNdt, SaysThatScansDoNotOverlap) {
  const PointCloud target = bumpy_tunnel(10000, 1), source = bumpy_tunnel(10000, 2);
  const Pose guess(Eigen::Translation3d(0, 500, 0));
  const RegistrationResult result = register_ndt(target, source, guess);
  EXPECT_EQ(result.status, Status::no_overlap);
  EXPECT_TRUE(result.T_target_source.isApprox(guess, 0));
  EXPECT_EQ(result.covariance.norm(), 0);
}

TEST(RegisterNdt, SaysThatAPlaneDoesNotFixThePose) {
  for (const double noise : {0.0, 0.01}) {
    const RegistrationResult result =
        register_ndt(plane(20000, 20, noise, 1), plane(20000, 20, noise, 2), near_identity);
    EXPECT_EQ(result.status, Status::degenerate) << noise;
    EXPECT_TRUE(result.T_target_source.isApprox(near_identity, 0));
  }
}

TEST(RegisterNdt, StopsAtTheIterationLimit) {
  const PointCloud cloud = bumpy_tunnel(10000, 1);
  const RegistrationResult result =
      register_ndt(cloud, bumpy_tunnel(10000, 2), near_identity, {.search = {.max_iterations = 2}});
  EXPECT_EQ(result.status, Status::max_iterations);
  EXPECT_EQ(result.iterations, 2);
  EXPECT_LE((result.T_target_source.translation() - near_identity.translation()).norm(), 0.1);
}

TEST(RegisterNdt, RefusesBadOptions) {
  const PointCloud cloud = bumpy_tunnel(100, 1);
  const auto run = [&](const NdtOptions& options) {
    register_ndt(cloud, cloud, Pose::Identity(), options);
  };
  EXPECT_THROW(run({.grid = {.cell_size = 0}}), std::invalid_argument);
  EXPECT_THROW(run({.grid = {.cell_size = -1}}), std::invalid_argument);
  EXPECT_THROW(run({.grid = {.cell_size = 1e9}}), std::invalid_argument);
  EXPECT_THROW(run({.grid = {.cell_size = std::nan("")}}), std::invalid_argument);
  EXPECT_THROW(run({.grid = {.cell_size = 1e-9}}), std::invalid_argument);  // indices
  EXPECT_THROW(run({.sampling = {.ratio = 0}}), std::invalid_argument);
  EXPECT_THROW(run({.search = {.max_iterations = 0}}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
