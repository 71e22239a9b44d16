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

#include "sim/scanner.h"

namespace minescan {

/// Standard normal numbers from one block of 128 random bits.
using FourNormals = std::array<float, 4>;

/// Block `block` of stream `stream` (Box-Muller). Their uniforms have 32 bits, so none is beyond
/// 6.8 sigma.
FourNormals four_normals(std::uint64_t seed, std::uint64_t stream, std::uint64_t block);

/// What one sub-ray of a beam met.
struct Facet {
  double weight = 1;  // share of the beam's light
  double range = 0;   // metres
  double signal = 0;  // reflectance * cos(incidence)
};

/// Most facets of a beam.
inline constexpr std::size_t max_facets = 19;

/// One measured return.
struct Echo {
  double range = 0;  // metres, in [0, largest tone) if there are tones
  float amplitude = 0;
  std::uint8_t flags = 0;  // of ScanFlag
  std::uint8_t facet = 0;  // the first one whose light made it
};

/// The returns of one beam, by range.
struct Echoes {
  std::array<Echo, max_returns> echo = {};
  std::size_t count = 0;
};

/// Surfaces that are farther apart than this along a beam, metres, are different ones to it: their
/// returns are mixed pixels (assumed: rock within a footprint is smoother).
inline constexpr double surface_gap = 0.1;

/// Most tones of a scanner.
inline constexpr std::size_t max_tones = 4;

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

  /// How many blocks of normal numbers `measure` reads, at least 1. Number 3 of block 0 is left to
  /// the caller.
  std::size_t blocks() const { return blocks_; }

  /// Measures what a beam met.
  ///
  /// facets  1 to max_facets; the first is on the axis of the beam
  /// normal  blocks() blocks of standard normal numbers
  /// age     seconds since the instrument was switched on
  Echoes measure(std::span<const Facet> facets, std::span<const FourNormals> normal,
                 double age) const;

 private:
  Echoes measure_phase(std::span<const Facet> facets, std::span<const FourNormals> normal,
                       double bias) const;
  Echoes measure_pulse(std::span<const Facet> facets, std::span<const FourNormals> normal,
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
  float noise_floor_ = 0;   // variance of each component
  float noise_signal_ = 0;  // its growth per amplitude
};

/// Amplitude received from a surface, without noise and fog; `signal` is its reflectance times the
/// cosine of the incidence.
double amplitude(const Scanner& scanner, double range, double signal);

}  // namespace minescan
