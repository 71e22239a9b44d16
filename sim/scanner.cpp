// SPDX-License-Identifier: MIT
#include "sim/scanner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "sim/footprint.h"
#include "sim/ranging.h"

namespace minescan {
namespace {

[[noreturn]] void fail(const Scanner& scanner, const std::string& what) {
  throw std::invalid_argument(fmt::format("scanner '{}': {}", scanner.name, what));
}

void check_tones(const Scanner& s) {
  if (s.ranging != RangingKind::phase) return;
  if (s.tones.empty() || s.tones.size() > max_tones)
    fail(s, fmt::format("phase ranging needs 1 to {} tones, found {}", max_tones, s.tones.size()));
  if (!s.tone_depths.empty() && s.tone_depths.size() != s.tones.size())
    fail(s, fmt::format("expected as many tone-depths as tones, {}, found {}", s.tones.size(),
                        s.tone_depths.size()));
  for (std::size_t k = 1; k < s.tones.size(); ++k) {
    const double ratio = s.tones[k] / s.tones[k - 1];
    if (!(ratio > 1))
      fail(s, fmt::format("expected tones from the finest to the coarsest, found {} before {}",
                          s.tones[k - 1], s.tones[k]));
    // The period of the finer tone is right while the coarser one errs by less than half of it.
    const double depth = s.tone_depths.empty() ? 1 : s.tone_depths[k];
    const double strongest = s.saturation > 0 ? s.saturation : depth;
    const double sigma = s.tones[k] * s.amplitude_noise / (2 * std::numbers::pi * strongest);
    if (!(sigma < s.tones[k - 1] / 2))
      fail(s, fmt::format("the tone of {} m cannot tell the periods of the one of {} m: even on a "
                          "white plate it errs by {:.3g} m, expected less than half of {} m",
                          s.tones[k], s.tones[k - 1], sigma, s.tones[k - 1]));
    const double step = s.phase_bits > 0 ? std::ldexp(s.tones[k], -s.phase_bits) : 0;
    if (!(step < s.tones[k - 1] / 2))
      fail(s, fmt::format("the tone of {} m cannot tell the periods of the one of {} m: with {} "
                          "phase-bits its steps are {:.3g} m",
                          s.tones[k], s.tones[k - 1], s.phase_bits, step));
  }
}

void check_pattern(const Scanner& s) {
  if (s.pattern != Pattern::mirror) {
    for (const auto& [name, value] :
         {std::pair{"encoder-jitter", s.encoder_jitter}, std::pair{"index-error", s.index_error},
          std::pair{"eccentricity", s.eccentricity}, std::pair{"wobble", s.wobble},
          std::pair{"mirror-tilt", s.mirror_tilt}, std::pair{"motion-jitter", s.motion_jitter},
          std::pair{"axis-tilt", s.axis_tilt}, std::pair{"lever", s.lever.norm()},
          std::pair{"mount", s.mount.norm()}})
      if (value != 0) fail(s, fmt::format("{} belongs to a mirror; this pattern has none", name));
  }
  if (s.pattern == Pattern::pinhole &&
      !(s.plane_field < 3 && std::abs(s.motion_start) < 1.5 && std::abs(s.motion_end) < 1.5))
    fail(s,
         "a pinhole sees less than 180 degrees: expected plane-field < 3 and motion-start, "
         "motion-end within 1.5");
  if (s.pattern == Pattern::risley) {
    // Light leaves the last face unless it is totally reflected; both wedges together bend most.
    const double bend = std::asin(std::min(1.0, s.refraction_index * std::sin(s.wedge_1))) +
                        std::asin(std::min(1.0, s.refraction_index * std::sin(s.wedge_2)));
    if (!(bend < std::numbers::pi / 2))
      fail(s, fmt::format("wedges of {} and {} rad reflect the light", s.wedge_1, s.wedge_2));
  }
}

}  // namespace

void check(const Scanner& scanner) {
  Scanner copy = scanner;
  fields(copy, FieldVisitor{[&]<class T>(const char* name, const T& v, const Range& range,
                                         const char*, const char*) {
           T read = v;
           read_named(name, value_text(v), [&] { read_value(value_text(v), range, read); });
         }});
  const double beams = static_cast<double>(scanner.plane_beams) * scanner.planes;
  if (!(beams * scanner.returns <= max_points))
    fail(scanner, fmt::format("expected plane-beams * planes * returns <= {}, found {}", max_points,
                              beams * scanner.returns));
  if (!(scanner.min_range < scanner.max_range))
    fail(scanner, fmt::format("expected min-range < max-range, found {} and {}", scanner.min_range,
                              scanner.max_range));
  if (scanner.sub_rays != 1 && scanner.sub_rays != static_cast<int>(few_sub_rays) &&
      scanner.sub_rays != static_cast<int>(all_sub_rays))
    fail(scanner, fmt::format("expected sub-rays 1, 7 or 19, found {}", scanner.sub_rays));
  if (scanner.ranging == RangingKind::phase && scanner.returns != 1)
    fail(scanner, "phase ranging has one return: expected returns = 1");
  check_tones(scanner);
  check_pattern(scanner);
}

}  // namespace minescan
