// SPDX-License-Identifier: MIT
// Rough rock: relief that looks alike at all scales, as broken rock does, and bedding steps. Both
// are functions of the place in the world, so that two scans of one wall see the same relief.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/fields.h"
#include "scenes/implicit.h"

namespace minescan {

/// Statistics of a relief. A profile along a line has a power spectral density ~ k^-(1 + 2 H)
/// between the wavelengths `inner` and `outer`, where the Hurst exponent H is `hurst` for waves
/// longer than `fine_below` and `fine_hurst` for shorter ones.
struct ReliefBand {
  double rms = 0.07;    // metres, of all wavelengths in the band together
  double hurst = 0.75;  // in (0, 1]
  double inner = 0.05;  // shortest wavelength, metres
  double outer = 10;    // longest wavelength, metres
  double fine_hurst = 0.75;
  double fine_below = 0;  // metres; 0: one exponent for all
};

template <class Visitor>
void fields(ReliefBand& o, Visitor&& field) {
  const Range hurst = above_up_to(0, 1);
  const Range wavelength = between(0.005, 100);
  field("rms", o.rms, between(0, 0.5), "m", "relief, RMS of all its wavelengths");
  field("hurst", o.hurst, hurst, "", "Hurst exponent of its longer waves");
  field("fine-hurst", o.fine_hurst, hurst, "", "and of the shorter ones");
  field("fine-below", o.fine_below, between(0, 100), "m", "where these begin; 0: nowhere");
  field("inner", o.inner, wavelength, "m", "shortest wavelength");
  field("outer", o.outer, wavelength, "m", "longest wavelength");
}

/// What a mesh does not show of a relief.
struct FineRelief {
  double height = 0;  // metres, RMS
  double slope = 0;   // RMS along a line
};

/// Height of a self-affine relief: a sum of octaves of gradient noise (Perlin 1985, 2002;
/// fractional Brownian motion after Musgrave, in Ebert et al., Texturing and Modeling, 2003).
class Relief {
 public:
  /// Octaves of wavelengths below `finest` are left out (a mesh cannot show them); those that stay
  /// do not depend on it. Throws std::invalid_argument if the band is empty.
  Relief(const ReliefBand& band, std::uint64_t seed, double finest);

  /// Encloses the heights within `radius` of a place; the height itself for radius 0.
  Interval range(const Eigen::Vector3d& place, double radius) const;
  double at(const Eigen::Vector3d& place) const { return range(place, 0).low; }
  /// No height is larger than this, nor smaller than its negative.
  double bound() const { return bound_; }
  /// The octaves that were left out.
  const FineRelief& left_out() const { return left_out_; }

 private:
  struct Octave {
    Eigen::Matrix3d to_lattice = Eigen::Matrix3d::Identity();
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    double spacing = 1;  // of the noise lattice, metres
    double amplitude = 0;
    std::uint64_t seed = 0;
  };
  std::vector<Octave> octaves_;  // longest wavelength first
  double bound_ = 0;
  FineRelief left_out_ = {};
};

/// Classes of road roughness (ISO 8608): A is a good motorway, D and E are gravel roads. `none` is
/// flat.
enum class RoadClass { none, A, B, C, D, E, F, G, H };
constexpr auto names_of(RoadClass) {
  return std::to_array<std::string_view>({"none", "A", "B", "C", "D", "E", "F", "G", "H"});
}

/// The middle of a class: G_d(n0) at n0 = 0.1 cycles per metre, m^3. Its borders lie a factor 2 to
/// either side.
double road_density(RoadClass road);

/// The relief of a road whose vertical displacement along any line has the density
/// G_d(n) = G_d(n0) (n / n0)^-2 between the two wavelengths.
ReliefBand road_relief(RoadClass road, double inner, double outer);

/// Where a layered roof has come down to a higher bedding plane, plate by plate: the height is
/// 0, 1 or 2 steps, the same over each plate (a Voronoi cell in the xy-plane).
class Bedding {
 public:
  /// `plate` is the mean distance between plates' centres, metres.
  Bedding(double step, double plate, std::uint64_t seed);

  Interval range(const Eigen::Vector3d& place, double radius) const;
  double bound() const { return 2 * step_; }

 private:
  double step_ = 0;
  double plate_ = 1;
  std::uint64_t seed_ = 0;
};

/// Stones that lie on a floor: a height above it, in plan.
class LooseRocks {
 public:
  /// `per_area` stones per square metre, at most 1; the largest is `size` metres across, the
  /// smallest a third of it. Those narrower than `finest` are left out.
  LooseRocks(double per_area, double size, std::uint64_t seed, double finest);

  Interval range(const Eigen::Vector3d& place, double radius) const;
  double bound() const { return size_ / 2; }

 private:
  struct Stone {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    double radius = 0;  // 0: none here
    double height = 0;
  };
  Stone stone_in(std::int64_t i, std::int64_t j) const;

  double per_area_ = 0;
  double size_ = 0;
  std::uint64_t seed_ = 0;
  double finest_ = 0;
};

/// The level that a standard normal variable exceeds with probability `share` in (0, 1).
double normal_upper_quantile(double share);

}  // namespace minescan
