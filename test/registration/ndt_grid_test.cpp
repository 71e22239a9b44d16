// SPDX-License-Identifier: MIT
#include "registration/ndt_grid.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <map>

#include "clouds.h"

namespace minescan {
namespace {

Eigen::Vector3d variances(const NdtCell& cell) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information_matrix(cell));
  return solver.eigenvalues().cwiseInverse().reverse();
}

/// Points of one cell, [0, 1)^3 moved by `corner`.
std::vector<Eigen::Vector3d> patch(const Eigen::Vector3d& corner, double thickness,
                                   std::uint64_t seed) {
  std::vector<Eigen::Vector3d> points;
  Random random(seed, 0);
  for (int i = 0; i < 500; ++i) {
    const double x = random.uniform(), y = random.uniform();
    points.push_back(corner + Eigen::Vector3d(x, y, 0.5 + thickness * random.normal()));
  }
  return points;
}

TEST(NdtCell, HasTheMeanAndTheCovarianceOfItsPoints) {
  Random random(1, 0);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 50; ++i)
    points.push_back({random.uniform(), random.uniform(), random.uniform()});
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / 50.0;
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) C += (p - mean) * (p - mean).transpose() / 49.0;

  const NdtGrid grid(points, {});
  ASSERT_EQ(grid.cells().size(), 1u);
  EXPECT_TRUE(grid.cells()[0].mean.isApprox(mean, 1e-14));
  EXPECT_TRUE(information_matrix(grid.cells()[0]).isApprox(C.inverse(), 1e-12));
}

TEST(NdtCell, RaisesSmallEigenvaluesToExactlyTheRatioAndLeavesTheLargeOnes) {
  for (const double ratio : {10.0, 100.0, 1000.0}) {
    const NdtGrid grid(patch({0, 0, 0}, 1e-4, 2), {.eigenvalue_ratio = ratio});
    ASSERT_EQ(grid.cells().size(), 1u);
    const Eigen::Vector3d v = variances(grid.cells()[0]);
    EXPECT_NEAR(v[2] / v[0], ratio, 1e-9 * ratio);
    // A uniform patch of side 1: 1/12, within 3 sigma for 500 points (relative sigma 0.04).
    EXPECT_NEAR(v[2], 1.0 / 12, 0.12 / 12);
    EXPECT_NEAR(std::abs(grid.normal(grid.cells()[0]).z()), 1, 1e-6);
  }
}

TEST(NdtCell, OfPointsInAllDirectionsIsNotTouched) {
  std::vector<Eigen::Vector3d> points;  // the corners of a cube: variance 8/7 * 0.2^2 each way
  for (int i = 0; i < 8; ++i)
    points.push_back(Eigen::Vector3d(i & 1, (i >> 1) & 1, i >> 2) * 0.4 +
                     Eigen::Vector3d(0.3, 0.3, 0.3));
  const NdtGrid grid(points, {.eigenvalue_ratio = 1.5});
  ASSERT_EQ(grid.cells().size(), 1u);
  const double variance = 8.0 / 7 * 0.04;
  EXPECT_TRUE(
      information_matrix(grid.cells()[0]).isApprox(Eigen::Matrix3d::Identity() / variance, 1e-12));
}

// Sums of squares of coordinates lose the thickness of a wall far away: in single precision 100 m
// from the origin its variance came out negative.
TEST(NdtCell, KeepsItsThicknessFarFromTheOrigin) {
  const double ratio = 1e8;  // no floor at this thickness
  const NdtGrid here(patch({0, 0, 0}, 1e-3, 3), {.eigenvalue_ratio = ratio});
  for (const double distance : {100.0, 1000.0, 100000.0}) {
    const NdtGrid there(patch({distance, -distance, distance}, 1e-3, 3),
                        {.eigenvalue_ratio = ratio});
    ASSERT_EQ(there.cells().size(), 1u);
    // Coordinates are rounded to 1e-16 of the distance, against a thickness of 1e-3.
    const double tolerance = 1e-12 * distance + 1e-10;
    EXPECT_NEAR(variances(there.cells()[0])[0] / variances(here.cells()[0])[0], 1, tolerance);
  }
}

TEST(NdtCell, NeedsEnoughPointsThatDoNotCoincide) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 4; ++i) points.push_back({0.1 * i, 0.03 * i * i, 0.5});
  EXPECT_TRUE(NdtGrid(points, {}).cells().empty());
  points.push_back({0.9, 0.1, 0.2});
  EXPECT_EQ(NdtGrid(points, {}).cells().size(), 1u);
  EXPECT_TRUE(NdtGrid(std::vector(10, Eigen::Vector3d(0.1, 0.7, 0.3)), {}).cells().empty());
}

TEST(NdtGrid, FindsTheCellByFloorOnBothSidesOfZero) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 10; ++i) {
    points.push_back({-0.1 - 0.05 * i, -0.3, -0.2 - 0.03 * i * i});  // cell (-1, -1, ...)
    points.push_back({0.1 + 0.05 * i, 0.3, 0.01 * i * i});           // cell (0, 0, 0)
  }
  const NdtGrid grid(points, {.cell_size = 10});
  ASSERT_EQ(grid.cells().size(), 2u);
  EXPECT_EQ(grid.find({-1e-9, -1, -1}), grid.find({-9.9, -9.9, -9.9}));
  EXPECT_EQ(grid.find({0, 0, 0}), grid.find({9.9, 9.9, 9.9}));
  EXPECT_NE(grid.find({0, 0, 0}), grid.find({-1, -1, -1}));
  EXPECT_EQ(grid.find({10, 0, 0}), nullptr);
  EXPECT_EQ(grid.find({0, 1e300, 0}), nullptr);
  EXPECT_EQ(grid.find({0, std::nan(""), 0}), nullptr);
}

TEST(NdtGrid, AgreesWithAMapOfCells) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(5000, 4).points;
  const NdtGridOptions options{.cell_size = 0.7, .lattice_origin = {0.2, -0.1, 0.3}};
  std::map<std::array<int, 3>, std::vector<Eigen::Vector3d>> cells;
  const auto index = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d i = ((p - options.lattice_origin) / options.cell_size).array().floor();
    return std::array{static_cast<int>(i.x()), static_cast<int>(i.y()), static_cast<int>(i.z())};
  };
  for (const Eigen::Vector3d& p : points) cells[index(p)].push_back(p);

  const NdtGrid grid(points, options);
  std::size_t with_distribution = 0;
  for (const auto& [key, inside] : cells) {
    const NdtCell* cell = grid.find(inside[0]);
    ASSERT_EQ(cell != nullptr, inside.size() >= 5);
    if (!cell) continue;
    ++with_distribution;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : inside) mean += p / static_cast<double>(inside.size());
    EXPECT_TRUE(cell->mean.isApprox(mean, 1e-12));
  }
  EXPECT_EQ(grid.cells().size(), with_distribution);
}

TEST(NdtGrid, TakesMemoryForCellsInUseOnly) {
  std::vector<Eigen::Vector3d> points = patch({0, 0, 0}, 0.1, 5);
  const std::size_t near = NdtGrid(points, {.cell_size = 0.5}).bytes();
  points.push_back({500000, -500000, 500000});
  EXPECT_EQ(NdtGrid(points, {.cell_size = 0.5}).bytes(), near);
}

TEST(NdtGrid, RefusesCellsTooSmallForTheirDistance) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {2000, 0, 0}};
  EXPECT_NO_THROW(NdtGrid(points, {.cell_size = 0.01}));
  EXPECT_THROW(NdtGrid(points, {.cell_size = 0.001}), std::invalid_argument);
}

// The merged cells hold the same points as those made from scratch, and the same sums.
TEST(SummedCells, TwiceAsLargeAreThoseOfTheSamePoints) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(20000, 1).points;
  const Eigen::Vector3d origin(0.3, -0.2, 0.1);
  const SummedCells merged =
      twice_as_large(twice_as_large(sum_cells(points, Lattice(0.5, origin))));
  const SummedCells direct = sum_cells(points, Lattice(2, origin));
  EXPECT_EQ(merged.lattice.side(), 2);
  ASSERT_EQ(merged.keys, direct.keys);
  for (std::size_t c = 0; c < direct.keys.size(); ++c) {
    EXPECT_EQ(merged.sums[c].count, direct.sums[c].count);
    // Rounding of up to 1000 additions.
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(merged.sums[c].sum[i], direct.sums[c].sum[i], 1e-9);
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_NEAR(merged.sums[c].products[i], direct.sums[c].products[i], 1e-9);
  }
}

}  // namespace
}  // namespace minescan
