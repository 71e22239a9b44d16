// SPDX-License-Identifier: MIT
// What people put into mines: lights, bolts, pipes, cables, ducts, signs, vehicles. Each is a
// closed mesh of its own that hangs or stands just clear of the rough rock, wherever that is: it is
// looked for from the centre line towards ceiling, wall or floor.
//
// What finds no place is left out there: where there is no rock within 2 m behind the place of the
// drift's ceiling or wall (a pipe leaves out the lengths that would cross the mouth of a side
// passage), where the rock leaves no room within 1 m of it, and what would lie across a bend. Long
// things (cable, pipe, duct) go around bends, other things stay on their own leg's side of the
// plane that halves a bend. Runs know nothing of each other: their offsets and heights must differ
// by more than the things' sizes where both are present.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "scenes/implicit.h"

namespace minescan {

/// A drift's centre line at floor level, with the section around it.
struct CentreLine {
  std::string drift = {};
  std::vector<Eigen::Vector3d> points = {};  // 2 or more
  double width = 10;
  double height = 6;
};

/// Distance along the points of a line, metres. Throws std::invalid_argument, as all that takes a
/// line, unless it has two points or more, all finite, each beside the one before as seen from
/// above, and width and height > 0.
double length_of(const CentreLine& line);

/// A place on a line: x axis along it (horizontal), y to the left, z up, origin on the floor. `at`
/// is the distance along the line, held within it; at a bend the frame is that of the leg that
/// begins there. Throws std::invalid_argument for NaN.
Eigen::Isometry3d frame_on(const CentreLine& line, double at);

enum class Side { left, right };
constexpr auto names_of(Side) { return std::to_array<std::string_view>({"left", "right"}); }

/// Things of one kind, again and again along a drift: at from, from + every, ... up to `to`. Long
/// things reach from one such place to the next, or to `to` if that is nearer, but keep 1 m away
/// from the ends of the line, where rock may be. Zeros mean what is usual for the kind, but for
/// `from` and `offset`.
struct ThingRun {
  std::string kind = "light";  // a name in thing_kinds()
  std::string drift = {};      // name of the drift
  double from = 0;             // distance along its centre line, metres
  double to = 0;               // 0: to its end
  double every = 0;            // metres from one to the next; 0: usual
  Side side = Side::left;      // of the centre line
  double offset = 0;           // metres from the centre line; only what hangs or stands
  double height = 0;           // metres above the floor; only what is on walls; 0: usual. A sign
                               // hangs from the ceiling unless it has a height on a wall.
};

template <class Visitor>
void fields(ThingRun& o, Visitor&& field) {
  field("kind", o.kind, "light, bolts, cable, pipe, duct, sign or vehicle");
  field("drift", o.drift, "name of the drift");
  field("from", o.from, not_negative, "m", "distance along the drift of the first");
  field("to", o.to, not_negative, "m", "distance along the drift of the last; 0: to its end");
  field("every", o.every, between(0, 1e4), "m", "from one to the next; 0: usual for the kind");
  field("side", o.side, "of the centre line, seen along the drift");
  field("offset", o.offset, between(0, 50), "m", "from the centre line; what hangs or stands");
  field("height", o.height, between(0, 50), "m", "above the floor; what is on walls; 0: usual");
}

/// One row of the table of things.
struct ThingKind {
  std::string name = {};
  std::string description = {};
  double every = 6;   // usual distance from one to the next, metres
  double height = 0;  // usual height on a wall, metres; 0 for what is on none
  double least = 1;   // least distance from one to the next, metres: nearer ones would meet
  /// Adds the mesh of the one `at` metres along the line, or nothing if it finds no place.
  /// Materials are indices into mine_materials().
  std::function<void(TriangleMesh& mesh, const CentreLine& line, double at, const ThingRun& run,
                     const ImplicitSurface& rock, double clearance)>
      add = {};
};
/// All kinds. Their sizes and usual distances are assumed.
const std::vector<ThingKind>& thing_kinds();
/// The row called `name`. Throws std::invalid_argument with the known names.
const ThingKind& find_thing_kind(const std::string& name);

/// The things of `runs` whose place on the centre line lies in `region` (x and y; half open, so
/// that neighbouring regions share none), as one mesh with mine_materials().
///
/// rock       what they must keep clear of
/// clearance  metres between thing and rock: at least what triangles may differ from the rock
/// returns    closed pieces with all vertices in the open space, in the order of runs and places;
///            the same bytes for any number of threads
/// throws     std::invalid_argument for an unknown kind or drift (with the known names), or a run
///            that does not fit: numbers out of the ranges of `fields`, from or `to` beyond the
///            drift's length, to < from, `every` below the kind's least, an offset of half the
///            drift's width or more, a height of the drift's or more
/// cost       calls of the rock's functions, measured: about 120 for a bolt (340 for clearances of
///            2 cm), 600 to 2000 for a metre of pipe, cable or duct
TriangleMesh things_in(const std::vector<ThingRun>& runs, const std::vector<CentreLine>& lines,
                       const ImplicitSurface& rock, double clearance,
                       const Eigen::AlignedBox2d& region);

}  // namespace minescan
