// SPDX-License-Identifier: MIT
#include "sim/fine_relief.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cstddef>
#include <numbers>

#include "core/gradient_noise.h"
#include "core/random.h"
#include "sim/vector_math.h"

namespace minescan {

using Eigen::Vector3d;

FineRelief::FineRelief(const Material& material) {
  if (!(material.roughness > 0 && material.fine_slope > 0)) return;
  const double wavelength = 2 * std::numbers::pi * material.roughness / material.fine_slope;
  // On a plane of the lattice noise has another height than elsewhere; walls and floors are
  // parallel to the axes of the world, so the lattice is not.
  const Eigen::AngleAxisd turn(1, Vector3d(1, 2, 3).normalized());
  to_lattice_ = gradient_noise_wavelength / wavelength * turn.toRotationMatrix();
  height_ = material.roughness / gradient_noise_rms;
  reach_ = fine_relief_reach * wavelength;
  seed_ = derived_seed(0, "fine relief");  // the stone's, not the scan's
}

void FineRelief::apply(std::span<const Ray> rays, std::span<const std::uint8_t> chosen,
                       std::span<Hit> hits, std::span<double> shifts) const {
  assert(!chosen.empty() && chosen.size() <= lanes);
  ReliefHits lanes_of;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l)
      lanes_of.to_lattice[k][l] =
          to_lattice_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
  lanes_of.height = height_;
  lanes_of.reach = reach_;
  lanes_of.seed = seed_;
  // Lanes without a hit repeat the last one, so that they hold numbers.
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::uint8_t from = chosen[std::min(i, chosen.size() - 1)];
    const Ray& ray = rays[from];
    const Hit& hit = hits[from];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      lanes_of.place[k][i] = ray.origin[axis] + hit.range * ray.direction[axis];
      lanes_of.direction[k][i] = ray.direction[axis];
      lanes_of.normal[k][i] = hit.normal[axis];
    }
    lanes_of.cosine[i] = hit.cosine;
  }
  apply_relief(lanes_of);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    Hit& hit = hits[chosen[i]];
    hit.range += lanes_of.shift[i];
    hit.cosine = lanes_of.cosine[i];
    hit.normal = {lanes_of.normal[0][i], lanes_of.normal[1][i], lanes_of.normal[2][i]};
    shifts[chosen[i]] = lanes_of.shift[i];
  }
}

}  // namespace minescan
