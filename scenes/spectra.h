// SPDX-License-Identifier: MIT
// The relief of a drift, measured on its mesh as a surveyor would: heights over the flat places of
// walls, ceiling and floor, and their power spectral densities. Rays are the caller's.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "core/cloud.h"
#include "scenes/mine.h"

namespace minescan {

/// How far the first surface is from a place along a unit vector, metres; NaN if there is none.
using RangeFinder =
    std::function<double(const Eigen::Vector3d& from, const Eigen::Vector3d& direction)>;
/// Makes one for a mesh.
using MakeRangeFinder = std::function<RangeFinder(TriangleMesh mesh)>;

/// Rock without any relief, to which a test adds one kind.
RockOptions flat_rock();

/// A straight drift along x, the floor at z = 0; metres.
struct StraightDrift {
  double from = 0;
  double to = 60;
  double width = 10;
  double height = 6;
};

/// Its mesh, of this rock.
TriangleMesh drift_mesh(const RockOptions& rock, const StraightDrift& drift, double edge_length,
                        std::uint64_t seed);

/// Walls, ceiling and floor of a drift as heights over their flat places, metres: into the rock,
/// but upwards for the floor.
class DriftSurvey {
 public:
  DriftSurvey(const StraightDrift& drift, RangeFinder range)
      : drift_(drift), range_(std::move(range)) {}

  double left(double x, double z) const { return range({x, 0, z}, {0, 1, 0}) - drift_.width / 2; }
  double right(double x, double z) const { return range({x, 0, z}, {0, -1, 0}) - drift_.width / 2; }
  double ceiling(double x, double y) const {
    return range({x, y, drift_.height / 2}, {0, 0, 1}) - drift_.height / 2;
  }
  double floor(double x, double y) const {
    return drift_.height / 2 - range({x, y, drift_.height / 2}, {0, 0, -1});
  }
  double range(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
    return range_(from, direction);
  }

 private:
  StraightDrift drift_;
  RangeFinder range_;
};

/// Mean one-sided power spectral density of profiles, each under a Hann window, which keeps the
/// strong long waves from leaking into the short ones.
class ProfileDensity {
 public:
  /// Profiles of `samples` heights that lie `step` metres apart.
  ProfileDensity(int samples, double step);

  /// `height` of the place this many metres along the profile.
  void add(const std::function<double(double along)>& height);

  /// Mean of density times frequency^power over a band around `frequency`, a half octave wide; NaN
  /// if the profiles are too short for it.
  ///
  /// Lines run along rows of the mesh's vertices, between which a mesh is straight: linear
  /// interpolation at spacing h multiplies a wave's amplitude by sinc^2(f h), which is undone here.
  /// Lines are sampled twice per edge so that the images beyond 1 / (2 h) do not fold back.
  double smoothed(double frequency, double edge, double power = 0) const;

  /// Slope of a straight line through the logarithms from one wavelength to another.
  double slope(double shortest, double longest, double edge) const;

 private:
  std::size_t n_;
  double step_;
  std::vector<std::complex<double>> turn_;
  std::vector<double> window_;
  std::vector<double> sum_;
  int lines_ = 0;
};

/// The row of a mesh's vertices next to a coordinate, metres (see lattice_point).
double vertex_row(double coordinate, double edge);

/// Densities along a drift.
struct DriftSpectra {
  ProfileDensity wall, ceiling, floor;
};

/// Along 60 m of drift of this rock for each of the seeds first ... first + count - 1.
DriftSpectra drift_spectra(const RockOptions& rock, double edge, std::uint64_t first,
                           std::uint64_t count, const MakeRangeFinder& range_finder);

}  // namespace minescan
