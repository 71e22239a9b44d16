// SPDX-License-Identifier: MIT
#include "registration/ndt_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clouds.h"
#include "registration/ndt.h"
#include "registration/ndt_sums.h"

namespace minescan {
namespace {

/// Those of `points` that lie more than 0.1 mm from any cell's face under T: the others may count
/// for one cell in single precision and for another in double.
std::vector<Eigen::Vector3d> off_the_faces(const std::vector<Eigen::Vector3d>& points,
                                           const Pose& T) {
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d moved = T * p;
    const Eigen::Vector3d to_face = moved - Eigen::Vector3d(moved.array().round());
    if (to_face.cwiseAbs().minCoeff() > 1e-4) kept.push_back(p);
  }
  return kept;
}

// Coordinates of 24 m are exact to 1e-6 m, cells are 0.03 m thick: 1e-4 of a term, at random.
constexpr double tolerance = 1e-4;

TEST(NdtField, SumsWhatThePlainFormDoes) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  const std::optional<NdtField> field = ndt_field(grid);
  ASSERT_TRUE(field);
  Random random(7, 0);
  for (const std::size_t count : {7u, 16u, 3000u, 5000u}) {
    const Pose T = random_pose(random, 0.2, 0.1);
    const std::vector<Eigen::Vector3d> points = off_the_faces(bumpy_tunnel(count, 2).points, T);
    const PackedPoints packed(points);
    for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
      const Score plain = ndt_score(grid, T, points, curvature);
      const Score score = ndt_score(*field, T, packed, curvature);
      EXPECT_EQ(score.met, plain.met);
      EXPECT_NEAR(score.value, plain.value, tolerance * std::abs(plain.value));
      EXPECT_TRUE(score.gradient.isApprox(plain.gradient, tolerance));
      EXPECT_TRUE(score.hessian.isApprox(plain.hessian, tolerance));
      EXPECT_EQ(score.value, ndt_value(*field, T, packed));
    }
    const NdtInformation plain = ndt_information(grid, T, points);
    const NdtInformation information = ndt_information(*field, T, packed);
    EXPECT_TRUE(information.gauss_newton.isApprox(plain.gauss_newton, tolerance));
    EXPECT_TRUE(information.surface.isApprox(plain.surface, tolerance));
    EXPECT_NEAR(information.weights, plain.weights, tolerance * plain.weights);
    EXPECT_NEAR(information.squares, plain.squares, tolerance * plain.squares);
  }
}

TEST(NdtField, PointsOutsideMeetNothingOrTheBorder) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  NdtField field = *ndt_field(grid);
  const Pose far{Eigen::Translation3d(1000, 0, 0)};
  // A hundred metres off each face, and on the tunnel's end wall a metre back.
  const std::vector<Eigen::Vector3d> outside = {{100, 0, 0},  {-100, 0, 0}, {0, 100, 0},
                                                {0, -100, 0}, {0, 0, 100},  {0, 0, -100}};
  EXPECT_EQ(ndt_score(field, Pose::Identity(), PackedPoints(outside)).met, 0u);
  EXPECT_EQ(ndt_score(field, far, PackedPoints(bumpy_tunnel(100, 1).points)).met, 0u);
  field.endless = true;
  EXPECT_EQ(ndt_score(field, Pose::Identity(), PackedPoints({{13.3, 0.3, 0.3}})).met, 1u);
}

TEST(LinkCells, PointToTheNearest) {
  const NdtGrid grid(bumpy_tunnel(2500, 1).points, {});  // gaps in the walls
  NdtField field = *ndt_field(grid, 2);
  const std::vector<std::int32_t> before = field.number;
  ASSERT_GT(grid.cells().size(), 100u);
  link_cells(field);
  const auto place = [&](std::int32_t i) {
    const std::int32_t x = i % field.size[0], y = i / field.size[0] % field.size[1];
    return Eigen::Vector3i(x, y, i / (field.size[0] * field.size[1]));
  };
  const auto count = static_cast<std::int32_t>(before.size());
  for (std::int32_t i = 0; i < count; ++i) {
    int nearest = 1 << 30, found = 1 << 30;
    for (std::int32_t j = 0; j < count; ++j) {
      if (before[static_cast<std::size_t>(j)] < 0) continue;
      const int squared = (place(i) - place(j)).squaredNorm();
      nearest = std::min(nearest, squared);
      if (before[static_cast<std::size_t>(j)] == field.number[static_cast<std::size_t>(i)])
        found = squared;
    }
    EXPECT_EQ(found, nearest);
  }
}

TEST(LinkCells, PointToTheNearestMean) {
  const NdtGrid grid(bumpy_tunnel(2000, 1).points, {});
  NdtField by_mean = *ndt_field(grid, 2), by_centre = by_mean;
  const std::vector<std::int32_t> before = by_mean.number;
  link_cells_by_mean(by_mean);
  link_cells(by_centre);
  const auto distance = [&](std::size_t cell, std::int32_t number) {
    const auto i = static_cast<std::int32_t>(cell);
    const Eigen::Array3d centre =
        Eigen::Array3d(i % by_mean.size[0], i / by_mean.size[0] % by_mean.size[1],
                       i / (by_mean.size[0] * by_mean.size[1])) +
        0.5;
    const float* mean = by_mean.rows[static_cast<std::size_t>(number)].mean;
    return (centre.matrix() - Eigen::Vector3f(mean[0], mean[1], mean[2]).cast<double>()).norm();
  };
  std::size_t other = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    other += by_mean.number[i] != by_centre.number[i];
    if (before[i] >= 0) {
      EXPECT_EQ(by_mean.number[i], before[i]);
      continue;
    }
    for (std::size_t row = 0; row + 1 < by_mean.rows.size(); ++row)
      EXPECT_LE(distance(i, by_mean.number[i]), distance(i, static_cast<std::int32_t>(row)));
  }
  EXPECT_GT(other, before.size() / 20);
}

TEST(NdtField, OfCellsFarApartThereIsNone) {
  PointCloud cloud = bumpy_tunnel(5000, 1);
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(3, i);
    cloud.points.push_back(Eigen::Vector3d(1e5, 1e5, 1e4) + 0.1 * random_vector(random));
  }
  EXPECT_FALSE(ndt_field(NdtGrid(cloud.points, {})));
  EXPECT_FALSE(ndt_field(NdtGrid({{0, 0, 0}}, {})));

  // Registration does without: the same, but for the digits.
  const Pose guess = displaced(Pose::Identity(), {0.1, 0, 0.1}, {0, 0, 1}, 0.02);
  const NdtOptions options{.sampling = {.ratio = 1}, .search = {.stop_step = 1e-7}};
  const PointCloud source = bumpy_tunnel(3000, 2);
  const RegistrationResult plain = register_ndt(cloud, source, guess, options);
  cloud.points.resize(5000);
  const RegistrationResult result = register_ndt(cloud, source, guess, options);
  EXPECT_EQ(result.status, Status::converged);
  EXPECT_EQ(plain.status, Status::converged);
  EXPECT_LT(pose_error(plain.T_target_source, result.T_target_source).translation, 1e-4);
  EXPECT_LT(pose_error(plain.T_target_source, result.T_target_source).rotation, 1e-5);
}

}  // namespace
}  // namespace minescan
