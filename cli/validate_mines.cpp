// SPDX-License-Identifier: MIT
#include "cli/validate_mines.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/random.h"
#include "scenes/scene.h"
#include "scenes/scene_mesh.h"
#include "scenes/spectra.h"
#include "sim/scan.h"
#include "sim/scan_picture.h"

namespace minescan {
namespace {

// ---- rock

constexpr double edge = 0.1;  // m, of the drifts that are measured

RangeFinder range_finder(TriangleMesh mesh) {
  return [caster = RayCaster(std::move(mesh))](const Eigen::Vector3d& from,
                                               const Eigen::Vector3d& direction) {
    const std::optional<Hit> hit = caster.cast(from, direction, 0, 1000);
    return hit ? hit->range : std::numeric_limits<double>::quiet_NaN();
  };
}

// Of four drifts of 60 m.
DriftSpectra spectra(const RockOptions& rock, std::uint64_t seed) {
  constexpr std::uint64_t drifts = 4;
  return drift_spectra(rock, edge, drifts * (seed - 1) + 1, drifts, range_finder);
}

ValidationRow slope_row(const std::string& surface, double hurst, ReliefBand RockOptions::*band,
                        ProfileDensity DriftSpectra::*profiles) {
  return {{.name = fmt::format("relief of {}, H = {:g}", surface, hurst),
           .what = "slope of the power spectral density of profiles, waves of 0.4 to 3.3 m",
           .accepted = Interval{-(1 + 2 * hurst) - 0.1, -(1 + 2 * hurst) + 0.1},
           .source = "-(1 + 2 H) of a self-affine profile; +-0.1"},
          [=](std::uint64_t seed) {
            RockOptions rock = flat_rock();
            rock.*band = {.rms = 0.05, .hurst = hurst};
            return (spectra(rock, seed).*profiles).slope(4 * edge, 10.0 / 3, edge);
          }};
}

// The density of floors over that of the middle of their class at the same wave, the lowest or the
// highest in bands of half an octave from 10 to 0.3 m.
double floor_density(RoadClass road, bool highest, std::uint64_t seed) {
  constexpr double n0 = 0.1;  // cycles per metre, ISO 8608
  RockOptions rock = flat_rock();
  rock.floor_class = road;
  const DriftSpectra s = spectra(rock, seed);
  double result = highest ? 0 : std::numeric_limits<double>::infinity();
  for (double n = 0.1; n < 3.3; n *= std::sqrt(2.0)) {
    const double share = s.floor.smoothed(n, edge, 2) / (n0 * n0) / road_density(road);
    result = highest ? std::max(result, share) : std::min(result, share);
  }
  return result;
}

std::vector<ValidationRow> make_rock_rows() {
  std::vector<ValidationRow> rows = {
      slope_row("walls", 0.75, &RockOptions::wall, &DriftSpectra::wall),
      slope_row("walls", 0.5, &RockOptions::wall, &DriftSpectra::wall),
      slope_row("ceilings", 0.75, &RockOptions::ceiling, &DriftSpectra::ceiling)};
  for (const RoadClass road : {RoadClass::D, RoadClass::E})
    for (const bool highest : {false, true})
      rows.push_back({{.name = fmt::format("floor of class {}: {} density", value_text(road),
                                           highest ? "highest" : "lowest"),
                       .what = "of half-octave bands, waves of 0.3 to 10 m, over the middle of the "
                               "class",
                       .accepted = Interval{0.5, 2},
                       .source = "the borders of a class in ISO 8608"},
                      [=](std::uint64_t seed) { return floor_density(road, highest, seed); }});
  rows.push_back(
      {{.name = "distances in a rough mine",
        .what = "largest relative difference to a test of every triangle in double "
                "precision, 4000 rays",
        .accepted = Interval{0, 1e-5},
        .source = "Moeller and Trumbore 1997"},
       [](std::uint64_t seed) {
         const Scene scene = find_scene("tunnel").make({{"edge-length", "0.5"}}, seed);
         return brute_force_difference(RayCaster(mesh_of(scene)), {0.1, 0.2, 2}, 4000, seed);
       }});
  return rows;
}

// ---- scanners in mines

struct PresetMine {
  std::string scene;
  Settings settings;
  std::vector<std::string> scanners;  // none: all that no other row names
};
// The mines of the paper that its scanners were in. The loop has longer edges than it could have,
// which keeps it small; fine relief makes up for them.
const PresetMine mines[] = {{"junction", {}, {}},
                            {"tunnel", {}, {"optab-pitching"}},
                            {"kvarntorp-loop", {{"edge-length", "0.15"}}, {"sick-lms200-ptu"}}};

bool belongs(const std::string& scanner, const PresetMine& mine) {
  const auto named = [&](const PresetMine& m) {
    return std::find(m.scanners.begin(), m.scanners.end(), scanner) != m.scanners.end();
  };
  return mine.scanners.empty() ? std::none_of(std::begin(mines), std::end(mines), named)
                               : named(mine);
}

// What is known of the beams of a scanner.
struct KnownShares {
  std::string scanner;
  Interval returned;
  std::string returned_source;
  Interval outliers;
};
const KnownShares known_shares[] = {
    {"optab-yawing",
     {0.99 * 139642 / 144000, 1.01 * 139642 / 144000},
     "139 642 points in Magnusson et al. 2007, section 5.1, of 144 000 beams (assumed); +-1 %",
     {0.005, 0.01}},
    {"optab-pitching",
     {0.99 * 27500 / 28800, 1.01 * 27500 / 28800},
     "about 27 500 points in Magnusson et al. 2007, section 5.1, of 28 800 beams (assumed); +-1 %",
     {0.01, 0.02}}};

std::vector<Finding> share_findings(const Scan& scan) {
  const BeamShares shares = beam_shares(scan);
  const KnownShares* known = nullptr;
  for (const KnownShares& row : known_shares)
    if (row.scanner == scan.scanner) known = &row;
  const std::string unknown = "nothing published";
  std::vector<Finding> findings;
  const auto add = [&](const std::string& what, const std::string& how, double measured,
                       const std::optional<Interval>& accepted, const std::string& source) {
    findings.push_back({{.name = fmt::format("{} in {}: {}", scan.scanner, scan.scene, what),
                         .what = how,
                         .accepted = accepted,
                         .source = source},
                        measured});
  };
  add("beams that return", fmt::format("share of {} beams", scan.beams), shares.returned,
      known ? std::optional(known->returned) : std::nullopt,
      known ? known->returned_source : unknown);
  add("mixed pixels", fmt::format("share of {} points", scan.cloud.points.size()), shares.mixed, {},
      unknown);
  add("wrapped", "share of the points that lie beyond the ambiguity interval", shares.wrapped, {},
      unknown);
  add("gross outliers", "share of the points that took a wrong period of a tone", shares.outliers,
      known ? std::optional(known->outliers) : std::nullopt, known ? "assumed" : unknown);
  return findings;
}

}  // namespace

const std::vector<ValidationRow>& rock_rows() {
  static const std::vector<ValidationRow> rows = make_rock_rows();
  return rows;
}

void scan_presets(std::uint64_t seed, const std::function<void(const PresetScan&)>& take) {
  constexpr int picture_width = 1200;  // pixels
  for (const PresetMine& mine : mines) {
    const RayCaster caster(mesh_of(find_scene(mine.scene).make(mine.settings, seed)));
    for (const Scanner& scanner : scanners()) {
      if (!belongs(scanner.name, mine)) continue;
      // All three mines are open there; 2 m above the floor, as in the surveys of the table.
      const Pose T_world_scanner(Eigen::Translation3d(mine.scene == "tunnel" ? -2 : 0, 0, 2));
      const Scan seen = scan(caster, scanner, T_world_scanner,
                             derived_seed(seed, "scan of " + scanner.name), mine.scene);
      take({.scanner = scanner.name,
            .scene = mine.scene,
            .findings = share_findings(seen),
            .points = points_picture(seen, picture_width),
            .grid = seen.rings > 0
                        ? grid_picture(seen, scanner.motion == Motion::pitch, picture_width)
                        : Picture{}});
    }
  }
}

}  // namespace minescan
