// SPDX-License-Identifier: MIT
#include "registration/distance_quadrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "clouds.h"

namespace minescan {
namespace {

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

/// 2 (A) of a function by central differences.
Eigen::Matrix3d half_hessian(const std::function<double(const Eigen::Vector3d&)>& f,
                             const Eigen::Vector3d& x) {
  const double h = 1e-3;
  Eigen::Matrix3d H;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d a = h * Eigen::Vector3d::Unit(i), b = h * Eigen::Vector3d::Unit(j);
      H(i, j) = (f(x + a + b) - f(x + a - b) - f(x - a + b) + f(x - a - b)) / (8 * h * h);
    }
  return H;
}

/// Patches at (0, 0, 2) of a sphere and a cylinder (along x) of radius 2 about the origin, and of
/// the plane z = 2; the normal may point either way.
SurfacePatch patch_of(const Eigen::Vector2d& curvatures, bool outwards) {
  SurfacePatch patch{.point = {0, 0, 2}, .normal = {0, 0, outwards ? 1.0 : -1.0}};
  patch.directions << 1, 0, 0, 1, 0, 0;
  patch.curvatures = (outwards ? -1 : 1) * curvatures;
  return patch;
}
double sphere(const Eigen::Vector3d& x) { return std::pow(x.norm() - 2, 2); }
double cylinder(const Eigen::Vector3d& x) { return std::pow(std::hypot(x.y(), x.z()) - 2, 2); }
double flat(const Eigen::Vector3d& x) { return std::pow(x.z() - 2, 2); }

TEST(DistanceQuadric, IsTheSquaredDistanceToSecondOrder) {
  const struct {
    Eigen::Vector2d curvatures;
    double (*exact)(const Eigen::Vector3d&);
  } surfaces[] = {{{0.5, 0.5}, sphere}, {{0, 0.5}, cylinder}, {{0, 0}, flat}};
  for (const auto& [curvatures, exact] : surfaces) {
    for (const bool outwards : {true, false}) {
      for (const double z : {2.0, 2.1, 3.0, 7.0}) {  // outside, where delta is never negative
        const Eigen::Vector3d x(0, 0, z);
        const Quadric F = distance_quadric(patch_of(curvatures, outwards), x);
        EXPECT_NEAR(F(x), exact(x), 1e-14);
        // h^2 times fourth derivatives of order 1; rounding of 25 is 1e-15 / h^2.
        EXPECT_TRUE(F.A.isApprox(half_hessian(exact, x), 1e-6)) << z << "\n" << F.A;
        for (int i = 0; i < 3; ++i) {
          const Eigen::Vector3d h = 1e-5 * Eigen::Vector3d::Unit(i);
          EXPECT_NEAR(F(x + h) - F(x - h), exact(x + h) - exact(x - h), 1e-13);
        }
      }
      // Inside, up to the focal point: from the plane.
      const Quadric F = distance_quadric(patch_of(curvatures, outwards), {0, 0, 1.2});
      EXPECT_TRUE(F.A.isApprox(Eigen::Vector3d(0, 0, 1).asDiagonal().toDenseMatrix(), 1e-15));
    }
  }
}

TEST(DistanceQuadric, GoesFromThePlaneToThePoint) {
  const Eigen::Matrix3d plane = Eigen::Vector3d(0, 0, 1).asDiagonal();
  for (const bool outwards : {true, false}) {
    const SurfacePatch patch = patch_of({0.5, 0.3}, outwards);
    EXPECT_TRUE(distance_quadric(patch, {0, 0, 2 + 1e-9}).A.isApprox(plane, 1e-9));
    EXPECT_TRUE(distance_quadric(patch, {0, 0, 1e9}).A.isApprox(Eigen::Matrix3d::Identity(), 1e-8));
    EXPECT_TRUE(
        distance_quadric(patch, {0, 0, -1e9}).A.isApprox(Eigen::Matrix3d::Identity(), 1e-8));
    // At the focal point of the larger curvature, where d kappa = 1: no division by zero.
    EXPECT_TRUE(distance_quadric(patch, {0, 0, 0}).A.allFinite());
  }
}

/// The patch at the origin of z(x, y), from a grid of points, turned by `turn`, found with a rough
/// normal that is 0.1 rad off.
SurfacePatch patch_at_origin(const std::function<double(double, double)>& z,
                             const Eigen::Matrix3d& turn) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Neighbour> neighbours;
  for (int i = -3; i <= 3; ++i)
    for (int j = -3; j <= 3; ++j) {
      const double x = 0.02 * i, y = 0.02 * j;
      points.push_back(turn * Eigen::Vector3d(x, y, z(x, y)));
      neighbours.push_back(
          {static_cast<std::uint32_t>(neighbours.size()), points.back().squaredNorm()});
    }
  std::sort(neighbours.begin(), neighbours.end(), [](const Neighbour& a, const Neighbour& b) {
    return a.squared_distance < b.squared_distance;
  });
  const Eigen::Matrix3d off = rotation_exp({0.08, -0.06, 0});
  return fit_patch(Eigen::Vector3d::Zero(), turn * off * Eigen::Vector3d::UnitZ(), neighbours,
                   points);
}

TEST(SurfacePatch, FindsTheCurvaturesOfKnownSurfaces) {
  Random random(1, 0);
  const struct {
    std::function<double(double, double)> z;
    Eigen::Vector2d curvatures;  // ascending
  } surfaces[] = {
      {[](double, double) { return 0.0; }, {0, 0}},
      {[](double x, double y) { return 2 - std::sqrt(4 - x * x - y * y); }, {0.5, 0.5}},
      {[](double, double y) { return std::sqrt(4 - y * y) - 2; }, {-0.5, 0}},
      {[](double x, double y) { return x * x - 0.5 * y * y; }, {-1, 2}},
  };
  for (const auto& surface : surfaces) {
    const Eigen::Matrix3d turn = random_pose(random, 0, 3).linear();
    const SurfacePatch patch = patch_at_origin(surface.z, turn);
    // What the third and fourth order, 0.06 m away and seen 0.1 rad askew, add to the fit.
    EXPECT_LT((patch.curvatures - surface.curvatures).norm(), 0.02) << patch.curvatures;
    EXPECT_NEAR(patch.normal.dot(turn.col(2)), 1, 1e-4);
    // An orthonormal frame, whatever the fit.
    Eigen::Matrix3d frame;
    frame << patch.directions, patch.normal;
    EXPECT_TRUE((frame.transpose() * frame).isApprox(Eigen::Matrix3d::Identity(), 1e-12));
    if (surface.curvatures[1] == 2) {  // of the saddle, along x
      EXPECT_NEAR(std::abs(patch.directions.col(1).dot(turn.col(0))), 1, 1e-3);
    }
  }
}

TEST(SurfacePatch, IsAPlaneWhereNothingFixesAQuadric) {
  std::vector<Eigen::Vector3d> line;
  std::vector<Neighbour> neighbours;
  for (std::uint32_t i = 0; i < 10; ++i) {
    line.push_back({0.1 * i, 0, 0});
    neighbours.push_back({i, line.back().squaredNorm()});
  }
  const SurfacePatch patch = fit_patch({0, 0, 0}, {0, 0, 1}, neighbours, line);
  EXPECT_EQ(patch.normal, Eigen::Vector3d(0, 0, 1));
  EXPECT_TRUE(patch.curvatures.isZero(0));
  EXPECT_TRUE(fit_patch({0, 0, 0}, {0, 0, 0}, neighbours, line).normal.isZero(0));
}

/// The mean square of F less the squared distance over the samples of a cell.
double error_by_hand(const DistanceOctree::Cell& cell, double smallest,
                     const std::vector<Eigen::Vector3d>& points) {
  const int steps = static_cast<int>(std::lround(2 * cell.side / smallest));
  double sum = 0;
  int count = 0;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j)
      for (int k = 0; k <= steps; ++k) {
        const Eigen::Vector3d x =
            cell.quadric.centre +
            cell.side * (Eigen::Vector3d(i, j, k) / steps - Eigen::Vector3d::Constant(0.5));
        double nearest = std::numeric_limits<double>::infinity();
        for (const Eigen::Vector3d& p : points) nearest = std::min(nearest, (p - x).squaredNorm());
        sum += std::pow(cell.quadric(x) - nearest, 2);
        ++count;
      }
  return std::sqrt(sum / count);
}

TEST(DistanceOctree, MergesNoFurtherThanItsErrorAllows) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(1000, 1).points;
  const KdTree tree(points);
  const DistanceOctreeOptions options{.cell_size = 1, .depth = 2, .merge_error = 0.3};
  const DistanceOctree octree(points, tree, 2, options);
  std::size_t merged = 0, checked = 0;
  for (const DistanceOctree::Cell& cell : octree.cells()) {
    if (cell.side > 1) {
      ++merged;
      EXPECT_LE(cell.error, options.merge_error);
    }
    if (&cell - octree.cells().data() > 40 && cell.side < 2) continue;  // all of them take seconds
    ++checked;
    EXPECT_NEAR(error_by_hand(cell, 1, points), cell.error, 1e-9);  // rounding of a fit of 10
  }
  EXPECT_GT(merged, 5u);
  EXPECT_GT(checked, 40u);
  const DistanceOctree plain(points, tree, 2, {.cell_size = 1, .depth = 0});
  double volume = 0;
  for (const DistanceOctree::Cell& cell : octree.cells()) volume += std::pow(cell.side, 3);
  EXPECT_EQ(volume, static_cast<double>(plain.cells().size()));
}

TEST(DistanceOctree, CoversTheBandAndKnowsItsCells) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(2000, 1).points;
  const KdTree tree(points);
  const DistanceOctree octree(points, tree, 1, {});
  Random random(5, 0);
  int inside = 0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d x(30 * (random.uniform() - 0.5), 10 * (random.uniform() - 0.5),
                            10 * (random.uniform() - 0.5));
    const double distance = std::sqrt(tree.nearest(x, 1e9)->squared_distance);
    const Quadric* quadric = octree.find(x);
    EXPECT_TRUE(quadric || distance > 1);
    EXPECT_TRUE(!quadric || distance <= 1 + 0.5 * std::sqrt(3.0));  // a cell further
    if (!quadric) continue;
    ++inside;
    const auto cell = std::find_if(octree.cells().begin(), octree.cells().end(),
                                   [&](const auto& c) { return &c.quadric == quadric; });
    ASSERT_NE(cell, octree.cells().end());
    EXPECT_LE((x - quadric->centre).cwiseAbs().maxCoeff(), cell->side / 2 + 1e-12);
  }
  EXPECT_GT(inside, 500);
}

TEST(DistanceOctree, FitsTheDistanceFromAPlane) {
  std::vector<Eigen::Vector3d> points;
  for (int i = -100; i <= 100; ++i)
    for (int j = -100; j <= 100; ++j) points.push_back({0.04 * i, 0.04 * j, 0.3});
  const DistanceOctree octree(points, KdTree(points), 1, {});
  Random random(6, 0);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d x(4 * (random.uniform() - 0.5), 4 * (random.uniform() - 0.5),
                            1.8 * (random.uniform() - 0.5) + 0.3);
    const Quadric* F = octree.find(x);
    ASSERT_NE(F, nullptr);
    // The nearest point is up to 0.04 / sqrt(2) beside the foot of x: 8e-4 m^2.
    EXPECT_NEAR((*F)(x), std::pow(x.z() - 0.3, 2), 1e-3);
    EXPECT_NEAR(F->A(2, 2), 1, 0.02);
  }
  // Fewer than the cells of 0.5 m, since a plane needs small ones at its edges only.
  const DistanceOctree plain(points, KdTree(points), 1, {.depth = 0});
  EXPECT_LT(2 * octree.cells().size(), plain.cells().size());
  EXPECT_LT(octree.bytes(), plain.bytes());
}

TEST(DistanceOctree, RefusesABandOfTooManyCells) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(100, 1).points;
  EXPECT_THROW(DistanceOctree(points, KdTree(points), 8.1, {}), std::invalid_argument);
  const std::vector<Eigen::Vector3d> far = {{2e5, 0, 0}};
  EXPECT_THROW(DistanceOctree(far, KdTree(far), 1, {}), std::invalid_argument);
}

constexpr Approximant both[] = {Approximant::on_demand, Approximant::octree};

TEST(RegisterDistanceQuadrics, FindsTheTrueMotionBetweenDifferentSamples) {
  const PointCloud target = bumpy_tunnel(60000, 1);
  for (std::uint64_t stream = 0; stream < 2; ++stream) {
    Random random(2, stream);
    const Pose truth = random_pose(random, 3, 2);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(30000, 2 + stream));
    for (const Approximant approximant : both) {
      const RegistrationResult result = register_distance_quadrics(
          target, source, near_identity * truth, {.approximant = approximant});
      EXPECT_EQ(result.status, Status::converged);
      // A tenth of the start error (0.27 m, 0.05 rad): where only relief holds the pose, along the
      // tunnel, steps fall below 1e-4 before the end is reached.
      EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.025);
      EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 0.003);
      EXPECT_EQ(result.used_points, 3000u);
      EXPECT_GT(result.target_bytes, 0u);
      EXPECT_GT(result.covariance.determinant(), 0);
    }
  }
}

TEST(RegisterDistanceQuadrics, RegistersACloudWithItself) {
  const PointCloud cloud = bumpy_tunnel(10000, 1);
  for (const Approximant approximant : both) {
    const RegistrationResult result = register_distance_quadrics(
        cloud, cloud, near_identity, {.sampling = {.ratio = 1}, .approximant = approximant});
    EXPECT_EQ(result.status, Status::converged);
    // On demand every point finds itself, and the truth is lowest up to rounding and the last step;
    // the octree's fits differ from the distances.
    const double limit = approximant == Approximant::on_demand ? 1e-4 : 0.02;
    EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).translation, limit);
  }
}

TEST(RegisterDistanceQuadrics, TellsAPlaneFromAPlace) {
  const PointCloud target = plane(10000, 12, 0.01, 1), source = plane(3000, 8, 0.01, 2);
  for (const Approximant approximant : both) {
    const RegistrationResult result =
        register_distance_quadrics(target, source, near_identity, {.approximant = approximant});
    EXPECT_EQ(result.status, Status::degenerate);
    EXPECT_TRUE(result.T_target_source.isApprox(near_identity, 0));
    EXPECT_EQ(result.directions.size(), 6u);
  }
}

TEST(RegisterDistanceQuadrics, TellsCloudsThatDoNotMeet) {
  const PointCloud cloud = bumpy_tunnel(2000, 1);
  const Pose away(Eigen::Translation3d(100, 0, 0));
  for (const Approximant approximant : both) {
    const RegistrationResult result =
        register_distance_quadrics(cloud, cloud, away, {.approximant = approximant});
    EXPECT_EQ(result.status, Status::no_overlap);
    EXPECT_TRUE(result.T_target_source.isApprox(away, 0));
    EXPECT_EQ(result.outside_points, 200u);
  }
}

}  // namespace
}  // namespace minescan
