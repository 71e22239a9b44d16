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
      .beam_time = 40e-6,      // assumed
      .min_range = 0.5,        // assumed
      .max_range = 100,        // assumed: two wraps, beyond which nothing returns anyway
      .defocus_range = 9,      // assumed, 8 to 10 m
      .wrap_interval = 48,     // assumed: tones of 3.125 and 31.25 MHz; Lambda = c / 2f
      .fine_interval = 4.8,    // assumed, the same
      .range_noise = 0.006,    // assumed, with its growth: 8 to 15 mm at 10 m on dry rock
      .cyclic_error = 0.005,   // assumed
      .encoder_jitter = 3e-4,  // assumed
      .index_error = 2e-3,     // assumed
      .wobble = 5e-4,          // assumed
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
  yawing.amplitude_noise = 0.01;       // assumed: 0.5 to 1 % of the points take a wrong period
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
  pitching.amplitude_noise = 0.019;   // assumed, a worse signal: 1 to 2 % take a wrong period
  pitching.range_noise_growth = 0.0006;

  // The same beams without any error, to tell what noise does from what geometry does.
  Scanner ideal;
  ideal.name = "ideal-yawing";
  ideal.description = "the beams of optab-yawing without any error";

  return {yawing, pitching, ideal};
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

std::vector<Survey> make_surveys() {
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
       .pairs = {{.target = 0, .source = 1}}},
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
