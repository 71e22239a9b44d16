// SPDX-License-Identifier: MIT
#include "registration/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "clouds.h"

namespace minescan {
namespace {

constexpr Sampling all_ways[] = {Sampling::uniform, Sampling::spatial, Sampling::normals,
                                 Sampling::stable};

/// A corridor of 20 x 4 x 3 m, open at both ends, with a pillar of 0.4 m at one wall: nothing but
/// its two faces across holds a pose along the corridor. Exact normals.
struct Corridor {
  PointCloud cloud = {};
  std::vector<std::uint8_t> across = {};  // whether a point is on one of these faces
};
Corridor corridor(std::size_t count) {
  Corridor c;
  Random random(9, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 20 * (random.uniform() - 0.5), u = random.uniform(), z = 3 * u - 1.5;
    const bool across = i % 50 == 0;
    c.across.push_back(across);
    if (across) {
      const double side = random.uniform() < 0.5 ? -1 : 1;
      c.cloud.points.push_back({3 + 0.2 * side, 2 - 0.4 * random.uniform(), z});
      c.cloud.normals.push_back({side, 0, 0});
    } else if (i % 2 == 0) {
      const double side = random.uniform() < 0.5 ? -1 : 1;
      c.cloud.points.push_back({x, 2 * side, z});
      c.cloud.normals.push_back({0, -side, 0});
    } else {
      const double side = random.uniform() < 0.5 ? -1 : 1;
      c.cloud.points.push_back({x, 4 * u - 2, 1.5 * side});
      c.cloud.normals.push_back({0, 0, -side});
    }
  }
  return c;
}

std::vector<Eigen::Vector3d> sampled(const std::vector<Eigen::Vector3d>& list,
                                     const std::vector<std::uint32_t>& chosen) {
  std::vector<Eigen::Vector3d> part;
  for (const std::uint32_t i : chosen) part.push_back(list[i]);
  return part;
}

/// The t_j of Gelfand's method after these points were chosen.
Vector6d totals(const PointCloud& cloud, const std::vector<std::uint32_t>& chosen) {
  const Stability stability = stability_of(cloud.points, cloud.normals);
  Vector6d sum = Vector6d::Zero();
  for (const std::uint32_t k : chosen)
    sum += (stability.motions.transpose() * stability.holds[k]).cwiseAbs2();
  return sum;
}

TEST(Sampling, DrawsAsManyDistinctPointsAsAsked) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(2000, 1).points;
  for (const Sampling sampling : all_ways) {
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
  for (const Sampling sampling : all_ways) {
    const auto one = sample(points, {.sampling = sampling, .seed = 1});
    EXPECT_EQ(one, sample(points, {.sampling = sampling, .seed = 1}));
    const bool random = sampling != Sampling::stable;
    EXPECT_EQ(one != sample(points, {.sampling = sampling, .seed = 2}), random);
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

TEST(DirectionBands, CutTheSphereIntoEqualAreas) {
  std::size_t first = 0;
  double low = -1;
  for (const DirectionBand& band : direction_bands()) {
    EXPECT_EQ(band.first, first);
    EXPECT_EQ(band.low, low);
    // Archimedes: 2 pi (high - low) for the band; a few roundings of numbers up to 1.
    EXPECT_NEAR((band.high - band.low) / static_cast<double>(band.sectors),
                2.0 / static_cast<double>(direction_buckets()), 1e-15);
    for (std::size_t s = 0; s < band.sectors; ++s) {
      // Just inside the four corners.
      for (const double up : {0.001, 0.999}) {
        for (const double turn : {0.001, 0.999}) {
          const double z = band.low + up * (band.high - band.low), r = std::sqrt(1 - z * z);
          const double angle = 2 * std::numbers::pi * (static_cast<double>(s) + turn) /
                               static_cast<double>(band.sectors);
          EXPECT_EQ(direction_bucket({3 * r * std::cos(angle), 3 * r * std::sin(angle), 3 * z}),
                    first + s);
        }
      }
    }
    first += band.sectors;
    low = band.high;
  }
  EXPECT_EQ(low, 1);
  EXPECT_EQ(first, direction_buckets());
  EXPECT_EQ(direction_bucket({0, 0, 0}), direction_buckets());
  EXPECT_EQ(direction_bucket({std::nan(""), 0, 1}), direction_buckets());
}

TEST(DirectionBands, AreAboutAsWideAsHigh) {
  const double degree = std::numbers::pi / 180;
  for (const DirectionBand& band : direction_bands()) {
    const double height = std::asin(band.high) - std::asin(band.low);
    const double middle = std::cos(std::asin(band.low) + height / 2);
    const double width = 2 * std::numbers::pi * middle / static_cast<double>(band.sectors);
    // 15 degrees, but for the rounding of 3 (at the poles) to 24 sectors.
    EXPECT_NEAR(height, 15 * degree, 1 * degree);
    EXPECT_NEAR(width, 15 * degree, 1 * degree);
  }
}

TEST(DirectionBands, FillEvenlyWithUniformDirections) {
  std::vector<double> count(direction_buckets());
  Random random(7, 0);
  for (std::size_t i = 0; i < 100 * count.size(); ++i)
    ++count[direction_bucket(random_vector(random))];
  double chi_square = 0;
  for (const double n : count) chi_square += (n - 100) * (n - 100) / 100;
  // Mean k = 183, standard deviation sqrt(2 k) = 19.1; 5 of them. Buckets of 15 x 15 degrees (12 x
  // 24) would give thousands.
  EXPECT_NEAR(chi_square, 183, 96);
}

TEST(Sampling, NormalsDrawsFromDirectionsInTurn) {
  // 1000 normals up, 20 along each of x and y, -x and -y; 10 points without a normal.
  std::vector<Eigen::Vector3d> points(1090), normals(1090, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d others[] = {{1, 0.1, 0.1}, {-1, 0.1, 0.1}, {-0.1, 1, 0.1}, {-0.1, -1, 0.1}};
  for (std::size_t i = 0; i < 80; ++i) normals[13 * i] = others[i % 4].normalized();
  for (std::size_t i = 1080; i < 1090; ++i) normals[i].setZero();
  const auto chosen =
      sample(points, {.ratio = 60.0 / 1090, .sampling = Sampling::normals}, normals);
  std::map<std::size_t, int> drawn;
  for (const std::uint32_t i : chosen) ++drawn[direction_bucket(normals[i])];
  ASSERT_EQ(drawn.size(), 6u);
  for (const auto& [bucket, n] : drawn) EXPECT_EQ(n, 10) << bucket;
}

TEST(Sampling, NormalsAreTheCloudsOwnOrFound) {
  const Corridor c = corridor(3000);
  for (const Sampling sampling : {Sampling::normals, Sampling::stable}) {
    const SamplingOptions options{.sampling = sampling};
    const auto across = [&](const std::vector<std::uint32_t>& chosen) {
      return std::count_if(chosen.begin(), chosen.end(),
                           [&](std::uint32_t i) { return c.across[i] != 0; });
    };
    // 60 of 3000 lie across, of which uniform draws take 6. Found normals of edges are slanted.
    EXPECT_GE(across(sample(c.cloud.points, options, c.cloud.normals)), 25);
    EXPECT_GE(across(sample(c.cloud.points, options)), 15);
    const UsedCloud used(c.cloud, options, true);
    EXPECT_EQ(used->points.size(), 300u);
    EXPECT_EQ(used->points,
              sampled(c.cloud.points, sample(c.cloud.points, options, c.cloud.normals)));
    EXPECT_EQ(used->normals,
              sampled(c.cloud.normals, sample(c.cloud.points, options, c.cloud.normals)));
  }
}

TEST(StableSampling, APlaneHoldsThreeMotionsOnly) {
  const PointCloud flat{.points = plane(1000, 10, 0, 1).points,
                        .normals = std::vector(1000, Eigen::Vector3d(0, 0, 1))};
  const Stability stability = stability_of(flat.points, flat.normals);
  // Two translations and the turn about the normal: rounding, of a sum of 1000 terms of 1.
  for (int j = 0; j < 3; ++j) EXPECT_NEAR(stability.eigenvalues[j], 0, 1e-11);
  EXPECT_GT(stability.eigenvalues[3], 100);
  for (int j = 0; j < 3; ++j) {
    const Vector6d x = stability.motions.col(j);  // (turn, shift)
    EXPECT_NEAR(x.segment<2>(0).norm() + std::abs(x[5]), 0, 1e-12);
  }
}

TEST(StableSampling, EveryChoiceIsTheBestForTheMotionHeldLeast) {
  const Corridor c = corridor(400);
  const Stability stability = stability_of(c.cloud.points, c.cloud.normals);
  const std::vector<std::uint32_t> chosen = sample_stable(c.cloud.points, c.cloud.normals, 100);
  Vector6d totals = Vector6d::Zero();
  std::set<std::uint32_t> used;
  for (const std::uint32_t k : chosen) {
    Eigen::Index least = 0;
    totals.minCoeff(&least);
    const auto hold = [&](std::size_t i) {
      return stability.motions.col(least).dot(stability.holds[i]);
    };
    for (std::uint32_t i = 0; i < 400; ++i) {
      if (used.count(i)) continue;
      EXPECT_LE(std::abs(hold(i)), std::abs(hold(k)) + 1e-12);  // rounding of numbers up to 2
    }
    used.insert(k);
    totals += (stability.motions.transpose() * stability.holds[k]).cwiseAbs2();
  }
  EXPECT_EQ(used.size(), 100u);
}

TEST(StableSampling, HoldsTheDirectionsOfACorridorAlike) {
  const Corridor c = corridor(5000);  // 100 points lie across
  const auto stable = sample(c.cloud.points, {.sampling = Sampling::stable}, c.cloud.normals);
  const auto uniform = sample(c.cloud.points, {.sampling = Sampling::uniform}, c.cloud.normals);
  const Vector6d t = totals(c.cloud, stable), u = totals(c.cloud, uniform);
  // A uniform draw of 500 has about 10 of the points across.
  const auto across = [&](const std::vector<std::uint32_t>& chosen) {
    return std::count_if(chosen.begin(), chosen.end(),
                         [&](std::uint32_t i) { return c.across[i] != 0; });
  };
  EXPECT_GE(across(stable), 3 * across(uniform));
  EXPECT_GT(t.minCoeff() / t.maxCoeff(), 3 * u.minCoeff() / u.maxCoeff());
  // Turning about the axis and sliding along it are held least; they take turns, so that their
  // totals differ by no more than one point adds, 1 for a translation.
  Vector6d sorted = t;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_LT(sorted[1] - sorted[0], 1);
  EXPECT_GT(sorted[0], 20);
}

TEST(StableSampling, DoesNotDependOnTheOrderOfPoints) {
  const Corridor c = corridor(1000);
  PointCloud turned = c.cloud;
  std::reverse(turned.points.begin(), turned.points.end());
  std::reverse(turned.normals.begin(), turned.normals.end());
  std::set<std::uint32_t> one, two;
  for (const std::uint32_t i : sample_stable(c.cloud.points, c.cloud.normals, 200)) one.insert(i);
  for (const std::uint32_t i : sample_stable(turned.points, turned.normals, 200))
    two.insert(999 - i);
  EXPECT_EQ(one, two);
}

TEST(Sampling, OfWhatSaysWhichCloudIsSampled) {
  const PointCloud cloud = bumpy_tunnel(1000, 1);
  for (const SampleOf of : {SampleOf::source, SampleOf::target, SampleOf::both}) {
    const SamplingOptions options{.of = of};
    EXPECT_EQ(used_source(cloud, options)->points.size(), of == SampleOf::target ? 1000u : 100u);
    EXPECT_EQ(used_target(cloud, options)->points.size(), of == SampleOf::source ? 1000u : 100u);
  }
  EXPECT_EQ(&*used_target(cloud, {}), &cloud);  // no copy
}

TEST(Sampling, RefusesPointsTooFarForItsCells) {
  EXPECT_THROW(sample(std::vector(100, Eigen::Vector3d(1e7, 0, 0)), {}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
