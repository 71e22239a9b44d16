// SPDX-License-Identifier: MIT
// A mine as data, as a survey sheet has it: drifts by their centre lines and sections, pillars,
// what was put into them, and how rough the rock is. `scene_of` makes a scene of it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/fields.h"
#include "scenes/implicit.h"
#include "scenes/named_parts.h"
#include "scenes/roughness.h"
#include "scenes/scene.h"
#include "scenes/things.h"

namespace minescan {

/// What closes the end of a drift: rough rock, or a flat face of cast concrete with sharp edges.
enum class End { rock, concrete };
constexpr auto names_of(End) { return std::to_array<std::string_view>({"rock", "concrete"}); }

/// How the points of a centre line are joined: by straight legs, or by a smooth curve through them
/// (centripetal Catmull-Rom spline).
enum class Course { straight, spline };
constexpr auto names_of(Course) { return std::to_array<std::string_view>({"straight", "spline"}); }

/// A drift (tunnel, passage, niche) with the section `width` x `height` around its centre line.
/// Drifts that overlap are one open space. It has either a line of its own or leaves another drift
/// at right angles. Each place of it belongs to the nearest point of its line: where a sloping
/// drift turns sharply, the floor on the inside of the bend has a step.
struct Drift {
  std::vector<Eigen::Vector3d> line = {};  // at floor level, from face to face
  Course course = Course::straight;
  std::string off = {};    // the drift it leaves, in place of a line
  double at = 0;           // where: metres along that drift's line
  Side side = Side::left;  // of that drift
  double length = 10;      // from that drift's wall to the face
  double width = 10;
  double height = 6;       // floor to ceiling in the middle
  double arch = 0;         // how much lower the ceiling is at the walls
  double cross_slope = 0;  // floor and ceiling rise to the left by this
  End start = End::rock;
  End end = End::rock;
};

template <class Visitor>
void fields(Drift& o, Visitor&& field) {
  field("line", o.line, between(-1e5, 1e5), "m", "centre line at floor level, from face to face");
  field("course", o.course, "how the points of the line are joined");
  field("off", o.off, "name of the drift it leaves at right angles, in place of a line");
  field("at", o.at, not_negative, "m", "where it leaves, along that drift's line");
  field("side", o.side, "to which side it leaves");
  field("length", o.length, above_up_to(0, 1e4), "m", "from that drift's wall to the face");
  field("width", o.width, between(1, 50), "m", "wall to wall");
  field("height", o.height, between(1, 30), "m", "floor to ceiling in the middle");
  field("arch", o.arch, between(0, 15), "m", "how much lower the ceiling is at the walls");
  field("cross-slope", o.cross_slope, between(-0.3, 0.3), "",
        "by how much floor and ceiling rise to the left");
  field("start", o.start, "the face at the first point; never of a drift that leaves another");
  field("end", o.end, "the face at the last point");
}

/// Rock left standing, from floor to ceiling.
struct Pillar {
  std::vector<Eigen::Vector3d> at = {{0, 0, 0}};  // one point, its middle
  double length = 4;
  double width = 4;
  double heading = 0;  // of its length, radians from the x axis
};

template <class Visitor>
void fields(Pillar& o, Visitor&& field) {
  field("at", o.at, between(-1e5, 1e5), "m", "its middle");
  field("length", o.length, between(0.5, 100), "m", "along its heading");
  field("width", o.width, between(0.5, 100), "m", "across");
  field("heading", o.heading, between(-7, 7), "rad", "from the x axis, to the left");
}

/// Rock surfaces of a sandstone mine blasted in rounds. Statistics of the walls are from natural
/// joints (Hurst exponent 0.6-0.9 up to metres) and sandstone at the scale of grains (0.46, Ponson
/// et al. 2006); the other figures are assumed, chosen for a mine with flat ceilings and fairly
/// straight walls.
struct RockOptions {
  ReliefBand wall = {.rms = 0.07, .hurst = 0.75, .fine_hurst = 0.5, .fine_below = 0.3};
  ReliefBand ceiling = {.rms = 0.015, .hurst = 0.75, .fine_hurst = 0.5, .fine_below = 0.3};
  ReliefBand concrete = {.rms = 0, .hurst = 0.75, .outer = 2};
  RoadClass floor_class = RoadClass::D;
  double floor_inner = 0.05;
  double floor_outer = 10;
  double bedding_step = 0.04;
  double bedding_plate = 2.5;
  double overbreak = 0.1;
  double overbreak_scale = 5;
  double round_length = 4;
  double look_out = 0.1;
  double half_cast_spacing = 0.7;
  double rock_density = 0.15;
  double rock_size = 0.3;
  double rut_depth = 0.03;
  double wet_share = 0;
  double puddle_share = 0;
  double corner_radius = 0.4;
};

template <class Visitor>
void fields(RockOptions& o, Visitor&& field) {
  const Range wavelength = between(0.005, 100);
  fields(o.wall, under("wall-", field));
  fields(o.ceiling, under("ceiling-", field));
  fields(o.concrete, under("concrete-", field));
  field("floor-class", o.floor_class, "roughness of the floor by ISO 8608; gravel roads: D, E");
  field("floor-inner", o.floor_inner, wavelength, "m", "shortest wavelength of the floor");
  field("floor-outer", o.floor_outer, wavelength, "m", "longest wavelength of the floor");
  field("bedding-step", o.bedding_step, between(0, 0.5), "m",
        "height of a bedding step of the ceiling");
  field("bedding-plate", o.bedding_plate, between(0.2, 50), "m",
        "size of the plates between steps");
  field("overbreak", o.overbreak, between(0, 0.2), "m",
        "how deep rock has come out of the walls beyond the outline, where it has, typically");
  field("overbreak-scale", o.overbreak_scale, between(2, 50), "m", "size of such places");
  field("round-length", o.round_length, between(0.5, 20), "m", "advance per blasting round");
  field("look-out", o.look_out, between(0, 0.3), "m",
        "by how much the walls widen over a round, to fall back at the next: a saw-tooth");
  field("half-cast-spacing", o.half_cast_spacing, between(0, 5), "m",
        "height between halves of drill holes in the walls, 5 cm wide; 0: none");
  field("rock-density", o.rock_density, between(0, 1), "1/m^2", "loose rocks on the floor");
  field("rock-size", o.rock_size, between(0, 1), "m", "the largest of them; the smallest: a third");
  field("rut-depth", o.rut_depth, between(0, 0.3), "m", "wheel ruts along the drifts");
  field("wet-share", o.wet_share, between(0, 0.95), "", "part of walls and ceiling that is wet");
  field("puddle-share", o.puddle_share, between(0, 0.5), "",
        "part of level floors under water, about; water fills the lowest places");
  field("corner-radius", o.corner_radius, between(0, 2), "m",
        "rounding where walls, ceiling and floor meet");
}

/// Drifts, pillars and things go by names, so that a configuration can change one of them.
struct Mine {
  std::map<std::string, Drift> drifts = {};
  std::map<std::string, Pillar> pillars = {};
  std::map<std::string, ThingRun> things = {};
  bool furnished = true;  // whether the things are there
  RockOptions rock = {};
};

template <class Visitor>
void fields(Mine& o, Visitor&& field) {
  for (auto& [name, drift] : o.drifts) fields(drift, under("drifts." + name + ".", field));
  for (auto& [name, pillar] : o.pillars) fields(pillar, under("pillars." + name + ".", field));
  for (auto& [name, run] : o.things) fields(run, under("things." + name + ".", field));
  field("furnished", o.furnished, "whether the things are there");
  fields(o.rock, field);
}

/// `mine` with the further drifts, pillars and things that `given` names ("drifts.NAME.width"),
/// at their defaults.
Mine with_names(Mine mine, const Settings& given);

/// The centre lines of all drifts at floor level, splines as short chords and drifts that leave
/// others in the world's frame. Throws std::invalid_argument for a drift that cannot be built.
std::vector<CentreLine> centre_lines(const Mine& mine);

/// The mine as a function of space with the relief that edges of `edge_length` can show, drawn by
/// `seed`: relief of wavelengths from two edges up displaces the surface, what is finer goes into
/// the materials' roughness. All relief belongs to the world, not to the mesh.
///
/// throws  std::invalid_argument for a mine without drifts, a drift without a line, that leaves
///         itself or turns back on itself, and for drifts that meet on different levels
ImplicitSurface surface_of(const Mine& mine, std::uint64_t seed, double edge_length);

/// The mine as a scene, seen from inside its longest drift.
Scene scene_of(const std::string& name, const Mine& mine, const MeshOptions& mesh,
               std::uint64_t seed);

}  // namespace minescan
