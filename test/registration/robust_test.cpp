// SPDX-License-Identifier: MIT
#include "registration/robust.h"

#include <gtest/gtest.h>

#include <numbers>

#include "clouds.h"

namespace minescan {
namespace {

/// Those points of a tunnel that a scanner at (x, 0, 0) reaches, in its frame.
PointCloud seen_from(const PointCloud& tunnel, double x, double reach) {
  PointCloud seen;
  for (const Eigen::Vector3d& p : tunnel.points)
    if (std::abs(p.x() - x) < reach) seen.points.push_back(p - Eigen::Vector3d(x, 0, 0));
  return seen;
}

/// The middle of `tunnel`, without the wall at its end.
PointCloud without_end(const PointCloud& tunnel) { return seen_from(tunnel, 0, 11); }

TEST(RegisterRobust, FindsTheTrueMotionFromMetresAway) {
  const PointCloud target = bumpy_tunnel(30000, 1);
  Random random(1, 0);
  for (int trial = 0; trial < 8; ++trial) {
    const Pose truth = random_pose(random, 2, 3);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(20000, 2));
    const Eigen::Vector3d offset = 2 * random_vector(random).normalized();
    const Pose guess = displaced(truth, offset, random_vector(random).normalized(), 0.4);
    const RegistrationResult result = register_robust(target, source, guess);
    EXPECT_EQ(result.status, Status::converged);
    // As 3D-NDT with the same cells, whose bias is below a millimetre (see the pinned bias).
    EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.003);
    EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 0.0005);
    EXPECT_EQ(result.used_points, 20000u);
    EXPECT_GT(result.evaluations, result.iterations);
    EXPECT_GT(result.target_bytes, 0u);
    EXPECT_EQ(result.directions.size(), 6u);
  }
}

// Nothing but waves of 10 cm tells where along the tunnel the scanner was, and most of one scan
// lies within the other only where that is wrong.
TEST(RegisterRobust, FindsThePlaceAlongATunnelThatItSeesAPartOf) {
  const PointCloud target = seen_from(without_end(bumpy_tunnel(40000, 1)), -2, 8);
  const PointCloud source = seen_from(without_end(bumpy_tunnel(40000, 2)), 2, 8);
  const Pose truth{Eigen::Translation3d(4, 0, 0)};
  for (const double along : {-1.7, -0.6, 0.9, 1.6}) {
    const Pose guess = displaced(truth, {along, 0.3, -0.2}, {0, 0.2, 1}, 0.15);
    const RegistrationResult result = register_robust(target, source, guess);
    EXPECT_EQ(result.status, Status::converged);
    EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.02) << along;
  }
  // That is what the starts along the tunnel are good for.
  const Pose guess = displaced(truth, {-1.7, 0.3, -0.2}, {0, 0.2, 1}, 0.15);
  const RegistrationResult result =
      register_robust(target, source, guess, {.turns = 0, .slides = 0});
  EXPECT_GT(pose_error(truth, result.T_target_source).translation, 0.1);
}

TEST(RegisterRobust, IsTheSameForTheSameSeed) {
  const PointCloud target = bumpy_tunnel(10000, 1), source = bumpy_tunnel(10000, 2);
  const Pose guess = displaced(Pose::Identity(), {1, 0, 0}, {0, 0, 1}, 0.1);
  const RobustOptions options{.points = 3000, .seed = 5};
  const RegistrationResult a = register_robust(target, source, guess, options);
  const RegistrationResult b = register_robust(target, source, guess, options);
  EXPECT_TRUE(a.T_target_source.matrix() == b.T_target_source.matrix());
  EXPECT_EQ(a.used_points, 3000u);
}

// A motion that maps the lattice onto itself maps the result.
TEST(RegisterRobust, MovesWithTheTarget) {
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(8000, 2);
  const Pose guess = displaced(Pose::Identity(), {1, 0.3, 0}, {0, 0, 1}, 0.2);
  const Pose moved = Eigen::Translation3d(8, -4, 2) *
                     Pose(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  const RegistrationResult here = register_robust(target, source, guess);
  const RegistrationResult there =
      register_robust(transformed(moved, target), source, moved * guess);
  // Turning rounds coordinates, and the last step is up to 1e-4.
  const PoseError apart = pose_error(moved * here.T_target_source, there.T_target_source);
  EXPECT_LT(apart.translation, 5e-4);
  EXPECT_LT(apart.rotation, 5e-5);
}

TEST(RegisterRobust, TellsWhatCannotBeRegistered) {
  const Pose guess = displaced(Pose::Identity(), {0.2, 0, 0}, {0, 0, 1}, 0.02);
  const PointCloud tunnel = bumpy_tunnel(5000, 1);
  const auto status = [&](const PointCloud& target, const PointCloud& source) {
    const RegistrationResult result = register_robust(target, source, guess);
    EXPECT_TRUE(result.T_target_source.matrix() == guess.matrix());
    return result.status;
  };
  EXPECT_EQ(status(plane(5000, 12, 0.01, 1), plane(5000, 12, 0.01, 2)), Status::degenerate);
  PointCloud few{.points = {tunnel.points.begin(), tunnel.points.begin() + 4}};
  EXPECT_EQ(status(few, tunnel), Status::no_overlap);
  EXPECT_NE(status(tunnel, few), Status::converged);
  const PointCloud one_place{.points = std::vector<Eigen::Vector3d>(100, {1, 2, 3})};
  EXPECT_EQ(status(one_place, tunnel), Status::no_overlap);
  EXPECT_NE(status(tunnel, one_place), Status::converged);
  PointCloud line;
  for (int i = 0; i < 1000; ++i) line.points.push_back({0.01 * i, 0, 0});
  EXPECT_NE(status(line, line), Status::converged);
  const Pose away{Eigen::Translation3d(0, 300, 0)};
  EXPECT_EQ(status(tunnel, transformed(away, tunnel)), Status::no_overlap);
}

TEST(RegisterRobust, RefusesWhatItCannotDo) {
  const PointCloud tunnel = bumpy_tunnel(2000, 1);
  EXPECT_THROW(register_robust(tunnel, {}, Pose::Identity()), std::invalid_argument);
  EXPECT_THROW(register_robust(tunnel, tunnel, Pose::Identity(), {.cell_size = 1e-6}),
               std::invalid_argument);
  // 2^24 cells of 4 mm are a cube of 1 m.
  PointCloud dense;
  Random random(1, 0);
  for (const Eigen::Vector3d& p : tunnel.points)
    for (int i = 0; i < 10; ++i) dense.points.push_back(p + 0.0005 * random_vector(random));
  EXPECT_THROW(register_robust(dense, tunnel, Pose::Identity(), {.cell_size = 0.004}),
               std::invalid_argument);
}

}  // namespace
}  // namespace minescan
