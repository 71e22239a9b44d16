// SPDX-License-Identifier: MIT
// Laser scanners as plain numbers. How their beams go is sim/kinematics.h, how they measure ranges
// sim/ranging.h, and what one of them sees sim/scan.h.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "core/fields.h"

namespace minescan {

/// How the beams lie.
enum class Pattern {
  mirror,   // a turning mirror, or a fan of lasers, sweeps a plane
  pinhole,  // the pixels of a camera, all at once or one after the other
  risley,   // two turning wedges of glass draw a rosette
};
constexpr auto names_of(Pattern) {
  return std::to_array<std::string_view>({"mirror", "pinhole", "risley"});
}

/// How the head moves the plane of the mirror between two sweeps.
enum class Motion {
  none,   // a plane across the up axis stays where it is
  yaw,    // a vertical plane turns about the up axis
  pitch,  // a plane across the view direction tilts about the left axis
};
constexpr auto names_of(Motion) {
  return std::to_array<std::string_view>({"none", "yaw", "pitch"});
}

/// What is measured of the light.
enum class RangingKind {
  pulse,  // the time of flight of a pulse
  phase,  // the phases of tones that modulate continuous light
};
constexpr auto names_of(RangingKind) { return std::to_array<std::string_view>({"pulse", "phase"}); }

/// Most returns of one beam.
inline constexpr int max_returns = 3;

/// The numbers of one scanner; the defaults are one without errors. Scanner frame: x forward, y
/// left, z up, origin where the axes of head and mirror meet if `lever` is 0.
///
/// Beams come in planes: `planes` of them, each of `plane_beams` beams. Beams lie in the middles of
/// equal steps, none at the ends: 181 beams one degree apart have a field of 181 degrees.
struct Scanner {
  std::string name = {};
  std::string description = {};

  // Where the beams go.
  Pattern pattern = Pattern::mirror;
  Motion motion = Motion::yaw;
  int plane_beams = 400;  // pinhole: rows of pixels
  int planes = 360;       // pinhole: columns of pixels
  // Angles of the mirror are counted from up towards forward (yaw), or from forward to the left
  // (pitch, none); of a pinhole, rows from the top to the bottom.
  double plane_field = 300 * degree;   // rad
  double plane_centre = 0;             // rad, the middle of the field
  double motion_start = -90 * degree;  // rad; yaw to the left, pitch upwards; pinhole: the columns
  double motion_end = 90 * degree;     // rad
  // Mirror in the head, known to the instrument: the head turns about the scanner's origin, the
  // beams leave from `lever`, and the mirror's axes are turned by `mount` (rotation vector).
  Eigen::Vector3d lever = Eigen::Vector3d::Zero();  // m, head frame
  Eigen::Vector3d mount = Eigen::Vector3d::Zero();  // rad, head frame
  double wedge_1 = 0;                               // rad, angles of the prisms
  double wedge_2 = 0;                               // rad
  double rotor_1 = 0;                               // turns per second, of the prisms
  double rotor_2 = 0;                               // turns per second
  double refraction_index = 1.51;                   // of the prisms

  // When they go.
  double beam_time = 1e-4;  // s from one beam to the next
  double turn_time = 0;     // s from one sweep to the next; 0: plane_beams * beam_time
  int interlace = 1;        // sweeps for a plane: beam r is fired in sweep r mod interlace
  bool continuous = false;  // whether the head turns on during a sweep, or steps between two

  // What returns. The received amplitude is reflectance * cos(incidence) * g(R) with
  // g(R) = 1 - exp(-(defocus_range / R)^2): 1/R^2 far away, constant near by, where the receiver is
  // out of focus. 1 is a white plate at 1 m.
  double min_range = 0.5;        // m; true and measured
  double max_range = 100;        // m; true and measured
  double defocus_range = 9;      // m
  double min_amplitude = 0;      // below it, noise included, there is no return
  double saturation = 0;         // what the receiver takes at most; 0: any signal
  double fog_extinction = 0;     // 1/m; light is lost on both ways
  double dust_loss = 0;          // 1/m; share of the beams that a metre of dusty air swallows
  double spot = 0;               // m, diameter of the beam where it leaves (1/e^2 of the intensity)
  double divergence = 0;         // rad, full angle, along the sweep
  double divergence_across = 0;  // rad, across it; 0: the same
  int sub_rays = 1;              // 1, 7 or 19: how finely the footprint is sampled
  bool edge_test = true;         // whether 12 of 19 are only cast where the other 7 see an edge

  // Pulse: sigma = range_noise + range_noise_growth R, at most range_noise_max.
  // Phase: sigma^2 = range_noise^2 + range_noise_growth^2 R^2 / (rho cos) far away, and what
  // amplitude_noise adds.
  double range_noise = 0;         // m
  double range_noise_growth = 0;  // m per m
  double range_noise_max = 0;     // m; 0: no limit
  double quantisation = 0;        // m, step of reported ranges; 0: none
  double range_bias = 0;          // m, added to all ranges
  double range_scale = 0;         // m per m, added
  double warm_up = 0;             // m, added when switched on, falls exponentially
  double warm_up_time = 3600;     // s, within which it falls to 1 / e
  int returns = 1;                // pulse: reported per beam at most
  double pulse_length = 0.75;     // m; surfaces nearer to each other give one pulse
  double pulse_capture = 1;       // share of a pulse with which a surface is all that is seen

  // Phase: ranges from tones, each known up to multiples of its ambiguity interval, the finest
  // first; the last is the scanner's. Each coarser tone tells the period of the finer one.
  RangingKind ranging = RangingKind::pulse;
  std::vector<double> tones = {};        // m, Lambda = c / (2 f)
  std::vector<double> tone_depths = {};  // how deep each modulates the light; empty: all 1
  double amplitude_noise = 0;            // one sigma of each of the two components of a tone
  double leakage = 0;   // amplitude of light that reaches the receiver without leaving the scanner
  double harmonic = 0;  // m, error that repeats four times per period of the finest tone
  int phase_bits = 0;   // of the phases; 0: not rounded

  // How well directions are known. Points are put on the nominal beam. Only of mirrors.
  double encoder_jitter = 0;  // rad, one sigma, mirror angle, each beam anew
  double index_error = 0;     // rad, constant error of the mirror angle
  double eccentricity = 0;    // rad, error of the mirror angle: eccentricity * sin(mirror angle)
  double wobble = 0;          // rad, the beam leaves its plane by wobble * sin(mirror angle)
  double mirror_tilt = 0;     // rad, mirror off 45 degrees: beams leave their plane by twice that
  double motion_jitter = 0;   // rad, one sigma, angle of the head, each plane anew
  double axis_tilt = 0;       // rad, the head's axis leans, about forward (yaw) or up (pitch)

  bool fine_relief = true;  // whether relief finer than the mesh is there; see `scan`

  static constexpr double degree = 0.017453292519943295;  // rad
};

template <class Visitor>
void fields(Scanner& s, Visitor&& field) {
  const Range angle = between(-6.3, 6.3);
  const Range small_angle = between(-0.1, 0.1);
  const Range jitter = between(0, 0.1);
  field("pattern", s.pattern, "how the beams lie");
  field("motion", s.motion, "how the plane of beams moves between two sweeps");
  field("plane-beams", s.plane_beams, between(1, 1e6), "", "beams in a plane; rows of pixels");
  field("planes", s.planes, between(1, 1e6), "", "planes in a scan; columns of pixels");
  field("plane-field", s.plane_field, above_up_to(0, 6.3), "rad", "angle swept in a plane");
  field("plane-centre", s.plane_centre, angle, "rad",
        "middle of that angle, from up towards forward (yaw) or from forward to the left");
  field("motion-start", s.motion_start, angle, "rad", "yaw or pitch at the start");
  field("motion-end", s.motion_end, angle, "rad", "yaw or pitch at the end");
  field("lever", s.lever, between(-10, 10), "m", "where beams leave, from the head's axis");
  field("mount", s.mount, between(-3.2, 3.2), "rad", "rotation vector of the mirror in the head");
  field("wedge-1", s.wedge_1, between(0, 0.6), "rad", "angle of the first prism (risley)");
  field("wedge-2", s.wedge_2, between(0, 0.6), "rad", "angle of the second prism (risley)");
  field("rotor-1", s.rotor_1, between(-1e4, 1e4), "1/s", "turns of the first prism (risley)");
  field("rotor-2", s.rotor_2, between(-1e4, 1e4), "1/s", "turns of the second prism (risley)");
  field("refraction-index", s.refraction_index, between(1, 2), "", "of the prisms (risley)");
  field("beam-time", s.beam_time, not_negative, "s", "time from one beam to the next");
  field("turn-time", s.turn_time, not_negative, "s",
        "time from one sweep to the next; 0: that of its beams");
  field("interlace", s.interlace, between(1, 16), "",
        "sweeps for a plane: beam r is fired in sweep r mod interlace");
  field("continuous", s.continuous, "whether the head turns on during a sweep");
  field("min-range", s.min_range, not_negative, "m", "nothing nearer is reported");
  field("max-range", s.max_range, positive, "m", "nothing farther is reported");
  field("defocus-range", s.defocus_range, positive, "m",
        "the received light falls with the square of the range from about here on");
  field("min-amplitude", s.min_amplitude, not_negative, "",
        "weaker signals are no return; 1 = amplitude of a white plate at 1 m");
  field("saturation", s.saturation, not_negative, "", "stronger signals are cut; 0: none");
  field("fog-extinction", s.fog_extinction, between(0, 10), "1/m",
        "light lost per metre of air, on both ways");
  field("dust-loss", s.dust_loss, between(0, 10), "1/m",
        "share of the beams that a metre of dusty air swallows");
  field("spot", s.spot, between(0, 1), "m", "diameter of the beam where it leaves, 1/e^2");
  field("divergence", s.divergence, jitter, "rad", "full angle of the beam, 1/e^2");
  field("divergence-across", s.divergence_across, jitter, "rad",
        "the same across the sweep; 0: as along it");
  field("sub-rays", s.sub_rays, between(1, 19), "", "of the footprint: 1, 7 or 19");
  field("edge-test", s.edge_test, "whether 12 of 19 are cast only where the other 7 see an edge");
  field("ranging", s.ranging, "what is measured of the light");
  field("range-noise", s.range_noise, not_negative, "m",
        "a of the range noise a + b R (pulse), a^2 + b^2 R^2 / (rho cos) (phase)");
  field("range-noise-growth", s.range_noise_growth, not_negative, "m/m", "b of the range noise");
  field("range-noise-max", s.range_noise_max, not_negative, "m", "its limit (pulse); 0: none");
  field("quantisation", s.quantisation, not_negative, "m", "step of reported ranges; 0: none");
  field("range-bias", s.range_bias, between(-1, 1), "m", "added to all ranges");
  field("range-scale", s.range_scale, small_angle, "m/m", "share of the range that is added");
  field("warm-up", s.warm_up, between(-1, 1), "m", "error when switched on, dying away");
  field("warm-up-time", s.warm_up_time, positive, "s", "within which it falls to 1 / e");
  field("returns", s.returns, between(1, max_returns), "", "reported per beam at most (pulse)");
  field("pulse-length", s.pulse_length, not_negative, "m",
        "surfaces nearer to each other along the beam give one pulse");
  field("pulse-capture", s.pulse_capture, between(0.5, 1), "",
        "share of a pulse with which a surface is all that the receiver sees");
  field("tones", s.tones, between(0.01, 1e5), "m",
        "ambiguity intervals of the tones, the finest first (phase)");
  field("tone-depths", s.tone_depths, ratio, "", "how deep each tone modulates; empty: all 1");
  field("amplitude-noise", s.amplitude_noise, not_negative, "",
        "noise of each component of a tone's signal (phase)");
  field("leakage", s.leakage, not_negative, "",
        "amplitude of light that never left: ranges err with the period of a tone (phase)");
  field("harmonic", s.harmonic, not_negative, "m",
        "error that repeats four times per period of the finest tone (phase)");
  field("phase-bits", s.phase_bits, between(0, 24), "", "of phases; 0: not rounded (phase)");
  field("encoder-jitter", s.encoder_jitter, jitter, "rad", "noise of the mirror angle");
  field("index-error", s.index_error, small_angle, "rad", "constant error of the mirror angle");
  field("eccentricity", s.eccentricity, small_angle, "rad",
        "error of the mirror angle that goes with its sine");
  field("wobble", s.wobble, small_angle, "rad", "by how much beams leave their plane, with sine");
  field("mirror-tilt", s.mirror_tilt, small_angle, "rad",
        "mirror off 45 degrees: beams leave their plane by twice that");
  field("motion-jitter", s.motion_jitter, jitter, "rad", "noise of the head's angle, per plane");
  field("axis-tilt", s.axis_tilt, small_angle, "rad",
        "how the head's axis leans, about forward (yaw) or up (pitch)");
  field("fine-relief", s.fine_relief,
        "whether surfaces have the relief that their mesh leaves out");
}

/// Most points of one scan: their arrays take about 10 GB.
inline constexpr double max_points = 1e8;

/// Throws std::invalid_argument unless every number is in the range `fields` states and they fit
/// each other.
void check(const Scanner& scanner);

/// All scanners known by name.
const std::vector<Scanner>& scanners();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Scanner& find_scanner(const std::string& name);

}  // namespace minescan
