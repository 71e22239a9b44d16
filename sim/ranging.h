// SPDX-License-Identifier: MIT
// From the surfaces in a beam to measured ranges: what comes back, what the receiver makes of it,
// and how that fails.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "sim/light.h"
#include "sim/phase_receiver.h"
#include "sim/scanner.h"

namespace minescan {

/// One measured return.
struct Echo {
  double range = 0;  // metres, in [0, largest tone) if there are tones
  float amplitude = 0;
  std::uint8_t flags = 0;    // of ScanFlag
  std::uint8_t sub_ray = 0;  // of the beam, the first one whose light made it
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
/// Phase: each tone f sums the light of all sub-rays as phasors,
///   Z_f = depth_f sum_i w_i A_i exp(2 pi j R_i / Lambda_f) + leakage + noise,
/// A_i = amplitude(). Its range is Lambda_f arg(Z_f) / (2 pi); the coarse tones tell the periods of
/// the finer ones. The noise of each component has the variance amplitude_noise^2 + s A, with s
/// such that the range noise far away is range_noise_growth R / sqrt(rho cos).
///
/// Pulse: parts that are nearer to each other than the pulse is long are one return at their mean,
/// unless one surface has the share `pulse_capture` of its light.
class Ranging {
 public:
  explicit Ranging(const Scanner& scanner);

  /// How many blocks of normal numbers `measure` reads, at least 1.
  std::size_t blocks() const { return phase_ ? phase_->blocks() : 1; }

  /// Measures what each beam met; beams that bring no light back have no return. `echoes` is as
  /// long as there are beams, at most 16.
  void measure(const Light& light, std::span<Echoes> echoes) const;

 private:
  void measure_phase(const Light& light, std::span<Echoes> echoes) const;
  Echoes measure_pulse(const Light& light, std::size_t beam) const;
  // The return of a pulse with this much light from this range, unless it is too weak, too near or
  // too far.
  std::optional<Echo> pulse_echo(double range, double light, float normal, double bias) const;

  Scanner scanner_;
  std::optional<PhaseReceiver> phase_ = {};
};

/// Amplitude received from a surface, without noise; `signal` is its reflectance times the cosine
/// of the incidence.
double amplitude(const Scanner& scanner, double range, double signal);

}  // namespace minescan
