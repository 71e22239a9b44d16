// SPDX-License-Identifier: MIT
#include "sim/ranging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/cloud.h"

namespace minescan {
namespace {

// A sub-ray of a beam that brings light back.
struct Part {
  double range;
  std::uint8_t sub_ray;
};

// Those of a beam, by range.
struct Parts {
  std::array<Part, max_facets> part;
  std::size_t count = 0;

  Parts(const Light& light, std::size_t beam) {
    for (std::size_t k = 0; k < light.sub_rays; ++k)
      if (light.weight[k][beam] > 0)
        part[count++] = {light.range[k][beam], static_cast<std::uint8_t>(k)};
    std::stable_sort(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(count),
                     [](const Part& a, const Part& b) { return a.range < b.range; });
  }
};

// Whether a gap separates what a beam met into several surfaces.
bool are_mixed(const Light& light, std::size_t beam) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (std::size_t k = 0; k < light.sub_rays; ++k) {
    if (!(light.weight[k][beam] > 0)) continue;
    low = std::min(low, light.range[k][beam]);
    high = std::max(high, light.range[k][beam]);
  }
  if (!(high - low > surface_gap)) return false;
  const Parts parts(light, beam);
  for (std::size_t i = 1; i < parts.count; ++i)
    if (parts.part[i].range - parts.part[i - 1].range > surface_gap) return true;
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
  if (scanner.ranging == RangingKind::phase) phase_.emplace(scanner);
}

void Ranging::measure(const Light& light, std::span<Echoes> echoes) const {
  if (phase_) {
    measure_phase(light, echoes);
    return;
  }
  for (std::size_t i = 0; i < echoes.size(); ++i) echoes[i] = measure_pulse(light, i);
}

void Ranging::measure_phase(const Light& light, std::span<Echoes> echoes) const {
  const Scanner& s = scanner_;
  const PhaseReadings readings = phase_->read(light);
  for (std::size_t i = 0; i < echoes.size(); ++i) {
    echoes[i].count = 0;
    // All that a beam meets is one to a phase scanner.
    std::uint8_t first = 0;
    while (first < light.sub_rays && !(light.weight[first][i] > 0)) ++first;
    if (first == light.sub_rays) continue;
    const double range = readings.range[i];
    // False for NaN.
    if (!(readings.amplitude[i] >= static_cast<float>(s.min_amplitude))) continue;
    if (!(range >= s.min_range && range <= s.max_range)) continue;
    std::uint8_t flags = flag_none;
    if (readings.strongest[i] >= phase_->tones.back().interval) flags |= flag_wrapped;
    if (readings.saturated[i]) flags |= flag_saturated;
    if (light.sub_rays > 1 && are_mixed(light, i)) flags |= flag_mixed_pixel;
    if (readings.outlier[i]) flags |= flag_outlier;
    echoes[i].count = 1;
    echoes[i].echo[0] = {
        .range = range, .amplitude = readings.amplitude[i], .flags = flags, .sub_ray = first};
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
  if (s.quantisation > 0) measured = s.quantisation * std::nearbyint(measured / s.quantisation);
  if (!(measured >= s.min_range && measured <= s.max_range)) return std::nullopt;
  if (s.saturation > 0 && light > s.saturation) {
    light = s.saturation;
    echo.flags |= flag_saturated;
  }
  echo.amplitude = static_cast<float>(light);
  echo.range = measured;
  return echo;
}

Echoes Ranging::measure_pulse(const Light& light, std::size_t beam) const {
  const Scanner& s = scanner_;
  const auto normal = [&](std::size_t k) { return light.normals[0][k][beam]; };
  const double bias = range_bias(s, light.age[beam]);
  Echoes echoes;
  const auto report = [&](const std::optional<Echo>& echo) {
    if (echo) echoes.echo[echoes.count++] = *echo;
  };
  if (light.sub_rays == 1) {
    const double range = light.range[0][beam];
    if (light.weight[0][beam] > 0)
      report(pulse_echo(range, amplitude(s, range, light.signal[0][beam]), normal(0), bias));
    return echoes;
  }

  // A surface: parts without a gap between them. A pulse: surfaces that are near to each other.
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
  double last = -std::numeric_limits<double>::infinity();
  const Parts parts(light, beam);
  for (std::size_t i = 0; i < parts.count; ++i) {
    const auto [range, k] = parts.part[i];
    const double part = light.weight[k][beam] * amplitude(s, range, light.signal[k][beam]);
    if (!(part > 0)) continue;
    if (range - last > surface_gap) end_surface();
    if (range - last > std::max(s.pulse_length, surface_gap)) pulses[count++] = {};
    surface.add({part, part * range, k});
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
    std::optional<Echo> echo = pulse_echo(seen.moment / seen.light, seen.light, normal(k), bias);
    if (!echo) continue;
    if (count > 1 || pulse.surfaces > 1) echo->flags |= flag_mixed_pixel;
    echo->sub_ray = seen.first;
    report(echo);
  }
  return echoes;
}

}  // namespace minescan
