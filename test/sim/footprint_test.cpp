// SPDX-License-Identifier: MIT
#include "sim/footprint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace minescan {
namespace {

double radius(const SubRay& ray) { return std::hypot(ray.along, ray.across); }

TEST(Footprint, IsAHexagonalLattice) {
  const auto rays = sub_rays();
  EXPECT_EQ(radius(rays[0]), 0);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    double nearest = 10;
    for (std::size_t j = 0; j < rays.size(); ++j)
      if (i != j)
        nearest = std::min(
            nearest, std::hypot(rays[i].along - rays[j].along, rays[i].across - rays[j].across));
    EXPECT_NEAR(nearest, 0.5, 1e-12);
  }
  for (std::size_t k = 1; k < few_sub_rays; ++k) EXPECT_NEAR(radius(rays[k]), 1, 1e-12);
}

TEST(Footprint, WeightsAreTheGaussiansAndBothSetsSpreadTheSame) {
  double sum = 0, spread = 0;
  for (std::size_t k = 0; k < all_sub_rays; ++k) {
    sum += all_weights()[k];
    spread += all_weights()[k] * radius(sub_rays()[k]) * radius(sub_rays()[k]);
    EXPECT_NEAR(all_weights()[k] / all_weights()[0],
                std::exp(-2 * std::pow(radius(sub_rays()[k]), 2)), 1e-12);
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_NEAR(spread, 0.401, 1e-3);  // of the whole Gaussian: 1/2, here cut off at its radius
  double few_sum = 0, few_spread = 0;
  for (std::size_t k = 0; k < few_sub_rays; ++k) {
    few_sum += few_weights()[k];
    few_spread += few_weights()[k] * radius(sub_rays()[k]) * radius(sub_rays()[k]);
  }
  EXPECT_NEAR(few_sum, 1, 1e-12);
  EXPECT_NEAR(few_spread, spread, 1e-12);
}

}  // namespace
}  // namespace minescan
