// SPDX-License-Identifier: MIT
// What a scanner sees from one place, or while it moves.
#pragma once

#include <cstdint>
#include <string>

#include "core/cloud.h"
#include "core/pose.h"
#include "sim/raycaster.h"
#include "sim/scanner.h"
#include "sim/trajectory.h"

namespace minescan {

/// How far a sub-ray may end off the plane that the beam's axis meets, metres, without the
/// footprint having an edge (assumed: a fifth of surface_gap).
inline constexpr double edge_tolerance = 0.02;

/// Scans from T_world_scanner, in which scanner and mine stand still. Beam i of the scan draws its
/// noise from stream i of `seed`, so the result does not depend on the number of threads. `scene`
/// is written into the result. `age` is how long the instrument has been on, seconds.
///
/// The beam goes where jitter, index error and the like turn it. true_range, true_point, incidence
/// and true_normal belong to the axis of that beam; where a return comes from other parts of the
/// footprint only, to the sub-ray of these that is nearest to the axis. The measured point is the
/// measured range along the nominal beam, for that is all an instrument knows. Points are rounded
/// to single precision as in files.
///
/// A footprint (sub_rays > 1) is sampled with sub-rays that spread from `spot` by `divergence`. Of
/// 19, 12 are only cast where one of the other 7 ends more than edge_tolerance off the plane of the
/// triangle on the axis; what then is missed (things so thin that none of the 7 meets them) is
/// there with edge_test switched off. A return is flagged as a mixed pixel if what its light met
/// has a gap of more than surface_gap along the beam and lies more than half of that off the plane
/// that the axis meets: at grazing incidence a smooth surface has the first, but not the second.
///
/// Relief comes in two parts. What the mesh shows is displacement: triangles that hide each other
/// and cast shadows. What is finer, where a material has `roughness` and `fine_slope`, is
/// statistical: one wave of gradient noise, anchored in the world and the same for all scans (their
/// seed does not matter), of RMS height `roughness` and mean-square wavelength 2 pi roughness /
/// fine_slope, so that its RMS slope along a line is `fine_slope`. Its height h where the beam
/// meets the triangle brings the surface nearer by h / cos(incidence), at most by fine_relief_reach
/// wavelengths; its slope tilts the normal, but never away from the scanner. So fine relief spreads
/// ranges and incidences as stone does, but hides nothing behind it, and it moves all of the
/// footprint that is of the axis' material by what it is on the axis. true_range, incidence and
/// true_normal include it.
///
/// throws  std::invalid_argument for a scanner that `check` refuses or a pose that is not finite
/// cost    README, Speed; 95 bytes per point
Scan scan(const RayCaster& caster, const Scanner& scanner, const Pose& T_world_scanner,
          std::uint64_t seed, const std::string& scene, double age = 0);

/// The same from a scanner on its way: the scan begins at time `start` of the path, and every beam
/// leaves from where the scanner is then. Measured points are where a scanner that stands still
/// would have them; true ones are in the frame of the scan, the scanner's at `start`.
///
/// throws  std::invalid_argument too if the path ends before the scan
Scan scan(const RayCaster& caster, const Scanner& scanner, const SmoothPath& T_world_scanner,
          double start, std::uint64_t seed, const std::string& scene);

}  // namespace minescan
