// SPDX-License-Identifier: MIT
#include "sim/ranging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/cloud.h"
#include "core/random.h"

namespace minescan {
namespace {

constexpr float two_pi = 2 * std::numbers::pi_v<float>;

double rounded_to(double value, double step) { return step * std::round(value / step); }

// Facets in the order of their ranges.
using Order = std::array<std::uint8_t, max_facets>;
std::span<std::uint8_t> by_range(std::span<const Facet> facets, Order& order) {
  const std::span<std::uint8_t> used(order.data(), facets.size());
  for (std::size_t i = 0; i < used.size(); ++i) used[i] = static_cast<std::uint8_t>(i);
  std::sort(used.begin(), used.end(), [&](std::uint8_t a, std::uint8_t b) {
    return facets[a].range < facets[b].range || (facets[a].range == facets[b].range && a < b);
  });
  return used;
}

// Whether a gap separates them into several surfaces.
bool are_mixed(std::span<const Facet> facets) {
  double low = facets[0].range;
  double high = low;
  for (const Facet& facet : facets) {
    low = std::min(low, facet.range);
    high = std::max(high, facet.range);
  }
  if (!(high - low > surface_gap)) return false;
  Order order;
  const std::span<const std::uint8_t> sorted = by_range(facets, order);
  for (std::size_t i = 1; i < sorted.size(); ++i)
    if (facets[sorted[i]].range - facets[sorted[i - 1]].range > surface_gap) return true;
  return false;
}

}  // namespace

FourNormals four_normals(std::uint64_t seed, std::uint64_t stream, std::uint64_t block) {
  Random random(seed, stream, block);
  FourNormals normals;
  for (std::size_t i = 0; i < normals.size(); i += 2) {
    const std::uint64_t bits = random.bits();
    // Middles of 2^32 equal steps: never 0, so the logarithm is finite. Single precision is finer
    // than any noise needs, and takes half the time.
    const float u = (static_cast<float>(bits >> 32) + 0.5f) * 0x1.0p-32f;
    const float v = (static_cast<float>(bits & 0xffffffff) + 0.5f) * 0x1.0p-32f;
    const float radius = std::sqrt(-2 * std::log(u));
    const float angle = two_pi * v;
    normals[i] = radius * std::cos(angle);
    normals[i + 1] = radius * std::sin(angle);
  }
  return normals;
}

double amplitude(const Scanner& scanner, double range, double signal) {
  const double defocus = scanner.defocus_range / range;
  double received = signal * (1 - std::exp(-defocus * defocus));
  if (scanner.fog_extinction > 0) received *= std::exp(-2 * scanner.fog_extinction * range);
  return received;
}

Ranging::Ranging(const Scanner& scanner) : scanner_(scanner) {
  const Scanner& s = scanner_;
  if (s.ranging != RangingKind::phase) return;
  for (std::size_t k = 0; k < s.tones.size(); ++k)
    tones_.push_back(
        {.interval = s.tones[k],
         .per_metre = 1 / s.tones[k],
         .depth = s.tone_depths.empty() ? 1 : static_cast<float>(s.tone_depths[k])});
  // Of block 0: range noise, two of the finest tone. Two tones in each further one.
  blocks_ = 1 + tones_.size() / 2;
  noise_floor_ = static_cast<float>(s.amplitude_noise * s.amplitude_noise);
  // sigma_R = Lambda / (2 pi) sqrt(s A) / A with A = rho cos (defocus_range / R)^2.
  const double root = 2 * std::numbers::pi * s.range_noise_growth * s.defocus_range / s.tones[0];
  noise_signal_ = static_cast<float>(root * root);
}

Echoes Ranging::measure(std::span<const Facet> facets, std::span<const FourNormals> normal,
                        double age) const {
  const double bias =
      scanner_.warm_up == 0
          ? scanner_.range_bias
          : scanner_.range_bias + scanner_.warm_up * std::exp(-age / scanner_.warm_up_time);
  return scanner_.ranging == RangingKind::phase ? measure_phase(facets, normal, bias)
                                                : measure_pulse(facets, normal, bias);
}

Echoes Ranging::measure_phase(std::span<const Facet> facets, std::span<const FourNormals> normal,
                              double bias) const {
  const Scanner& s = scanner_;
  // The light of each facet; single precision is finer than any noise of the signal.
  std::array<float, max_facets> light;
  float total = 0;
  std::size_t strongest = 0;
  for (std::size_t i = 0; i < facets.size(); ++i) {
    light[i] = static_cast<float>(facets[i].weight *
                                  amplitude(s, facets[i].range, facets[i].signal));
    total += light[i];
    if (light[i] > light[strongest]) strongest = i;
  }
  const float sigma = std::sqrt(noise_floor_ + noise_signal_ * total);
  const auto leak = static_cast<float>(s.leakage);

  Echo echo;
  double measured = 0;
  for (std::size_t k = tones_.size(); k-- > 0;) {  // the coarsest first
    const Tone& tone = tones_[k];
    float real = 0;
    float imaginary = 0;
    for (std::size_t i = 0; i < facets.size(); ++i) {
      const double turns = facets[i].range * tone.per_metre;
      const float phase = two_pi * static_cast<float>(turns - std::floor(turns));
      real += light[i] * std::cos(phase);
      imaginary += light[i] * std::sin(phase);
    }
    // Normal numbers 1 and 2 of block 0 for the finest tone, then two by two.
    const float* noise = k == 0 ? &normal[0][1] : &normal[1 + (k - 1) / 2][2 * ((k - 1) % 2)];
    real = tone.depth * real + leak + sigma * noise[0];
    imaginary = tone.depth * imaginary + sigma * noise[1];
    if (k == 0) {
      const float length = std::sqrt(real * real + imaginary * imaginary) / tone.depth;
      // False for NaN, which a surface seen exactly edge-on would give.
      if (!(length >= static_cast<float>(s.min_amplitude))) return {};
      echo.amplitude = length;
    }
    if (s.saturation > 0) {
      const auto most = static_cast<float>(s.saturation);
      if (std::abs(real) > most || std::abs(imaginary) > most) echo.flags |= flag_saturated;
      real = std::clamp(real, -most, most);
      imaginary = std::clamp(imaginary, -most, most);
    }
    double turns = static_cast<double>(std::atan2(imaginary, real) / two_pi);
    if (s.phase_bits > 0) turns = rounded_to(turns, std::ldexp(1.0, -s.phase_bits));
    const double range = turns * tone.interval;
    // The period of this tone nearest to what the coarser ones say.
    measured = range + tone.interval * std::round((measured - range) * tone.per_metre);
  }
  const double wrap = tones_.back().interval;
  const double axis = facets[strongest].range;
  const auto within = [&](double range) { return range - wrap * std::floor(range / wrap); };
  if (axis >= wrap) echo.flags |= flag_wrapped;
  if (are_mixed(facets)) echo.flags |= flag_mixed_pixel;
  if (tones_.size() > 1) {
    const double off = within(measured - axis + wrap / 2) - wrap / 2;
    if (std::abs(off) > tones_[0].interval / 2) echo.flags |= flag_outlier;
  }
  if (s.harmonic > 0)
    measured += s.harmonic * std::sin(8 * std::numbers::pi * tones_[0].per_metre * measured);
  measured += bias + s.range_scale * measured +
              s.range_noise * static_cast<double>(normal[0][0]);
  if (s.quantisation > 0) measured = rounded_to(measured, s.quantisation);
  echo.range = within(measured);
  if (!(echo.range >= s.min_range && echo.range <= s.max_range)) return {};
  Echoes echoes;
  echoes.echo[0] = echo;
  echoes.count = 1;
  return echoes;
}

std::optional<Echo> Ranging::pulse_echo(double range, double light, float normal,
                                        double bias) const {
  const Scanner& s = scanner_;
  if (!(light >= s.min_amplitude)) return std::nullopt;
  Echo echo;
  double sigma = s.range_noise + s.range_noise_growth * range;
  if (s.range_noise_max > 0) sigma = std::min(sigma, s.range_noise_max);
  double measured = range + bias + s.range_scale * range;
  if (sigma > 0) measured += sigma * static_cast<double>(normal);
  if (s.quantisation > 0) measured = rounded_to(measured, s.quantisation);
  if (!(measured >= s.min_range && measured <= s.max_range)) return std::nullopt;
  if (s.saturation > 0 && light > s.saturation) {
    light = s.saturation;
    echo.flags |= flag_saturated;
  }
  echo.amplitude = static_cast<float>(light);
  echo.range = measured;
  return echo;
}

Echoes Ranging::measure_pulse(std::span<const Facet> facets, std::span<const FourNormals> normal,
                              double bias) const {
  const Scanner& s = scanner_;
  Echoes echoes;
  const auto report = [&](const std::optional<Echo>& echo) {
    if (echo) echoes.echo[echoes.count++] = *echo;
  };
  if (facets.size() == 1) {
    report(pulse_echo(facets[0].range, amplitude(s, facets[0].range, facets[0].signal),
                      normal[0][0], bias));
    return echoes;
  }

  // A surface: facets without a gap between them. A pulse: surfaces that are near to each other.
  struct Surface {
    double light = 0;
    double moment = 0;  // light * range
    std::uint8_t first = max_facets;
    void add(const Surface& other) {
      light += other.light;
      moment += other.moment;
      first = std::min(first, other.first);
    }
  };
  struct Pulse {
    Surface all;
    Surface strongest;
    int surfaces;
  };
  std::array<Pulse, max_facets> pulses;  // the first `count` are there
  std::size_t count = 0;
  Surface surface;
  const auto end_surface = [&] {
    if (!(surface.light > 0)) return;
    Pulse& pulse = pulses[count - 1];
    pulse.all.add(surface);
    ++pulse.surfaces;
    if (surface.light > pulse.strongest.light) pulse.strongest = surface;
    surface = {};
  };
  Order order;
  double last = -std::numeric_limits<double>::infinity();
  for (const std::uint8_t i : by_range(facets, order)) {
    const double range = facets[i].range;
    const double light = facets[i].weight * amplitude(s, range, facets[i].signal);
    if (!(light > 0)) continue;
    if (range - last > surface_gap) end_surface();
    if (range - last > std::max(s.pulse_length, surface_gap)) pulses[count++] = {};
    surface.add({light, light * range, i});
    last = range;
  }
  end_surface();

  // The strongest ones, by range.
  std::array<std::uint8_t, max_facets> strongest;
  for (std::size_t p = 0; p < count; ++p) strongest[p] = static_cast<std::uint8_t>(p);
  const std::size_t reported = std::min(count, static_cast<std::size_t>(s.returns));
  const auto end = strongest.begin() + static_cast<std::ptrdiff_t>(reported);
  std::partial_sort(strongest.begin(), end,
                    strongest.begin() + static_cast<std::ptrdiff_t>(count),
                    [&](std::uint8_t a, std::uint8_t b) {
                      return pulses[a].all.light > pulses[b].all.light;
                    });
  std::sort(strongest.begin(), end);
  for (std::size_t k = 0; k < reported; ++k) {
    const Pulse& pulse = pulses[strongest[k]];
    const bool captured = pulse.strongest.light >= s.pulse_capture * pulse.all.light;
    const Surface& seen = captured ? pulse.strongest : pulse.all;
    std::optional<Echo> echo =
        pulse_echo(seen.moment / seen.light, seen.light, normal[0][k], bias);
    if (!echo) continue;
    if (count > 1 || pulse.surfaces > 1) echo->flags |= flag_mixed_pixel;
    echo->facet = seen.first;
    report(echo);
  }
  return echoes;
}

}  // namespace minescan
