// SPDX-License-Identifier: MIT
// The tables: scanners and surveys known by name.
#include <Eigen/Geometry>
#include <string>

#include "core/table.h"
#include "sim/scanner.h"
#include "sim/survey.h"

namespace minescan {
namespace {

constexpr double degree = Scanner::degree;

// The Optab prototype of section 5.1 of the paper, a phase-shift scanner. The paper tells how it
// moved, that the tunnel's floor was not visible, and the numbers of points, which the amplitude
// thresholds reproduce in our mines within 1 %. Everything else is assumed, chosen such that the
// points show disturbances of the kind seen in the paper's Figure 8.
Scanner optab() {
  return {
      .beam_time = 40e-6,    // assumed
      .min_range = 0.5,      // assumed
      .max_range = 100,      // assumed: two wraps, beyond which nothing returns anyway
      .defocus_range = 9,    // assumed, 8 to 10 m
      .spot = 0.004,         // assumed
      .divergence = 0.001,   // assumed
      .sub_rays = 19,        // footprint in full
      .range_noise = 0.006,  // assumed, with its growth: 8 to 15 mm at 10 m on dry rock
      .ranging = RangingKind::phase,
      .tones = {4.8, 48},         // assumed: 31.25 and 3.125 MHz; Lambda = c / 2f
      .tone_depths = {1, 0.165},  // assumed, with the noise: 0.5 to 2 % take a wrong period
      .leakage = 8e-4,            // assumed: a cyclic error of 5 mm on dry rock at 10 m
      .phase_bits = 14,           // assumed, 12 to 16
      .encoder_jitter = 3e-4,     // assumed
      .index_error = 2e-3,        // assumed
      .wobble = 5e-4,             // assumed
  };
}

std::vector<Scanner> make_scanners() {
  Scanner yawing = optab();
  yawing.name = "optab-yawing";
  yawing.description = "phase-shift scanner, vertical planes, yawing: the paper's JUNCTION";
  yawing.motion = Motion::yaw;
  yawing.plane_beams = 400;  // assumed, with planes: 144 000 beams for 139 642 points
  yawing.planes = 360;
  yawing.plane_field = 300 * degree;   // assumed
  yawing.motion_start = -90 * degree;  // assumed, with its end
  yawing.motion_end = 90 * degree;
  yawing.min_amplitude = 0.04;         // chosen for those points
  yawing.amplitude_noise = 0.0012;     // assumed: 0.5 to 1 % of the points take a wrong period
  yawing.range_noise_growth = 0.0004;  // assumed

  Scanner pitching = optab();
  pitching.name = "optab-pitching";
  pitching.description = "phase-shift scanner, tilted up from the horizontal: the paper's TUNNEL";
  pitching.motion = Motion::pitch;
  pitching.plane_beams = 160;  // assumed, with planes: 28 800 beams for 27 500 points
  pitching.planes = 180;
  pitching.plane_field =
      220 * degree;           // assumed: with 10 degrees more, the last planes see the floor
  pitching.motion_start = 0;  // the first plane is horizontal
  pitching.motion_end = 90 * degree;  // assumed
  pitching.min_amplitude = 0.06;      // chosen for those points
  pitching.amplitude_noise = 0.0023;  // assumed, a worse signal: 1 to 2 % take a wrong period
  pitching.range_noise_growth = 0.0006;

  // The same beams without any error, to tell what noise does from what geometry does.
  Scanner ideal;
  ideal.name = "ideal-yawing";
  ideal.description = "the beams of optab-yawing without any error";

  // The scanner of the paper's KVARNTORP-LOOP, section 5.1: a SICK LMS 200 on a pan-tilt unit.
  // Range noise, equal readings and mixed pixels are those measured on logs of stationary scanners;
  // what else is not measured is a value from data sheets, from memory, or assumed.
  Scanner lms{
      .name = "sick-lms200-ptu",
      .description = "SICK LMS 200 on a tilting head: the paper's KVARNTORP-LOOP",
      .motion = Motion::pitch,
      .plane_beams = 181,  // with planes: 95 025 beams; 525 lines of 0.162 degrees are assumed
      .planes = 525,
      .plane_field = 181 * degree,  // 180 degrees from the first to the last beam
      .motion_start = 30 * degree,  // to 55 degrees down, as a real scan of this kind
      .motion_end = -55 * degree,
      .lever = {0.05, 0, 0.10},       // assumed
      .beam_time = 1 / (75.0 * 360),  // 75 turns per second
      .turn_time = 1 / 75.0,
      .min_range = 0.1,         // assumed
      .max_range = 32.767,      // 15 bits of millimetres
      .min_amplitude = 0.0013,  // assumed: 10 % reflectance at 80 m
      .spot = 0.008,            // from memory, with its divergence
      .divergence = 0.0044,
      .sub_rays = 19,
      .range_noise = 0.0021,          // the straight line through 2.5, 3.8, 4.4 and 5.2 mm, as
      .range_noise_growth = 0.00046,  // measured at 1-2, 2-4, 4-6 and 6-8 m
      .range_noise_max = 0.010,
      .quantisation = 0.001,  // mm mode
      .range_bias = 0.010,    // assumed; data sheet: within 15 mm
      .warm_up = 0.005,       // from memory
      .pulse_length = 4,      // assumed, with its capture: measured are 0.22 to 0.29
      .pulse_capture = 0.77,  // mixed pixels per jump, half-way in the median
      .motion_jitter = 1e-4,  // assumed
  };

  // A modern phase scanner of the kind of a FARO Focus: every fourth point of every fourth line.
  Scanner tls{
      .name = "tls-phase",
      .description = "modern phase scanner on a tripod, 2.7 million beams",
      .plane_beams = 2131,
      .planes = 1280,
      .plane_field = 305 * degree,
      .motion_start = 0,
      .motion_end = 180 * degree,
      .beam_time = 4 / 976e3,  // 976 000 points per second
      .turn_time = 1 / 97.0,   // 97 turns per second
      .continuous = true,
      .min_range = 0.6,
      .max_range = 76,
      .defocus_range = 3,     // assumed: the noise law holds from there on
      .min_amplitude = 4e-5,  // assumed: 10 % reflectance at 100 m
      .spot = 0.00225,
      .divergence = 0.00019,
      .sub_rays = 19,
      .range_noise = 0.0006,            // with its growth: measured 0.60 and 0.96 mm at 10 and 25 m
      .range_noise_growth = 0.0000273,  // on 90 %, within 13 %
      .ranging = RangingKind::phase,
      .tones = {1.1991698, 9.6087, 76.088},  // 125, 15.6 and 1.97 MHz
      .phase_bits = 16,                      // assumed
      .encoder_jitter = 20e-6,
  };

  // A camera whose pixels measure phases: the full frame at video rate of the paper's outlook.
  Scanner flash{
      .name = "flash-3d",
      .description = "time-of-flight camera, a full frame at once",
      .pattern = Pattern::pinhole,
      .plane_beams = 144,
      .planes = 176,
      .plane_field = 34.6 * degree,
      .motion_start = 21.8 * degree,  // columns from left to right
      .motion_end = -21.8 * degree,
      .beam_time = 0,
      .min_range = 0.3,        // assumed
      .max_range = 30,         // assumed: four wraps
      .defocus_range = 3,      // assumed
      .min_amplitude = 0.002,  // assumed
      .divergence = 0.0043,    // a pixel
      .sub_rays = 19,
      .range_noise = 0.004,  // with its growth: 4 to 6 mm in the middle of a frame
      .range_noise_growth = 0.0006,
      .ranging = RangingKind::phase,
      .tones = {7.4948},  // 20 MHz
      .phase_bits = 14,   // assumed
  };

  // Spinning scanners of 16 and 128 lasers. Beam shapes are from memory.
  Scanner spin_16{
      .name = "spin-16",
      .description = "spinning scanner, 16 lasers, one turn",
      .plane_beams = 16,
      .planes = 1808,               // 55.3 us each, 10 turns per second
      .plane_field = 32 * degree,   // from 15 degrees up to 15 down
      .plane_centre = 90 * degree,  // the horizon
      .motion_start = 180 * degree,
      .motion_end = -180 * degree,  // clockwise from above
      .beam_time = 2.304e-6,
      .turn_time = 55.296e-6,
      .continuous = true,
      .min_range = 0.5,
      .max_range = 100,
      .min_amplitude = 8e-4,  // assumed: 10 % reflectance at 100 m
      .spot = 0.010,
      .divergence = 0.003,
      .divergence_across = 0.0015,
      .sub_rays = 19,
      .range_noise = 0.03,
      .quantisation = 0.002,
      .returns = 2,
      .pulse_length = 1,  // assumed
  };
  Scanner spin_128{
      .name = "spin-128",
      .description = "spinning scanner, 128 lasers, one turn",
      .plane_beams = 128,
      .planes = 1024,
      .plane_field = 45 * degree * 128 / 127,  // 45 degrees from the first to the last laser
      .plane_centre = 90 * degree,
      .motion_start = 180 * degree,
      .motion_end = -180 * degree,
      .beam_time = 0,
      .turn_time = 0.1 / 1024,  // 10 turns per second
      .continuous = true,
      .min_range = 0.3,
      .max_range = 120,
      .min_amplitude = 6e-4,  // assumed: 10 % reflectance at 120 m
      .spot = 0.0095,
      .divergence = 0.006,
      .sub_rays = 19,
      .range_noise = 0.01,  // to 5 cm far away
      .range_noise_growth = 0.0004,
      .range_noise_max = 0.05,
      .quantisation = 0.001,
      .returns = 2,
      .pulse_length = 1,  // assumed
  };

  // Two turning prisms, of the kind of a Livox Mid-40; one second of points.
  Scanner rosette{
      .name = "rosette",
      .description = "two turning prisms, a rosette that fills up, one second",
      .pattern = Pattern::risley,
      .plane_beams = 1000,
      .planes = 100,
      .wedge_1 = 18.7481 * degree,
      .wedge_2 = 17.9634 * degree,
      .rotor_1 = -121.5657,
      .rotor_2 = 77.7430,
      .refraction_index = 1.51,
      .beam_time = 1e-5,  // 100 000 points per second
      .min_range = 1,     // from memory
      .max_range = 90,
      .min_amplitude = 1e-3,  // assumed: 10 % reflectance at 90 m
      .spot = 0.01,           // assumed
      .divergence = 0.03 * degree,
      .divergence_across = 0.28 * degree,
      .sub_rays = 19,
      .range_noise = 0.02,  // at 20 m
      .quantisation = 0.001,
      .pulse_length = 1,  // assumed
  };

  return {yawing, pitching, lms, tls, flash, spin_16, spin_128, rosette, ideal};
}

Pose at(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

// Through a grid of rooms and pillars, 2 km: out along the first drift, over to the last one and
// back. A scan at every crossing.
Survey room_and_pillar() {
  constexpr int rows = 4, columns = 50;
  constexpr double spacing = 20;  // metres
  Survey survey{
      .name = "room-and-pillar",
      .description = "2 km through a room-and-pillar mine, 103 scans 20 m apart",
      .scene = "room-and-pillar",
      .scene_settings = {
          {"rows", std::to_string(rows)}, {"columns", std::to_string(columns)}, {"jitter", "0"}}};
  const auto stop = [&](int column, int row, double heading) {
    Pose T = at(spacing * column, spacing * row, 2);
    T.rotate(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()));
    survey.stations.push_back({.scanner = "optab-yawing",
                               .settings = {{"plane-beams", "200"},
                                            {"planes", "180"},
                                            // Beyond, nothing comes back that can be told from
                                            // noise.
                                            {"max-range", "50"}},
                               .T_world_scanner = T});
  };
  for (int column = 0; column < columns; ++column) stop(column, 0, 0);
  for (int row = 1; row < rows; ++row) stop(columns - 1, row, 90 * degree);
  for (int column = columns - 2; column >= 0; --column) stop(column, rows - 1, 180 * degree);
  for (std::size_t k = 1; k < survey.stations.size(); ++k)
    survey.pairs.push_back({.target = k - 1, .source = k});
  return survey;
}

// The loop of the paper's section 5.1: steps of 4 to 5 m round about 330 m, scans 16 to 66 used, so
// 50 pairs. How many there were is not told.
Survey kvarntorp_loop() {
  Survey survey{
      .name = "kvarntorp-loop",
      .description = "the paper's KVARNTORP-LOOP: 80 scans round a loop of 330 m, 50 pairs",
      .scene = "kvarntorp-loop",
      .drive = Drive{.along = {"south", "link-east", "north-east", "north-west", "link-west"},
                     .closed = true,
                     .scans = 80},
      .guess = Guess::odometry,
  };
  for (std::size_t k = 16; k < 66; ++k) survey.pairs.push_back({.target = k, .source = k + 1});
  return survey;
}

std::vector<Survey> make_surveys() {
  // The paper's outlook: scans while driving, slowly enough that one of 7 s is done by the next.
  Survey moving = kvarntorp_loop();
  moving.name = "kvarntorp-loop-moving";
  moving.description = "the same, scanned without stopping: 80 scans that the motion distorts";
  moving.drive->moving = true;

  return {
      // Section 5.1 of the paper: two scans of different resolution from one place. The numbers of
      // beams are assumed, for 72 417 and 139 642 points. The scanner's height is assumed.
      {.name = "junction",
       .description = "the paper's JUNCTION: a coarse and a fine scan from one place",
       .scene = "junction",
       .stations = {{.scanner = "optab-yawing",
                     .settings = {{"plane-beams", "300"}, {"planes", "250"}},
                     .T_world_scanner = at(0, 0, 2)},
                    {.scanner = "optab-yawing", .T_world_scanner = at(0, 0, 2)}},
       .pairs = {{.target = 0, .source = 1}}},
      // Section 5.1 of the paper: two scans about 4 m apart.
      {.name = "tunnel",
       .description = "the paper's TUNNEL: two scans 4 m apart along a plain tunnel",
       .scene = "tunnel",
       .stations = {{.scanner = "optab-pitching", .T_world_scanner = at(-2, 0, 2)},
                    {.scanner = "optab-pitching", .T_world_scanner = at(2, 0, 2)}},
       .pairs = {{.target = 0, .source = 1}},
       // Section 5.1: marks on the scanner, seen from an instrument with a fixed place.
       .guess = Guess::total_station},
      kvarntorp_loop(),
      moving,
      room_and_pillar(),
  };
}

}  // namespace

const std::vector<Scanner>& scanners() {
  static const std::vector<Scanner> rows = make_scanners();
  return rows;
}
const Scanner& find_scanner(const std::string& name) {
  return find_row(scanners(), "scanner", name);
}

const std::vector<Survey>& surveys() {
  static const std::vector<Survey> rows = make_surveys();
  return rows;
}
const Survey& find_survey(const std::string& name) { return find_row(surveys(), "survey", name); }

}  // namespace minescan
