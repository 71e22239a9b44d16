// SPDX-License-Identifier: MIT
// From a surface in the beam to a measured range: signal, noise, wrapping and wrong periods of the
// fine tone.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "core/random.h"
#include "sim/scanner.h"

namespace minescan {

/// Four standard normal numbers from one block of random bits (Box-Muller). Their uniforms have 32
/// bits, so none is beyond 6.8 sigma.
std::array<double, 4> four_normals(Random& random);

/// What a beam measured.
struct Echo {
  bool returned = false;
  double range = 0;  // metres, in [0, wrap_interval) if there is one
  float amplitude = 0;
  std::uint8_t flags = 0;  // of ScanFlag
};

/// The ranging part of a scanner, with what is the same for all beams computed once.
class Ranging {
 public:
  explicit Ranging(const Scanner& scanner);

  /// Measures a surface at `range`; `normals` are three independent standard normal numbers.
  Echo measure(double range, double reflectance, double cosine,
               const std::array<double, 3>& normals) const;

 private:
  Scanner scanner_;
  double phase_per_metre_ = 0;  // of the fine tone
  double tan_wrong_period_ =    // of the phase error from which the period is wrong
      std::numeric_limits<double>::infinity();
  double periods_per_radian_ = 0;  // of phase error of the coarse tone
};

}  // namespace minescan
