// SPDX-License-Identifier: MIT
#include "core/gradient_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"

namespace minescan {
namespace {

Eigen::Vector3d random_place(Random& random, double size) {
  const double x = random.uniform(), y = random.uniform(), z = random.uniform();
  return size * (Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(0.5));
}

TEST(GradientNoise, HasTheStatedMeanDeviationAndBounds) {
  Random random(1, 0);
  const int n = 400000;
  double sum = 0, squares = 0, slope_squares = 0;
  const double h = 1e-4;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d p = random_place(random, 1e4);
    const double value = gradient_noise(p, 5);
    const double slope = (gradient_noise(p + h * Eigen::Vector3d::UnitX(), 5) - value) / h;
    EXPECT_LE(std::abs(value), gradient_noise_max);
    EXPECT_LE(std::abs(slope), gradient_noise_steepest);
    sum += value;
    squares += value * value;
    slope_squares += slope * slope;
  }
  // Places in different cells are independent: the relative error of a variance is about
  // sqrt(2 / n) = 0.2 %, that of a deviation half of it; four times that.
  const double rms = std::sqrt(squares / n);
  EXPECT_NEAR(sum / n, 0, 4 * gradient_noise_rms / std::sqrt(n));
  EXPECT_NEAR(rms / gradient_noise_rms, 1, 0.005);
  const double frequency = std::sqrt(slope_squares / n) / rms / (2 * std::numbers::pi);
  EXPECT_NEAR(frequency * gradient_noise_wavelength, 1, 0.01);
}

TEST(GradientNoise, IsSmoothAcrossCells) {
  Random random(2, 0);
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3d p = random_place(random, 20);
    p[i % 3] = std::round(p[i % 3]);  // on a face of the lattice
    const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(i % 3);
    const double here = gradient_noise(p, 5);
    const double before = here - gradient_noise(p - step, 5);
    const double after = gradient_noise(p + step, 5) - here;
    // The fade has two continuous derivatives, so slopes differ by 1e-6 times a curvature of
    // order 10.
    EXPECT_NEAR(before, after, 1e-6 * 1e-4);
  }
}

TEST(GradientNoise, IsZeroAtTheCornersOfTheLattice) {
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d corner(i - 50, 3 * i - 7, -2 * i);
    EXPECT_EQ(gradient_noise(corner, 5), 0);
    // There the slope is the corner's own gradient, a unit vector.
    EXPECT_NEAR(gradient_noise_slope(corner, 5).slope.norm(), 1, 1e-14);
  }
}

TEST(GradientNoiseSlope, IsTheDerivativeOfTheNoise) {
  Random random(3, 0);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p = random_place(random, 200);
    const NoiseSlope noise = gradient_noise_slope(p, 5);
    // The same sums in another order.
    EXPECT_NEAR(noise.value, gradient_noise(p, 5), 1e-15);
    for (int axis = 0; axis < 3; ++axis) {
      const double h = 1e-5;
      const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(axis);
      const double difference =
          (gradient_noise(p + step, 5) - gradient_noise(p - step, 5)) / (2 * h);
      // Truncation is h^2 times a third derivative of order 100 (there are steps in it between
      // cells), rounding of the place 1e-14 / h.
      EXPECT_NEAR(noise.slope[axis], difference, 3e-8) << p.transpose();
    }
  }
}

TEST(GradientNoise, DiffersBetweenSeeds) {
  const Eigen::Vector3d p(0.3, 0.4, 0.7);
  EXPECT_EQ(gradient_noise(p, 5), gradient_noise(p, 5));
  EXPECT_NE(gradient_noise(p, 5), gradient_noise(p, 6));
}

TEST(LatticeHash, IsEvenAndTellsNeighboursApart) {
  const int edge = 40;
  const int n = edge * edge * edge;
  double sum = 0, squares = 0, products = 0;
  for (int i = 0; i < edge; ++i)
    for (int j = 0; j < edge; ++j)
      for (int k = 0; k < edge; ++k) {
        const double u = lattice_uniform(i - 20, j - 20, k - 20, 9);
        ASSERT_GE(u, 0);
        ASSERT_LT(u, 1);
        sum += u;
        squares += (u - 0.5) * (u - 0.5);
        for (const double v : {lattice_uniform(i - 19, j - 20, k - 20, 9),
                               lattice_uniform(i - 20, j - 19, k - 20, 9),
                               lattice_uniform(i - 20, j - 20, k - 19, 9),
                               lattice_uniform(i - 20, j - 20, k - 20, 10)})
          products += (u - 0.5) * (v - 0.5);
      }
  // Variances of u, (u - 1/2)^2 and of a product of two are 1/12, 1/180 and 1/144; four standard
  // errors.
  EXPECT_NEAR(sum / n, 0.5, 4 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(squares / n, 1.0 / 12, 4 * std::sqrt(1.0 / 180 / n));
  EXPECT_NEAR(products / (4.0 * n), 0, 4 * std::sqrt(1.0 / 144 / (4.0 * n)));
}

}  // namespace
}  // namespace minescan
