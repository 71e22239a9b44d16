// SPDX-License-Identifier: MIT
#include "sim/footprint.h"

#include <cmath>
#include <numbers>

namespace minescan {
namespace {

std::array<SubRay, all_sub_rays> make_sub_rays() {
  std::array<SubRay, all_sub_rays> list = {};
  std::size_t k = 1;
  const auto add_ring = [&](double radius, double first) {
    for (int i = 0; i < 6; ++i) {
      const double angle = first + i * std::numbers::pi / 3;
      list[k++] = {radius * std::cos(angle), radius * std::sin(angle)};
    }
  };
  // The three shells of a hexagonal lattice with the spacing 1/2.
  add_ring(1, 0);
  add_ring(0.5, 0);
  add_ring(std::sqrt(0.75), std::numbers::pi / 6);
  return list;
}

double distance_squared(const SubRay& ray) {
  return ray.along * ray.along + ray.across * ray.across;
}

std::array<double, all_sub_rays> make_all_weights() {
  std::array<double, all_sub_rays> weights = {};
  double sum = 0;
  for (std::size_t k = 0; k < all_sub_rays; ++k)
    sum += weights[k] = std::exp(-2 * distance_squared(sub_rays()[k]));
  for (double& w : weights) w /= sum;
  return weights;
}

std::array<double, few_sub_rays> make_few_weights() {
  double spread = 0;
  for (std::size_t k = 0; k < all_sub_rays; ++k)
    spread += all_weights()[k] * distance_squared(sub_rays()[k]);
  std::array<double, few_sub_rays> weights = {};
  weights.fill(spread / 6);
  weights[0] = 1 - spread;
  return weights;
}

}  // namespace

std::span<const SubRay, all_sub_rays> sub_rays() {
  static const std::array<SubRay, all_sub_rays> list = make_sub_rays();
  return list;
}

std::span<const double, all_sub_rays> all_weights() {
  static const std::array<double, all_sub_rays> weights = make_all_weights();
  return weights;
}

std::span<const double, few_sub_rays> few_weights() {
  static const std::array<double, few_sub_rays> weights = make_few_weights();
  return weights;
}

}  // namespace minescan
