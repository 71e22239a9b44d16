// SPDX-License-Identifier: MIT
#include "registration/planar_ndt.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "clouds.h"

namespace minescan {
namespace {

Pose turned_about_z(double angle, const Eigen::Vector3d& t) {
  return Pose(Eigen::Translation3d(t) * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
}

Eigen::Isometry2d in_plan(double x, double y, double phi) {
  return Eigen::Isometry2d(Eigen::Translation2d(x, y) * Eigen::Rotation2Dd(phi));
}

const Pose start_error = turned_about_z(0.05, {0.2, -0.15, 0});
const PlanarNdtOptions slices{.slice_height = 0.5};

/// Two walls, and floor and roof if not `open`; 60 m of them, all alike.
PointCloud corridor(std::size_t count, double noise, bool open, std::uint64_t seed) {
  PointCloud cloud;
  Random random(seed, 0);
  while (cloud.points.size() < count) {
    const double x = 60 * (random.uniform() - 0.5), around = (open ? 8 : 18) * random.uniform();
    const double n = noise * random.normal();
    if (around < 4)
      cloud.points.push_back({x, 2.5 + n, around - 1.5});
    else if (around < 8)
      cloud.points.push_back({x, -2.5 + n, around - 4 - 1.5});
    else if (around < 13)
      cloud.points.push_back({x, around - 8 - 2.5, -1.5 + n});
    else
      cloud.points.push_back({x, around - 13 - 2.5, 2.5 + n});
  }
  return cloud;
}

CellSums sums_of(const std::vector<Eigen::Vector3d>& points) {
  CellSums sums;
  for (const Eigen::Vector3d& p : points) sums.add(p);
  return sums;
}

TEST(PlanarCell, IsTheDistributionInPlan) {
  // Variances 2/3 and 2/300 along (3, 4)/5 and across, of four points; z is of no account.
  const Eigen::Vector3d u(0.6, 0.8, 7), v(-0.08, 0.06, -3), corner(5, -3, 2);
  const std::optional<PlanarCell> cell = fit_planar_cell(sums_of({u, -u, v, -v}), corner, {});
  ASSERT_TRUE(cell);
  EXPECT_LT((cell->mean - Eigen::Vector2d(5, -3)).norm(), 1e-15);
  Eigen::Matrix2d R;
  R << 0.6, -0.8, 0.8, 0.6;
  const Eigen::Matrix2d C = R * Eigen::Vector2d(2.0 / 3, 0.02 / 3).asDiagonal() * R.transpose();
  EXPECT_LT((cell->information * C - Eigen::Matrix2d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(std::abs(cell->normal.dot(Eigen::Vector2d(-0.8, 0.6))), 1, 1e-14);
}

TEST(PlanarCell, RaisesOnlyTheSmallerEigenvalue) {
  const std::vector<Eigen::Vector3d> line = {{0.1, 0.2, 0}, {0.5, 0.2, 1}, {0.9, 0.2, 2}};
  const std::optional<PlanarCell> cell = fit_planar_cell(sums_of(line), {0, 0, 0}, {});
  ASSERT_TRUE(cell);
  EXPECT_NEAR(cell->information(0, 0), 1 / 0.16, 1e-9);  // the variance of 0.1, 0.5, 0.9 is 0.16
  EXPECT_NEAR(cell->information(1, 1), 1000 / 0.16, 1e-6);
}

TEST(PlanarCell, NeedsThreePointsThatAreNotAboveEachOther) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  EXPECT_FALSE(fit_planar_cell(sums_of({{0, 0, 0}, {1, 0, 0}}), zero, {}));
  EXPECT_FALSE(
      fit_planar_cell(sums_of({{0.3, 0.7, 0}, {0.3, 0.7, 0.4}, {0.3, 0.7, 0.9}}), zero, {}));
}

// The probability of a thinner sample, counted: 20 000 draws have a standard deviation below 0.004.
TEST(PlanarCell, IsNoWallWhereChanceMakesAsThinOnes) {
  EXPECT_EQ(wall_likeness(1, 100), 0);
  EXPECT_EQ(wall_likeness(0.1, 1000), 0);
  EXPECT_EQ(wall_likeness(0, 3), 1);
  EXPECT_NEAR(wall_likeness(0.05, 1000), 0.5, 1e-15);
  Random random(1, 0);
  const int draws = 20000, count = 5;
  // V^(5 - 2) = 0.001 at V = 0.1, that is, thickness t with 2 sqrt(t) = 0.1 (1 + t).
  const double t = std::pow((1 - std::sqrt(1 - 0.01)) / 0.1, 2);
  EXPECT_EQ(wall_likeness(1.001 * t, count), 0);
  EXPECT_GT(wall_likeness(0.999 * t, count), 0.9);
  int thinner = 0;
  for (int draw = 0; draw < draws; ++draw) {
    Eigen::Matrix<double, 2, count> X;
    for (int i = 0; i < count; ++i) X.col(i) << random.normal(), random.normal();
    X.colwise() -= X.rowwise().mean().eval();
    const Eigen::Matrix2d C = X * X.transpose();
    // V = 0.5, where the probability is 1/8.
    thinner += 2 * std::sqrt(C.determinant()) < 0.5 * C.trace();
  }
  EXPECT_NEAR(static_cast<double>(thinner) / draws, 0.125, 0.01);
}

TEST(PlanarScore, DerivativesAreThoseOfTheValue) {
  Random random(3, 0);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::Matrix2d A;
    A << random.normal(), random.normal(), random.normal(), random.normal();
    const Eigen::Matrix2d L = A * A.transpose() + 0.1 * Eigen::Matrix2d::Identity();
    const PlanarCell cell{.mean = {random.normal(), random.normal()}, .information = L};
    const Eigen::Vector3d pose(random.normal(), random.normal(), 3 * random.normal());
    const Eigen::Vector2d near =
        cell.mean + 0.3 * Eigen::Vector2d(random.normal(), random.normal());
    const Eigen::Vector2d point = in_plan(pose[0], pose[1], pose[2]).inverse() * near;
    const auto at = [&](const Eigen::Vector3d& p) {
      return planar_score(cell, in_plan(p[0], p[1], p[2]), point);
    };
    const PlanarScore score = at(pose);
    EXPECT_EQ(score.met, 1u);
    const double h = 1e-5;  // errors of h^2 and 1e-16 / h, times derivatives of up to some 100
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(i);
      const PlanarScore more = at(pose + d), less = at(pose - d);
      EXPECT_NEAR(score.gradient[i], (more.value - less.value) / (2 * h), 1e-7);
      const Eigen::Vector3d column = (more.gradient - less.gradient) / (2 * h);
      EXPECT_LT((score.hessian.col(i) - column).norm(), 1e-6);
    }
    // Without the curvature: J^T L J times the density.
    const PlanarScore gauss =
        planar_score(cell, in_plan(pose[0], pose[1], pose[2]), point, Curvature::gauss_newton);
    const Eigen::Vector2d y = Eigen::Rotation2Dd(pose[2]) * point;
    Eigen::Matrix<double, 2, 3> J;
    J << 1, 0, -y.y(), 0, 1, y.x();
    EXPECT_LT((gauss.hessian + score.value * J.transpose() * L * J).norm(),
              1e-12 * (1 + gauss.hessian.norm()));
  }
}

// Cells by a map and sums by two passes, for all four shifts and all slices.
TEST(PlanarScore, OfFourLatticesIsTheSumByHand) {
  const double size = 0.8;
  const std::vector<Eigen::Vector3d> target = bumpy_tunnel(3000, 1).points,
                                     source = bumpy_tunnel(300, 2).points;
  const auto layered = [&](std::vector<Eigen::Vector3d> points) {
    for (Eigen::Vector3d& p : points) p.z() = (std::floor(p.z() / 0.5) + 0.5) * size;
    return points;
  };
  const Eigen::Isometry2d T = in_plan(0.1, -0.05, 0.03);
  double expected = 0;
  std::size_t bytes = 0;
  for (const auto& [dx, dy] : {std::array{0.0, 0.0}, {0.5, 0.0}, {0.0, 0.5}, {0.5, 0.5}}) {
    const auto cell_of = [&, x0 = dx, y0 = dy](const Eigen::Vector2d& p, double z) {
      return std::array{static_cast<int>(std::floor(p.x() / size - x0)),
                        static_cast<int>(std::floor(p.y() / size - y0)),
                        static_cast<int>(std::floor(z / 0.5))};
    };
    std::map<std::array<int, 3>, std::vector<Eigen::Vector2d>> cells;
    for (const Eigen::Vector3d& p : target)
      cells[cell_of(p.head<2>(), p.z())].push_back(p.head<2>());
    for (const Eigen::Vector3d& p : source) {
      const Eigen::Vector2d moved = T * Eigen::Vector2d(p.head<2>());
      const std::vector<Eigen::Vector2d>& in_cell = cells[cell_of(moved, p.z())];
      if (in_cell.size() < 3) continue;
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      for (const Eigen::Vector2d& q : in_cell) mean += q / static_cast<double>(in_cell.size());
      Eigen::Matrix2d C = Eigen::Matrix2d::Zero();
      for (const Eigen::Vector2d& q : in_cell)
        C += (q - mean) * (q - mean).transpose() / static_cast<double>(in_cell.size() - 1);
      // The smaller eigenvalue, raised.
      const double half_trace = C.trace() / 2;
      const double root = std::sqrt(std::max(0.0, half_trace * half_trace - C.determinant()));
      const double high = half_trace + root, low = half_trace - root;
      const double least = std::max(low, high / 1000);
      const Eigen::Matrix2d across =
          (high * Eigen::Matrix2d::Identity() - C) / (high - low);  // projects on the thin side
      C += (least - low) * across;
      expected -= std::exp(-(moved - mean).dot(C.inverse() * (moved - mean)) / 2);
    }
    bytes += cells.size();
  }
  const std::vector<PlanarGrid> grids = planar_grids(layered(target), {.cell_size = size});
  ASSERT_EQ(grids.size(), 4u);
  // Rounding in inverses of covariances whose eigenvalues differ by up to 1000.
  EXPECT_NEAR(planar_score(grids, T, layered(source)).value, expected, 1e-8);
  EXPECT_LT(expected, -50);
}

TEST(RegisterPlanarNdt, FindsTheTrueMotionInPlan) {
  const PointCloud target = bumpy_tunnel(30000, 1);
  for (std::uint64_t stream = 0; stream < 3; ++stream) {
    Random random(1, stream);
    const Eigen::Vector3d t = 2 * random_vector(random);
    const Pose truth = turned_about_z(3 * random.uniform(), t);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(20000, 2 + stream));
    for (const bool overlap : {true, false}) {
      for (const double height : {0.0, 0.5}) {
        // One lattice without slices does not find the way from as far as the others.
        const bool near = !overlap && height == 0;
        const Pose error = near ? turned_about_z(0.01, {0.06, -0.05, 0}) : start_error;
        const RegistrationResult result = register_planar_ndt(
            target, source, error * truth, {.overlap = overlap, .slice_height = height});
        EXPECT_EQ(result.status, Status::converged);
        // Seen from above, relief makes walls thick: the bias is that of 3D-NDT or several times
        // that, which slices avoid.
        const PoseError left = pose_error(truth, result.T_target_source);
        EXPECT_LT(left.translation, height > 0 ? 0.01 : 0.05) << overlap;
        EXPECT_LT(left.rotation, height > 0 ? 0.001 : 0.002) << overlap;
        EXPECT_EQ(result.used_points, 2000u);
        EXPECT_LT(result.score, 0);
        EXPECT_GT(result.target_bytes, 0u);
        EXPECT_EQ(result.directions.size(), 3u);
      }
    }
  }
}

TEST(RegisterPlanarNdt, LeavesHeightRollAndPitchAsGuessed) {
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(10000, 2);
  const Pose tilt(Eigen::Translation3d(0, 0, 0.04) *
                  Eigen::AngleAxisd(0.01, Eigen::Vector3d(1, -2, 0).normalized()));
  const Pose guess = start_error * tilt;
  for (const Optimiser optimiser :
       {Optimiser::newton, Optimiser::gauss_newton, Optimiser::levenberg_marquardt}) {
    PlanarNdtOptions options = slices;
    options.search.optimiser = optimiser;
    const RegistrationResult result = register_planar_ndt(target, source, guess, options);
    const Pose& found = result.T_target_source;
    EXPECT_EQ(result.status, Status::converged);
    EXPECT_LT(found.translation().head<2>().norm(), 0.03);  // it has moved
    EXPECT_EQ(found.translation().z(), guess.translation().z());
    // Which direction of the source is up in the target: a few roundings.
    EXPECT_LT((found.linear().row(2) - guess.linear().row(2)).norm(), 1e-14);
    EXPECT_LT((found.linear() * found.linear().transpose() - Eigen::Matrix3d::Identity()).norm(),
              1e-14);
    for (const int i : {2, 3, 4}) {
      EXPECT_EQ(result.covariance.row(i).norm() + result.covariance.col(i).norm(), 0);
      for (const Direction& direction : result.directions) EXPECT_EQ(direction.step[i], 0);
    }
  }
}

// Points at range r rise by r alpha: of the ends, 12 m away, by 0.36 m and out of slices of 0.5 m.
TEST(RegisterPlanarNdt, ATiltPutsPointsIntoOtherSlices) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const auto error_at = [&](double alpha, double height) {
    const Pose tilt(Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitY()));
    const RegistrationResult result =
        register_planar_ndt(target, source, start_error * tilt, {.slice_height = height});
    EXPECT_EQ(result.status, Status::converged);
    return pose_error(tilt, result.T_target_source).translation;
  };
  EXPECT_LT(error_at(0, 0.5), 0.01);
  EXPECT_LT(error_at(0.01, 0.5), 0.05);  // 0.12 m: most points stay
  EXPECT_GT(error_at(0.03, 0.5), 0.2);   // 0.3 m were measured, no nearer than the start
  EXPECT_LT(error_at(0.03, 0), 0.05);    // one slice loses none
}

TEST(RegisterPlanarNdt, UsesOnlyTheBand) {
  const PointCloud target = bumpy_tunnel(30000, 1);
  PointCloud source = bumpy_tunnel(20000, 2), low, high;
  for (const Eigen::Vector3d& p : target.points) (p.z() < 0.5 ? low : high).points.push_back(p);
  PlanarNdtOptions band{.band_height = 1, .band_middle = 1, .sampling = {.ratio = 1}};
  const RegistrationResult all = register_planar_ndt(target, source, start_error, band),
                           part = register_planar_ndt(high, source, start_error, band);
  EXPECT_EQ(all.status, Status::converged);
  EXPECT_TRUE(all.T_target_source.isApprox(part.T_target_source, 0));
  std::size_t count = 0;
  for (const Eigen::Vector3d& p : source.points) count += p.z() >= 0.5 && p.z() <= 1.5;
  EXPECT_EQ(all.used_points, count);
  EXPECT_EQ(register_planar_ndt(low, source, start_error, band).status, Status::no_overlap);
  band.band_middle = 50;
  const RegistrationResult none = register_planar_ndt(target, source, start_error, band);
  EXPECT_EQ(none.status, Status::no_overlap);
  EXPECT_EQ(none.used_points, 0u);
  EXPECT_TRUE(none.T_target_source.isApprox(start_error, 0));
}

// 1500 m above the sea: both clouds are moved near their origins before anything is done. 0.3 m do
// not divide the stride of that.
TEST(RegisterPlanarNdt, SlicesAndBandStayWhereTheyAreFarFromTheOrigin) {
  const Pose high(Eigen::Translation3d(0, 0, 1500));  // a whole number of slices
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(10000, 2);
  PlanarNdtOptions options{.slice_height = 0.3, .band_height = 2, .band_middle = 0.6};
  const RegistrationResult here = register_planar_ndt(target, source, start_error, options);
  options.band_middle += 1500;
  const RegistrationResult there =
      register_planar_ndt(transformed(high, target), source, high * start_error, options);
  EXPECT_EQ(here.status, Status::converged);
  EXPECT_EQ(there.used_points, here.used_points);
  // Coordinates of 1500 m are rounded by 1e-13; up to the convergence limit if one point changes
  // its slice by that.
  const PoseError error = pose_error(high * here.T_target_source, there.T_target_source);
  EXPECT_LT(error.translation, 1e-9);
  EXPECT_LT(error.rotation, 1e-9);
}

TEST(RegisterPlanarNdt, SaysThatACorridorIsFreeAlong) {
  for (const bool open : {true, false}) {
    for (const double height : {0.0, 0.5}) {
      const RegistrationResult result =
          register_planar_ndt(corridor(30000, 0.01, open, 1), corridor(30000, 0.01, open, 2),
                              start_error, {.slice_height = height});
      EXPECT_EQ(result.status, Status::degenerate);
      EXPECT_TRUE(result.T_target_source.isApprox(start_error, 0));
      ASSERT_EQ(result.directions.size(), 3u);
      EXPECT_GT(std::abs(result.directions[0].step[0]), 0.99);  // along x
      EXPECT_LT(result.directions[0].hold, 1e-3);
      EXPECT_GT(result.directions[1].hold, 0.1);
      EXPECT_EQ(result.covariance.norm(), 0);
    }
  }
}

TEST(RegisterPlanarNdt, SaysThatAFloorHoldsNothing) {
  for (const double noise : {0.0, 0.01})
    for (const double height : {0.0, 0.5})
      EXPECT_EQ(register_planar_ndt(plane(20000, 20, noise, 1), plane(20000, 20, noise, 2),
                                    start_error, {.slice_height = height})
                    .status,
                Status::degenerate);
}

TEST(RegisterPlanarNdt, SaysThatScansDoNotOverlap) {
  const PointCloud target = bumpy_tunnel(10000, 1), source = bumpy_tunnel(10000, 2);
  const Pose aside(Eigen::Translation3d(0, 500, 0)), above(Eigen::Translation3d(0, 0, 10));
  for (const PlanarNdtOptions& options : {PlanarNdtOptions{}, slices}) {
    const RegistrationResult result = register_planar_ndt(target, source, aside, options);
    EXPECT_EQ(result.status, Status::no_overlap);
    EXPECT_TRUE(result.T_target_source.isApprox(aside, 0));
    EXPECT_EQ(result.outside_points, 1000u);
  }
  EXPECT_EQ(register_planar_ndt(target, source, above, slices).status, Status::no_overlap);
  // Seen from above, they do.
  EXPECT_EQ(register_planar_ndt(target, source, above).status, Status::converged);
}

TEST(RegisterPlanarNdt, CovarianceIsLargestAlongTheTunnel) {
  const RegistrationResult result =
      register_planar_ndt(bumpy_tunnel(30000, 1), bumpy_tunnel(20000, 2), start_error, slices);
  EXPECT_GT(result.covariance(0, 0), 2 * result.covariance(1, 1));
  EXPECT_GT(result.covariance(5, 5), 0);
  EXPECT_TRUE(result.covariance.isApprox(result.covariance.transpose(), 1e-9));
}

TEST(RegisterPlanarNdt, RefusesEmptyCloudsAndBadOptions) {
  const PointCloud cloud = bumpy_tunnel(100, 1);
  const Pose T = Pose::Identity();
  EXPECT_THROW(register_planar_ndt({}, cloud, T), std::invalid_argument);
  EXPECT_THROW(register_planar_ndt(cloud, {}, T), std::invalid_argument);
  const auto run = [&](const PlanarNdtOptions& options) {
    register_planar_ndt(cloud, cloud, T, options);
  };
  EXPECT_THROW(run({.cell_size = 0}), std::invalid_argument);
  EXPECT_THROW(run({.min_cell_points = 2}), std::invalid_argument);
  EXPECT_THROW(run({.slice_height = -1}), std::invalid_argument);
  EXPECT_THROW(run({.slice_height = 1e-9}), std::invalid_argument);  // indices
  EXPECT_THROW(run({.band_height = std::nan("")}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
