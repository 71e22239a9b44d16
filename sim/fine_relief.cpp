// SPDX-License-Identifier: MIT
#include "sim/fine_relief.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "core/gradient_noise.h"
#include "core/random.h"

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

double FineRelief::apply(const Ray& ray, Hit& hit) const {
  const Vector3d place = ray.origin + hit.range * ray.direction;
  const NoiseSlope noise = gradient_noise_slope(to_lattice_ * place, seed_);
  // A surface seen edge-on moves by the reach, but not if its height is 0: no 0 / 0.
  const double shift =
      -std::clamp(height_ * noise.value / std::max(hit.cosine, 1e-9), -reach_, reach_);
  hit.range += shift;
  // The surface at height h(p) above the plane has the normal n - grad h, of the part of the
  // gradient in the plane.
  Vector3d slope = height_ * (to_lattice_.transpose() * noise.slope);
  slope -= slope.dot(hit.normal) * hit.normal;
  // A side that faces away would be hidden; seen is one that faces the scanner by a tenth of what
  // the triangle does (assumed).
  const double away = -slope.dot(ray.direction);
  if (away > 0.9 * hit.cosine) slope *= 0.9 * hit.cosine / away;
  hit.normal = (hit.normal - slope).normalized();
  hit.cosine = std::clamp(-hit.normal.dot(ray.direction), 0.0, 1.0);
  return shift;
}

}  // namespace minescan
