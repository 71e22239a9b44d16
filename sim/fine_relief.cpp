// SPDX-License-Identifier: MIT
#include "sim/fine_relief.h"

#include <Eigen/Geometry>
#include <cstddef>
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
  const Eigen::Matrix3d to_lattice =
      gradient_noise_wavelength / wavelength * turn.toRotationMatrix();
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l)
      noise_.to_lattice[k][l] =
          to_lattice(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
  noise_.height = material.roughness / gradient_noise_rms;
  noise_.reach = fine_relief_reach * wavelength;
  noise_.seed = derived_seed(0, "fine relief");  // the stone's, not the scan's
}

}  // namespace minescan
