// SPDX-License-Identifier: MIT
#include "registration/ndt_score.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "clouds.h"
#include "registration/newton.h"

namespace minescan {
namespace {

NdtCell random_cell(Random& random) {
  Eigen::Matrix3d root;
  for (int i = 0; i < 9; ++i) root(i) = random.normal();
  const Eigen::Matrix3d L = root * root.transpose();
  return {.mean = random_vector(random),
          .information = {L(0, 0), L(0, 1), L(0, 2), L(1, 1), L(1, 2), L(2, 2)}};
}

Vector6d unit_step(int parameter, double size) { return size * Vector6d::Unit(parameter); }

// A wrong sign or a missing term in the derivatives still converges now and then; this does not.
TEST(NdtScore, DerivativesMatchCentralDifferences) {
  for (std::uint64_t stream = 0; stream < 200; ++stream) {
    Random random(3, stream);
    const NdtCell cell = random_cell(random);
    const Pose T = random_pose(random, 1, 1);
    const Eigen::Vector3d point = T.inverse() * (cell.mean + 0.5 * random_vector(random));
    const auto at = [&](const Vector6d& step) { return ndt_score(cell, stepped(T, step), point); };

    // Truncation is h^2 times a higher derivative (of order 10^2 for these cells and levers),
    // rounding 1e-16 / h.
    const double h = 1e-5;
    const Score score = at(Vector6d::Zero());
    for (int i = 0; i < 6; ++i) {
      const Score plus = at(unit_step(i, h)), minus = at(unit_step(i, -h));
      EXPECT_NEAR(score.gradient[i], (plus.value - minus.value) / (2 * h), 1e-7)
          << "parameter " << i << " stream " << stream;
    }
    // Second derivatives of the value itself: derivatives of the gradient would be taken about
    // another pose each, whose increments do not commute.
    const double k = 1e-3;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        const auto value = [&](double a, double b) {
          return at(unit_step(i, a) + unit_step(j, b)).value;
        };
        const double difference =
            (value(k, k) - value(k, -k) - value(-k, k) + value(-k, -k)) / (4 * k * k);
        EXPECT_NEAR(score.hessian(i, j), difference, 2e-3 * (1 + score.hessian.norm()))
            << "parameters " << i << ", " << j << " stream " << stream;
      }
    }
  }
}

// As above where the scale is known, so that the tolerance can be sharp.
TEST(NdtScore, HessianMatchesCentralDifferencesOfTheValueSharply) {
  for (std::uint64_t stream = 0; stream < 50; ++stream) {
    Random random(4, stream);
    const NdtCell cell{.mean = {0.3, -0.2, 0.5}, .information = {1.5, 0.2, -0.3, 1.0, 0.1, 0.8}};
    const Pose T = random_pose(random, 0.3, 0.5);
    const Eigen::Vector3d point = T.inverse() * (cell.mean + 0.5 * random_vector(random));
    const double k = 1e-4;
    const Matrix6d hessian = ndt_score(cell, T, point).hessian;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        const auto value = [&](double a, double b) {
          return ndt_score(cell, stepped(T, unit_step(i, a) + unit_step(j, b)), point).value;
        };
        const double difference =
            (value(k, k) - value(k, -k) - value(-k, k) + value(-k, -k)) / (4 * k * k);
        // Fourth derivatives of order 10^2 times k^2 = 1e-6; rounding 4 * 1e-16 / (4 k^2) = 1e-8.
        EXPECT_NEAR(hessian(i, j), difference, 3e-6) << i << ", " << j << " stream " << stream;
      }
    }
  }
}

TEST(NdtScore, IsMinusOneAtTheMeanAndFlatThere) {
  Random random(5, 0);
  const NdtCell cell = random_cell(random);
  const Pose T = random_pose(random, 2, 2);
  const Score score = ndt_score(cell, T, T.inverse() * cell.mean);
  EXPECT_NEAR(score.value, -1, 1e-13);  // x' is zero but for rounding
  EXPECT_NEAR(score.gradient.norm(), 0, 1e-12);
}

TEST(NdtScore, FallsToTheRootOfEOneSigmaAlongEveryAxis) {
  Random random(6, 0);
  for (int trial = 0; trial < 20; ++trial) {
    const NdtCell cell = random_cell(random);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(information_matrix(cell));
    for (int i = 0; i < 3; ++i) {
      const double sigma = 1 / std::sqrt(axes.eigenvalues()[i]);
      const Eigen::Vector3d point = cell.mean + sigma * axes.eigenvectors().col(i);
      // The smallest of the eigenvalues is known to 1e-16 of the largest, 1e4 times larger at most.
      EXPECT_NEAR(ndt_score(cell, Pose::Identity(), point).value, -std::exp(-0.5), 1e-9);
    }
  }
}

TEST(NdtScore, SumIsThatOfItsTerms) {
  const PointCloud target = bumpy_tunnel(20000, 1);
  const PointCloud source = bumpy_tunnel(3000, 2);
  const NdtGrid grid(target.points, {});
  Random random(7, 0);
  for (int trial = 0; trial < 5; ++trial) {
    const Pose T = random_pose(random, 0.2, 0.1);
    Score plain;
    Matrix6d surface = Matrix6d::Zero();
    for (const Eigen::Vector3d& p : source.points) {
      const NdtCell* cell = grid.find(T * p);
      if (!cell) continue;
      const Score term = ndt_score(*cell, T, p);
      plain.value += term.value;
      plain.gradient += term.gradient;
      plain.hessian += term.hessian;
      ++plain.met;
      Vector6d h;
      const Eigen::Vector3d& n = grid.normal(*cell);
      h << n, (T.linear() * p).cross(n);
      surface -= term.value * h * h.transpose();
    }
    const Score sum = ndt_score(grid, T, source.points);
    EXPECT_GT(plain.met, 2000u);
    EXPECT_EQ(sum.met, plain.met);
    // Two orders of the same operations: rounding of 3000 terms.
    EXPECT_NEAR(sum.value, plain.value, 1e-10 * std::abs(plain.value));
    EXPECT_TRUE(sum.gradient.isApprox(plain.gradient, 1e-10));
    EXPECT_TRUE(sum.hessian.isApprox(plain.hessian, 1e-10));
    EXPECT_TRUE(sum.hessian.isApprox(sum.hessian.transpose(), 1e-14));
    EXPECT_EQ(sum.value, ndt_value(grid, T, source.points));
    EXPECT_TRUE(ndt_information(grid, T, source.points).surface.isApprox(surface, 1e-10));
  }
}

TEST(NdtScore, CountsPointsOnTheMeansAsOneEach) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  std::vector<Eigen::Vector3d> means;
  for (const NdtCell& cell : grid.cells()) means.push_back(cell.mean);
  const Score score = ndt_score(grid, Pose::Identity(), means);
  EXPECT_EQ(score.met, means.size());
  EXPECT_EQ(score.value, -static_cast<double>(means.size()));
  EXPECT_EQ(score.gradient.norm(), 0);
}

double smallest_of_largest(const Matrix6d& symmetric) {
  const Vector6d values = symmetric.selfadjointView<Eigen::Lower>().eigenvalues();
  return values[0] / values[5];
}

// The part that least squares knows of: positive semidefinite wherever it is taken.
TEST(NdtInformation, IsPositiveSemidefinite) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(1000, 2).points;
  Random random(8, 0);
  for (int trial = 0; trial < 5; ++trial) {
    const NdtInformation information = ndt_information(grid, random_pose(random, 1, 1), points);
    EXPECT_GE(smallest_of_largest(information.gauss_newton), -1e-12);
    EXPECT_GE(smallest_of_largest(information.surface), -1e-12);
  }
}

}  // namespace
}  // namespace minescan
