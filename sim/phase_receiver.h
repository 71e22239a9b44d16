// SPDX-License-Identifier: MIT
// The receiver of a phase-shift scanner, 16 beams at a time; what it does is told at Ranging.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/light.h"
#include "sim/scanner.h"
#include "sim/vector_math.h"

namespace minescan {

/// What it reads of 16 beams; without meaning for beams from which no light comes.
struct PhaseReadings {
  DoubleLanes range;      // metres, in [0, largest tone)
  Lanes amplitude;        // NaN where a surface is seen exactly edge-on
  DoubleLanes strongest;  // metres, true range of the sub-ray that brings most light
  std::array<bool, lanes> saturated, outlier;
};

/// The receiver, with what is the same for all beams computed once.
struct PhaseReceiver {
  /// Of a scanner with tones.
  explicit PhaseReceiver(const Scanner& scanner);

  /// How many blocks of normal numbers `read` uses: of block 0 the range noise and two numbers of
  /// the finest tone, two tones in each further one.
  std::size_t blocks() const { return 1 + tones.size() / 2; }

  PhaseReadings read(const Light& light) const;

  struct Tone {
    double interval = 1;  // metres
    double per_metre = 1;
    float depth = 1;
  };

  Scanner scanner;
  std::vector<Tone> tones = {};
  double phase_steps = 1;  // per turn
  double phase_step = 1;
  float noise_floor = 0;   // variance of each component
  float noise_signal = 0;  // its growth per amplitude
};

/// What an instrument switched on for `age` seconds adds to all its ranges, metres.
double range_bias(const Scanner& scanner, double age);

}  // namespace minescan
