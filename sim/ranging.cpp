// SPDX-License-Identifier: MIT
#include "sim/ranging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/cloud.h"

namespace minescan {
namespace {

constexpr float two_pi = 2 * std::numbers::pi_v<float>;

// For |x| < 2^51: adding so much leaves no bits behind the point. A third of the time of
// std::round, and several at once.
double nearest_integer(double x) {
  constexpr double shift = 0x1.8p52;
  return (x + shift) - shift;
}

// std::floor, which takes a call on processors of old, for the same numbers.
double floor_of(double x) {
  const double nearest = nearest_integer(x);
  return nearest > x ? nearest - 1 : nearest;
}

double rounded_to(double value, double step) { return step * nearest_integer(value / step); }

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
    tones_.push_back({.interval = s.tones[k],
                      .per_metre = 1 / s.tones[k],
                      .depth = s.tone_depths.empty() ? 1 : static_cast<float>(s.tone_depths[k])});
  // Of block 0: range noise, two of the finest tone. Two tones in each further one.
  blocks_ = 1 + tones_.size() / 2;
  phase_steps_ = std::ldexp(1.0, s.phase_bits);
  phase_step_ = 1 / phase_steps_;
  noise_floor_ = static_cast<float>(s.amplitude_noise * s.amplitude_noise);
  // sigma_R = Lambda / (2 pi) sqrt(s A) / A with A = rho cos (defocus_range / R)^2.
  const double root = 2 * std::numbers::pi * s.range_noise_growth * s.defocus_range / s.tones[0];
  noise_signal_ = static_cast<float>(root * root);
}

double Ranging::bias(double age) const {
  if (scanner_.warm_up == 0) return scanner_.range_bias;
  return scanner_.range_bias + scanner_.warm_up * std::exp(-age / scanner_.warm_up_time);
}

void Ranging::measure(const Light& light, std::span<Echoes> echoes) const {
  if (scanner_.ranging == RangingKind::phase) {
    measure_phase(light, echoes);
    return;
  }
  const auto& normals = light.normals[0];
  for (std::size_t i = 0; i < light.beams; ++i)
    echoes[i] = light.of(i).empty()
                    ? Echoes{}
                    : measure_pulse(light.of(i), {normals[0][i], normals[1][i], normals[2][i]},
                                    bias(light.age[i]));
}

void Ranging::measure_phase(const Light& light, std::span<Echoes> echoes) const {
  const Scanner& s = scanner_;
  const std::size_t facets = light.first[light.beams];
  std::array<float, lanes * max_facets> received, angle, sine, cosine;
  angle[0] = 0;  // the compiler does not see that `facets` limits what is read

  // amplitude() of all facets; single precision is finer than any noise of the signal.
  for (std::size_t f = 0; f < facets; ++f) {
    const double defocus = s.defocus_range / light.facets[f].range;
    angle[f] = static_cast<float>(std::max(-80.0, -defocus * defocus));
  }
  exponential_minus_1(angle.data(), received.data(), facets);
  for (std::size_t f = 0; f < facets; ++f)
    received[f] *= static_cast<float>(-light.facets[f].weight * light.facets[f].signal);
  if (s.fog_extinction > 0)
    for (std::size_t f = 0; f < facets; ++f)
      received[f] *= static_cast<float>(std::exp(-2 * s.fog_extinction * light.facets[f].range));

  Lanes sigma = {};
  std::array<std::size_t, lanes> strongest;
  for (std::size_t i = 0; i < light.beams; ++i) {
    float total = 0;
    strongest[i] = light.first[i];
    for (std::size_t f = light.first[i]; f < light.first[i + 1]; ++f) {
      total += received[f];
      if (received[f] > received[strongest[i]]) strongest[i] = f;
    }
    sigma[i] = std::sqrt(noise_floor_ + noise_signal_ * total);
  }

  std::array<double, lanes> measured = {};
  Lanes real = {}, imaginary = {}, phase = {}, length = {};
  std::array<bool, lanes> saturated = {};
  const auto leak = static_cast<float>(s.leakage);
  for (std::size_t k = tones_.size(); k-- > 0;) {  // the coarsest first
    const Tone& tone = tones_[k];
    for (std::size_t f = 0; f < facets; ++f) {
      const double turns = light.facets[f].range * tone.per_metre;
      angle[f] = two_pi * static_cast<float>(turns - nearest_integer(turns));
    }
    sine_cosine(angle.data(), sine.data(), cosine.data(), facets);
    // Normal numbers 1 and 2 of block 0 for the finest tone, then two by two.
    const Lanes* noise =
        k == 0 ? &light.normals[0][1] : &light.normals[1 + (k - 1) / 2][2 * ((k - 1) % 2)];
    for (std::size_t i = 0; i < light.beams; ++i) {
      real[i] = 0;
      imaginary[i] = 0;
      for (std::size_t f = light.first[i]; f < light.first[i + 1]; ++f) {
        real[i] += received[f] * cosine[f];
        imaginary[i] += received[f] * sine[f];
      }
    }
    for (std::size_t i = 0; i < lanes; ++i) {
      real[i] = tone.depth * real[i] + leak + sigma[i] * noise[0][i];
      imaginary[i] = tone.depth * imaginary[i] + sigma[i] * noise[1][i];
    }
    if (k == 0)
      for (std::size_t i = 0; i < lanes; ++i)
        length[i] = std::sqrt(real[i] * real[i] + imaginary[i] * imaginary[i]) / tone.depth;
    if (s.saturation > 0) {
      const auto most = static_cast<float>(s.saturation);
      for (std::size_t i = 0; i < lanes; ++i) {
        saturated[i] |= std::abs(real[i]) > most || std::abs(imaginary[i]) > most;
        real[i] = std::clamp(real[i], -most, most);
        imaginary[i] = std::clamp(imaginary[i], -most, most);
      }
    }
    arc_tangent(imaginary.data(), real.data(), phase.data(), lanes);
    for (std::size_t i = 0; i < lanes; ++i) {
      double turns = static_cast<double>(phase[i] / two_pi);
      if (s.phase_bits > 0) turns = phase_step_ * nearest_integer(turns * phase_steps_);
      const double range = turns * tone.interval;
      // The period of this tone nearest to what the coarser ones say.
      measured[i] = range + tone.interval * nearest_integer((measured[i] - range) * tone.per_metre);
    }
  }

  const double wrap = tones_.back().interval;
  const auto within = [&](double range) { return range - wrap * floor_of(range / wrap); };
  for (std::size_t i = 0; i < light.beams; ++i) {
    echoes[i].count = 0;
    // False for NaN, which a surface seen exactly edge-on would give.
    if (light.of(i).empty() || !(length[i] >= static_cast<float>(s.min_amplitude))) continue;
    const double axis = light.facets[strongest[i]].range;
    // In place: what is put together byte by byte takes long to copy.
    Echo& echo = echoes[i].echo[0];
    echo = {.amplitude = length[i]};
    if (axis >= wrap) echo.flags |= flag_wrapped;
    if (saturated[i]) echo.flags |= flag_saturated;
    if (are_mixed(light.of(i))) echo.flags |= flag_mixed_pixel;
    double range = measured[i];
    const double off = range - axis;
    if (tones_.size() > 1 &&
        std::abs(off - wrap * nearest_integer(off / wrap)) > tones_[0].interval / 2)
      echo.flags |= flag_outlier;
    if (s.harmonic > 0)
      range += s.harmonic * std::sin(8 * std::numbers::pi * tones_[0].per_metre * range);
    range += bias(light.age[i]) + s.range_scale * range +
             s.range_noise * static_cast<double>(light.normals[0][0][i]);
    if (s.quantisation > 0) range = rounded_to(range, s.quantisation);
    echo.range = within(range);
    if (!(echo.range >= s.min_range && echo.range <= s.max_range)) continue;
    echoes[i].count = 1;
  }
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

Echoes Ranging::measure_pulse(std::span<const Facet> facets,
                              const std::array<float, max_returns>& normal, double bias) const {
  const Scanner& s = scanner_;
  Echoes echoes;
  const auto report = [&](const std::optional<Echo>& echo) {
    if (echo) echoes.echo[echoes.count++] = *echo;
  };
  if (facets.size() == 1) {
    report(pulse_echo(facets[0].range, amplitude(s, facets[0].range, facets[0].signal), normal[0],
                      bias));
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
  std::partial_sort(
      strongest.begin(), end, strongest.begin() + static_cast<std::ptrdiff_t>(count),
      [&](std::uint8_t a, std::uint8_t b) { return pulses[a].all.light > pulses[b].all.light; });
  std::sort(strongest.begin(), end);
  for (std::size_t k = 0; k < reported; ++k) {
    const Pulse& pulse = pulses[strongest[k]];
    const bool captured = pulse.strongest.light >= s.pulse_capture * pulse.all.light;
    const Surface& seen = captured ? pulse.strongest : pulse.all;
    std::optional<Echo> echo = pulse_echo(seen.moment / seen.light, seen.light, normal[k], bias);
    if (!echo) continue;
    if (count > 1 || pulse.surfaces > 1) echo->flags |= flag_mixed_pixel;
    echo->facet = seen.first;
    report(echo);
  }
  return echoes;
}

}  // namespace minescan
