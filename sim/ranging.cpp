// SPDX-License-Identifier: MIT
#include "sim/ranging.h"

#include <cmath>
#include <numbers>

namespace minescan {

using std::numbers::pi;

std::array<double, 4> four_normals(Random& random) {
  std::array<double, 4> normals;
  for (std::size_t i = 0; i < normals.size(); i += 2) {
    const std::uint64_t bits = random.bits();
    // Middles of 2^32 equal steps: never 0, so the logarithm is finite. Single precision is finer
    // than any noise needs, and takes half the time.
    const float u = (static_cast<float>(bits >> 32) + 0.5f) * 0x1.0p-32f;
    const float v = (static_cast<float>(bits & 0xffffffff) + 0.5f) * 0x1.0p-32f;
    const float radius = std::sqrt(-2 * std::log(u));
    const float angle = 2 * std::numbers::pi_v<float> * v;
    normals[i] = static_cast<double>(radius * std::cos(angle));
    normals[i + 1] = static_cast<double>(radius * std::sin(angle));
  }
  return normals;
}

double amplitude(const Scanner& scanner, double range, double reflectance, double cosine) {
  const double defocus = scanner.defocus_range / range;
  return reflectance * cosine * (1 - std::exp(-defocus * defocus));
}

double range_sigma(const Scanner& scanner, double range, double reflectance, double cosine) {
  const double a = scanner.range_noise;
  const double bR = scanner.range_noise_growth * range;
  return std::sqrt(a * a + bR * bR / (reflectance * cosine));
}

Ranging::Ranging(const Scanner& scanner) : scanner_(scanner) {
  const double fine = scanner.fine_interval;
  const double coarse = scanner.wrap_interval;
  if (fine > 0) phase_per_metre_ = 2 * pi / fine;
  // The coarse tone errs by more than half a fine period from this phase error on.
  if (fine > 0 && coarse > 0) {
    periods_per_radian_ = coarse / (2 * pi * fine);
    const double limit = 0.5 / periods_per_radian_;
    if (limit < pi / 2) tan_wrong_period_ = std::tan(limit);
  }
}

Echo Ranging::measure(double range, double reflectance, double cosine,
                      const std::array<double, 3>& normals) const {
  const Scanner& s = scanner_;
  Echo echo;
  // The signal as a phasor, turned so that its noiseless part is real: noise makes its length
  // Rician, and its angle is the phase error of the tone that it belongs to (the coarse one here).
  const double real = amplitude(s, range, reflectance, cosine) + s.amplitude_noise * normals[1];
  const double imaginary = s.amplitude_noise * normals[2];
  const double length = std::sqrt(real * real + imaginary * imaginary);
  if (!(length >= s.min_amplitude)) return echo;
  echo.amplitude = static_cast<float>(length);

  double measured = range + s.cyclic_error * std::sin(phase_per_metre_ * range);
  measured += range_sigma(s, range, reflectance, cosine) * normals[0];
  if (s.wrap_interval > 0) {
    if (measured >= s.wrap_interval) echo.flags |= flag_wrapped;
    // The period of the fine tone nearest to the coarse range. Weak signals have any phase.
    if (!(std::abs(imaginary) <= tan_wrong_period_ * real)) {
      const double periods = std::round(std::atan2(imaginary, real) * periods_per_radian_);
      if (periods != 0) echo.flags |= flag_outlier;
      measured += periods * s.fine_interval;
    }
    measured -= s.wrap_interval * std::floor(measured / s.wrap_interval);
  }
  echo.range = measured;
  // False for NaN, which a surface seen exactly edge-on would give.
  echo.returned = measured >= s.min_range && measured <= s.max_range;
  return echo;
}

}  // namespace minescan
