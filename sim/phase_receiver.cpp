// SPDX-License-Identifier: MIT
#include "sim/phase_receiver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

// This file is compiled once for each kind of processor: loops over 16 beams, which compilers turn
// into its widest instructions. Their bits are the same on all of them; sine_cosine and its like
// differ as sim/vector_math.h says.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/phase_receiver.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace minescan {
namespace HWY_NAMESPACE {

constexpr std::size_t n = lanes;
constexpr float two_pi = 2 * std::numbers::pi_v<float>;

// For |x| < 2^51: adding so much leaves no bits behind the point.
double nearest_integer(double x) {
  constexpr double shift = 0x1.8p52;
  return (x + shift) - shift;
}

// std::floor for the same numbers.
double floor_of(double x) {
  const double nearest = nearest_integer(x);
  return nearest > x ? nearest - 1 : nearest;
}

void Read(const PhaseReceiver& r, const Light& light, PhaseReadings& readings) {
  const Scanner& s = r.scanner;
  const std::size_t sub_rays = light.sub_rays;
  // Copies of what loops read: for the compiler, what they write could be its place.
  const double defocus_range = s.defocus_range;
  const float noise_floor = r.noise_floor, noise_signal = r.noise_signal;
  std::array<Lanes, max_facets> received, angle, sine, cosine;
  angle[0].fill(0);  // the compiler does not see that there is a sub-ray

  // amplitude() of all sub-rays; single precision is finer than any noise of the signal.
  for (std::size_t k = 0; k < sub_rays; ++k)
    for (std::size_t i = 0; i < n; ++i) {
      const double defocus = defocus_range / light.range[k][i];
      angle[k][i] = static_cast<float>(std::max(-80.0, -defocus * defocus));
    }
  exponential_minus_1(angle[0].data(), received[0].data(), sub_rays * n);
  for (std::size_t k = 0; k < sub_rays; ++k)
    for (std::size_t i = 0; i < n; ++i)
      received[k][i] *= static_cast<float>(-light.weight[k][i] * light.signal[k][i]);
  if (s.fog_extinction > 0)
    for (std::size_t k = 0; k < sub_rays; ++k)
      for (std::size_t i = 0; i < n; ++i)
        received[k][i] *= static_cast<float>(std::exp(-2 * s.fog_extinction * light.range[k][i]));

  Lanes sigma = {};
  Lanes most;
  most.fill(-1);
  DoubleLanes strongest = {};
  for (std::size_t k = 0; k < sub_rays; ++k)
    for (std::size_t i = 0; i < n; ++i) {
      sigma[i] += received[k][i];
      const bool more = light.weight[k][i] > 0 && received[k][i] > most[i];
      most[i] = more ? received[k][i] : most[i];
      strongest[i] = more ? light.range[k][i] : strongest[i];
    }
  for (std::size_t i = 0; i < n; ++i) sigma[i] = std::sqrt(noise_floor + noise_signal * sigma[i]);

  DoubleLanes range = {};
  readings.saturated.fill(false);
  Lanes real, imaginary, phase, amplitude;
  const auto leak = static_cast<float>(s.leakage);
  const bool rounded = s.phase_bits > 0;
  const double phase_step = r.phase_step, phase_steps = r.phase_steps;
  for (std::size_t k = r.tones.size(); k-- > 0;) {  // the coarsest first
    const PhaseReceiver::Tone tone = r.tones[k];
    for (std::size_t j = 0; j < sub_rays; ++j)
      for (std::size_t i = 0; i < n; ++i) {
        const double turns = light.range[j][i] * tone.per_metre;
        angle[j][i] = two_pi * static_cast<float>(turns - nearest_integer(turns));
      }
    sine_cosine(angle[0].data(), sine[0].data(), cosine[0].data(), sub_rays * n);
    // Normal numbers 1 and 2 of block 0 for the finest tone, then two by two.
    const Lanes* noise =
        k == 0 ? &light.normals[0][1] : &light.normals[1 + (k - 1) / 2][2 * ((k - 1) % 2)];
    real.fill(0);
    imaginary.fill(0);
    for (std::size_t j = 0; j < sub_rays; ++j)
      for (std::size_t i = 0; i < n; ++i) {
        real[i] += received[j][i] * cosine[j][i];
        imaginary[i] += received[j][i] * sine[j][i];
      }
    for (std::size_t i = 0; i < n; ++i) {
      real[i] = tone.depth * real[i] + leak + sigma[i] * noise[0][i];
      imaginary[i] = tone.depth * imaginary[i] + sigma[i] * noise[1][i];
    }
    if (k == 0)
      for (std::size_t i = 0; i < n; ++i)
        amplitude[i] = std::sqrt(real[i] * real[i] + imaginary[i] * imaginary[i]) / tone.depth;
    if (s.saturation > 0) {
      const auto limit = static_cast<float>(s.saturation);
      for (std::size_t i = 0; i < n; ++i) {
        readings.saturated[i] |= std::abs(real[i]) > limit || std::abs(imaginary[i]) > limit;
        real[i] = std::clamp(real[i], -limit, limit);
        imaginary[i] = std::clamp(imaginary[i], -limit, limit);
      }
    }
    arc_tangent(imaginary.data(), real.data(), phase.data(), n);
    for (std::size_t i = 0; i < n; ++i) {
      double turns = static_cast<double>(phase[i] / two_pi);
      if (rounded) turns = phase_step * nearest_integer(turns * phase_steps);
      const double within = turns * tone.interval;
      // The period of this tone nearest to what the coarser ones say.
      range[i] = within + tone.interval * nearest_integer((range[i] - within) * tone.per_metre);
    }
  }

  const double wrap = r.tones.back().interval;
  const double half_period = r.tones.size() > 1 ? r.tones[0].interval / 2 : wrap;
  for (std::size_t i = 0; i < n; ++i) {
    const double off = range[i] - strongest[i];
    readings.outlier[i] = std::abs(off - wrap * nearest_integer(off / wrap)) > half_period;
  }
  if (s.harmonic > 0)
    for (std::size_t i = 0; i < n; ++i)
      range[i] += s.harmonic * std::sin(8 * std::numbers::pi * r.tones[0].per_metre * range[i]);
  DoubleLanes bias;
  if (s.warm_up == 0)
    bias.fill(range_bias(s, 0));
  else
    for (std::size_t i = 0; i < n; ++i) bias[i] = range_bias(s, light.age[i]);
  const double scale = s.range_scale, noise = s.range_noise, step = s.quantisation;
  for (std::size_t i = 0; i < n; ++i)
    range[i] += bias[i] + scale * range[i] + noise * static_cast<double>(light.normals[0][0][i]);
  if (step > 0)
    for (std::size_t i = 0; i < n; ++i) range[i] = step * nearest_integer(range[i] / step);
  for (std::size_t i = 0; i < n; ++i) range[i] -= wrap * floor_of(range[i] / wrap);
  readings.range = range;
  readings.amplitude = amplitude;
  readings.strongest = strongest;
}

}  // namespace HWY_NAMESPACE
}  // namespace minescan
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace minescan {

HWY_EXPORT(Read);

PhaseReceiver::PhaseReceiver(const Scanner& s) : scanner(s) {
  for (std::size_t k = 0; k < s.tones.size(); ++k)
    tones.push_back({.interval = s.tones[k],
                     .per_metre = 1 / s.tones[k],
                     .depth = s.tone_depths.empty() ? 1 : static_cast<float>(s.tone_depths[k])});
  phase_steps = std::ldexp(1.0, s.phase_bits);
  phase_step = 1 / phase_steps;
  noise_floor = static_cast<float>(s.amplitude_noise * s.amplitude_noise);
  // sigma_R = Lambda / (2 pi) sqrt(s A) / A with A = rho cos (defocus_range / R)^2.
  const double root = 2 * std::numbers::pi * s.range_noise_growth * s.defocus_range / s.tones[0];
  noise_signal = static_cast<float>(root * root);
}

PhaseReadings PhaseReceiver::read(const Light& light) const {
  PhaseReadings readings;
  HWY_DYNAMIC_DISPATCH(Read)(*this, light, readings);
  return readings;
}

double range_bias(const Scanner& scanner, double age) {
  if (scanner.warm_up == 0) return scanner.range_bias;
  return scanner.range_bias + scanner.warm_up * std::exp(-age / scanner.warm_up_time);
}

}  // namespace minescan
#endif
