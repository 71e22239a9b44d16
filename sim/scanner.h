// SPDX-License-Identifier: MIT
// Laser scanners as plain numbers, and what one of them sees from one pose.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "core/pose.h"
#include "sim/raycaster.h"

namespace minescan {

/// How the plane that the mirror sweeps is moved between two sweeps.
enum class Motion {
  yaw,    // a vertical plane turns about the vertical axis
  pitch,  // a plane across the view direction tilts about the left axis
};
constexpr auto names_of(Motion) { return std::to_array<std::string_view>({"yaw", "pitch"}); }

/// The numbers of one scanner. A mirror sweeps a plane of `plane_beams` beams over `plane_field`;
/// `planes` such planes follow each other from `motion_start` to `motion_end`. Beams lie in the
/// middles of equal steps, none at the ends: 181 beams one degree apart have a field of 181
/// degrees.
///
/// Ranges are measured by the phase of two tones of modulated light. The coarse tone repeats every
/// `wrap_interval` and tells which period of the fine tone, `fine_interval` long, is the right one.
/// The defaults are a scanner without errors.
struct Scanner {
  std::string name = {};
  std::string description = {};

  // Where the beams go. Scanner frame: x forward, y left, z up.
  Motion motion = Motion::yaw;
  int plane_beams = 400;
  int planes = 360;
  double plane_field = 300 * degree;   // rad, about up (yaw) or forward (pitch)
  double motion_start = -90 * degree;  // rad; yaw to the left, pitch upwards
  double motion_end = 90 * degree;     // rad
  double beam_time = 1e-4;             // s from one beam to the next

  // What returns. The received amplitude is reflectance * cos(incidence) * g(R) with
  // g(R) = 1 - exp(-(defocus_range / R)^2): 1/R^2 far away, constant near by, where the receiver is
  // out of focus. 1 is a white plate at 1 m.
  double min_range = 0.5;      // m; true and measured
  double max_range = 100;      // m; true and measured
  double defocus_range = 9;    // m
  double amplitude_noise = 0;  // one sigma of each of the two components of the coarse tone
  double min_amplitude = 0;    // below it, noise included, the beam has no return

  // How well ranges are measured: sigma^2 = range_noise^2 + range_noise_growth^2 R^2 / (rho cos).
  double wrap_interval = 0;       // m; 0: ranges do not wrap
  double fine_interval = 0;       // m; 0: one tone
  double range_noise = 0;         // m
  double range_noise_growth = 0;  // m per m
  double cyclic_error = 0;        // m, amplitude; repeats with the fine tone (leaking light)

  // How well directions are known. Points are put on the nominal beam.
  double encoder_jitter = 0;  // rad, one sigma, mirror angle, each beam anew
  double index_error = 0;     // rad, constant error of the mirror angle
  double wobble = 0;          // rad, the beam leaves its plane by wobble * sin(mirror angle)

  bool fine_relief = true;  // whether relief finer than the mesh is there; see `scan`

  static constexpr double degree = 0.017453292519943295;  // rad
};

template <class Visitor>
void fields(Scanner& s, Visitor&& field) {
  field("motion", s.motion, "how the plane of beams moves between two sweeps");
  field("plane-beams", s.plane_beams, between(1, 1e6), "", "beams in a plane");
  field("planes", s.planes, between(1, 1e6), "", "planes in a scan");
  field("plane-field", s.plane_field, above_up_to(0, 6.3), "rad", "angle swept in a plane");
  field("motion-start", s.motion_start, between(-6.3, 6.3), "rad", "yaw or pitch at the start");
  field("motion-end", s.motion_end, between(-6.3, 6.3), "rad", "yaw or pitch at the end");
  field("beam-time", s.beam_time, not_negative, "s", "time from one beam to the next");
  field("min-range", s.min_range, not_negative, "m", "nothing nearer is reported");
  field("max-range", s.max_range, positive, "m", "nothing farther is reported");
  field("defocus-range", s.defocus_range, positive, "m",
        "the received light falls with the square of the range from about here on");
  field("amplitude-noise", s.amplitude_noise, not_negative, "",
        "noise of the received signal, 1 = amplitude of a white plate at 1 m");
  field("min-amplitude", s.min_amplitude, not_negative, "", "weaker beams have no return");
  field("wrap-interval", s.wrap_interval, not_negative, "m",
        "ranges are known up to multiples of this; 0: entirely");
  field("fine-interval", s.fine_interval, not_negative, "m",
        "period of the fine tone, of which weak signals take the wrong one; 0: no such errors");
  field("range-noise", s.range_noise, not_negative, "m",
        "a of the range noise a^2 + b^2 R^2 / (rho cos)");
  field("range-noise-growth", s.range_noise_growth, not_negative, "m/m", "b of the range noise");
  field("cyclic-error", s.cyclic_error, not_negative, "m", "error that repeats with the fine tone");
  field("encoder-jitter", s.encoder_jitter, between(0, 0.1), "rad", "noise of the mirror angle");
  field("index-error", s.index_error, between(-0.1, 0.1), "rad",
        "constant error of the mirror angle");
  field("wobble", s.wobble, between(-0.1, 0.1), "rad", "by how much beams leave their plane");
  field("fine-relief", s.fine_relief,
        "whether surfaces have the relief that their mesh leaves out");
}

/// Most beams of one scan: their arrays take about 8 GB.
inline constexpr double max_beams = 1e8;

/// How far fine relief may move a point along its beam, in its wavelengths (assumed). Beyond, at
/// grazing incidence, the beam would meet another wave before.
inline constexpr double fine_relief_reach = 2;

/// Throws std::invalid_argument unless every number is in the range `fields` states and they fit
/// each other.
void check(const Scanner& scanner);

/// The unit vector, in the scanner frame, in which beam `ring` of plane `column` nominally points.
Eigen::Vector3d beam_direction(const Scanner& scanner, int ring, int column);

/// Amplitude received from a surface, without noise; `reflectance` times `cosine` is what it sends.
double amplitude(const Scanner& scanner, double range, double reflectance, double cosine);

/// One sigma of the range noise, metres, at the same.
double range_sigma(const Scanner& scanner, double range, double reflectance, double cosine);

/// Scans from T_world_scanner, in which scanner and mine stand still. Beam i of the scan draws its
/// noise from stream i of `seed`, so the result does not depend on the number of threads. `scene`
/// is written into the result.
///
/// The beam goes where jitter, index error and wobble turn it, and true_range, incidence and
/// true_normal belong to that beam. The measured point is the measured range along the nominal
/// beam, for that is all an instrument knows, rounded to single precision as in files.
///
/// Relief comes in two parts. What the mesh shows is displacement: triangles that hide each other
/// and cast shadows. What is finer, where a material has `roughness` and `fine_slope`, is
/// statistical: one wave of gradient noise, anchored in the world and the same for all scans (their
/// seed does not matter), of RMS height `roughness` and mean-square wavelength 2 pi roughness /
/// fine_slope, so that its RMS slope along a line is `fine_slope`. Its height h where the beam
/// meets the triangle brings the surface nearer by h / cos(incidence), at most by fine_relief_reach
/// wavelengths; its slope tilts the normal, but never away from the scanner. So fine relief spreads
/// ranges and incidences as stone does, but hides nothing behind it, and the beam's footprint is a
/// point to it. true_range, incidence and true_normal include it.
///
/// throws  std::invalid_argument for a scanner that `check` refuses or a pose that is not finite
/// cost    1.2 to 1.5 times the time of bare Embree for scans of the paper's size, 1.2 times as
///         much where all surfaces have fine relief; 82 bytes per beam
Scan scan(const RayCaster& caster, const Scanner& scanner, const Pose& T_world_scanner,
          std::uint64_t seed, const std::string& scene);

/// All scanners known by name.
const std::vector<Scanner>& scanners();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Scanner& find_scanner(const std::string& name);

}  // namespace minescan
