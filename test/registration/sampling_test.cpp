// SPDX-License-Identifier: MIT
#include "registration/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "clouds.h"

namespace minescan {
namespace {

constexpr Sampling both[] = {Sampling::uniform, Sampling::spatial};

TEST(Sampling, DrawsAsManyDistinctPointsAsAsked) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(2000, 1).points;
  for (const Sampling sampling : both) {
    for (const double part : {1e-9, 0.004, 0.1, 0.5, 0.9, 1.0}) {
      const auto chosen = sample(points, {.ratio = part, .sampling = sampling});
      const double wanted = std::max(6.0, std::round(part * 2000));
      EXPECT_EQ(static_cast<double>(chosen.size()), wanted);
      EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
      EXPECT_EQ(std::adjacent_find(chosen.begin(), chosen.end()), chosen.end());
      EXPECT_LT(chosen.back(), points.size());
    }
  }
  EXPECT_EQ(sample_size(3, 0.1), 3u);
}

TEST(Sampling, DependsOnTheSeedAlone) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(2000, 1).points;
  for (const Sampling sampling : both) {
    const auto one = sample(points, {.sampling = sampling, .seed = 1});
    EXPECT_EQ(one, sample(points, {.sampling = sampling, .seed = 1}));
    EXPECT_NE(one, sample(points, {.sampling = sampling, .seed = 2}));
  }
}

TEST(Sampling, UniformDrawsEveryPointAlike) {
  std::vector<int> drawn(50);
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(50, 1).points;
  const int runs = 2000;
  for (int seed = 0; seed < runs; ++seed)
    for (const std::uint32_t i :
         sample(points, {.ratio = 0.2, .sampling = Sampling::uniform, .seed = std::uint64_t(seed)}))
      ++drawn[i];
  // Binomial with p = 0.2: mean 400, sigma 17.9; 5 sigma for 50 points.
  for (const int n : drawn) EXPECT_NEAR(n, 400, 90);
}

TEST(Sampling, SpatialDrawsFromCellsInTurn) {
  // One cell with 1000 points, 20 cells with 10 points each.
  std::vector<Eigen::Vector3d> points;
  Random random(1, 0);
  for (int i = 0; i < 1200; ++i) {
    const double x = i < 1000 ? 0 : i % 20 + 1;
    points.push_back({x + 0.9 * random.uniform(), 0.5, 0.5});
  }
  const auto draws = [&](double part) {
    std::map<int, int> count;
    for (const std::uint32_t i : sample(points, {.ratio = part, .cell_size = 1}))
      ++count[static_cast<int>(points[i].x())];
    return count;
  };
  for (const auto& [cell, n] : draws(105.0 / 1200)) EXPECT_EQ(n, 5) << cell;
  // 115 are five rounds and ten more cells.
  std::map<int, int> cells_with;
  for (const auto& [cell, n] : draws(115.0 / 1200)) ++cells_with[n];
  EXPECT_EQ(cells_with, (std::map<int, int>{{5, 11}, {6, 10}}));
  // 300 are all of the 200 thin ones and 100 from the dense cell.
  EXPECT_EQ(draws(0.25)[0], 100);
}

TEST(Sampling, RefusesPointsTooFarForItsCells) {
  EXPECT_THROW(sample(std::vector(100, Eigen::Vector3d(1e7, 0, 0)), {}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
