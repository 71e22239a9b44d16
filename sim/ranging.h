// SPDX-License-Identifier: MIT
// From the surfaces in a beam to measured ranges: what comes back, what the receiver makes of it,
// and how that fails.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/footprint.h"
#include "sim/scanner.h"
#include "sim/vector_math.h"

namespace minescan {

/// What one sub-ray of a beam met.
struct Facet {
  double weight = 1;  // share of the beam's light
  double range = 0;   // metres, above 0
  double signal = 0;  // reflectance * cos(incidence)
};

/// Most facets of a beam and tones of a scanner.
inline constexpr std::size_t max_facets = all_sub_rays;
inline constexpr std::size_t max_tones = 4;

/// The light of up to 16 beams on its way into the receiver.
struct Light {
  std::size_t beams = 0;
  std::array<std::size_t, lanes + 1> first = {};  // beam i has the facets first[i] ... first[i + 1]
  std::array<Facet, lanes * max_facets> facets;   // the first of each beam is nearest to its axis
  // Standard normal numbers: block b, number j of beam i is normals[b][j][i]. Number 3 of block 0
  // is left to others than the receiver.
  std::array<std::array<Lanes, 4>, 1 + max_tones / 2> normals = {};
  std::array<double, lanes> age = {};  // seconds since the instrument was switched on

  std::span<const Facet> of(std::size_t beam) const {
    return {facets.data() + first[beam], first[beam + 1] - first[beam]};
  }
};

/// One measured return.
struct Echo {
  double range = 0;  // metres, in [0, largest tone) if there are tones
  float amplitude = 0;
  std::uint8_t flags = 0;  // of ScanFlag
  std::uint8_t facet = 0;  // of the beam, the first one whose light made it
};

/// The returns of one beam, by range.
struct Echoes {
  std::size_t count = 0;
  std::array<Echo, max_returns> echo = {};
};

/// Surfaces that are farther apart than this along a beam, metres, are different ones to it: their
/// returns are mixed pixels (assumed: rock within a footprint is smoother).
inline constexpr double surface_gap = 0.1;

/// The ranging part of a scanner, with what is the same for all beams computed once.
///
/// Phase: each tone f sums the light of all facets as phasors,
///   Z_f = depth_f sum_i w_i A_i exp(2 pi j R_i / Lambda_f) + leakage + noise,
/// A_i = amplitude(). Its range is Lambda_f arg(Z_f) / (2 pi); the coarse tones tell the periods of
/// the finer ones. The noise of each component has the variance amplitude_noise^2 + s A, with s
/// such that the range noise far away is range_noise_growth R / sqrt(rho cos).
///
/// Pulse: facets that are nearer to each other than the pulse is long are one return at their mean,
/// unless one surface has the share `pulse_capture` of its light.
class Ranging {
 public:
  explicit Ranging(const Scanner& scanner);

  /// How many blocks of normal numbers `measure` reads, at least 1.
  std::size_t blocks() const { return blocks_; }

  /// Measures what each beam met; beams without facets have no return. `echoes` is as long as
  /// there are beams.
  void measure(const Light& light, std::span<Echoes> echoes) const;

 private:
  double bias(double age) const;
  void measure_phase(const Light& light, std::span<Echoes> echoes) const;
  Echoes measure_pulse(std::span<const Facet> facets, const std::array<float, max_returns>& normal,
                       double bias) const;
  // The return of a pulse with this much light from this range, unless it is too weak, too near or
  // too far.
  std::optional<Echo> pulse_echo(double range, double light, float normal, double bias) const;

  struct Tone {
    double interval = 1;  // metres
    double per_metre = 1;
    float depth = 1;
  };

  Scanner scanner_;
  std::vector<Tone> tones_ = {};
  std::size_t blocks_ = 1;
  double phase_steps_ = 1;  // per turn
  double phase_step_ = 1;
  float noise_floor_ = 0;   // variance of each component
  float noise_signal_ = 0;  // its growth per amplitude
};

/// Amplitude received from a surface, without noise; `signal` is its reflectance times the cosine
/// of the incidence.
double amplitude(const Scanner& scanner, double range, double signal);

}  // namespace minescan
