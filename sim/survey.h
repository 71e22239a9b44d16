// SPDX-License-Identifier: MIT
// Surveys: where a scanner stands in which mine, and which pairs of its scans are to be registered.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "core/pose.h"
#include "sim/odometry.h"
#include "sim/raycaster.h"
#include "sim/route.h"
#include "sim/scanner.h"
#include "sim/trajectory.h"
#include "sim/vehicle.h"

namespace minescan {

/// One scan: from where, with what, and when it begins.
struct Station {
  std::string scanner = {};  // name in scanners()
  Settings settings = {};    // fields of the scanner that differ from its row
  Pose T_world_scanner = Pose::Identity();
  double time = 0;  // seconds since the instrument was switched on
};

/// Indices of two stations; the source is registered to the target.
struct StationPair {
  std::size_t target = 0;
  std::size_t source = 1;
};

/// A vehicle that drives through the mine and scans, standing or on its way.
struct Drive {
  std::vector<std::string> along = {};     // names of drifts whose centre lines it follows
  std::vector<Eigen::Vector3d> line = {};  // or points at floor level, metres
  std::string path_file = {};              // or where `path` comes from:
  Trajectory path = {};                    // T_world_scanner; it scans while it moves along it
  bool closed = false;                     // round and round
  int scans = 10;
  double step_min = 4;                      // m, from one scan to the next; section 5.1 of
  double step_max = 5;                      // the paper
  bool moving = false;                      // whether it drives on while it scans
  std::string scanner = "sick-lms200-ptu";  // name in scanners()
  Settings settings = {};                   // fields of the scanner that differ from its row
  VehicleOptions vehicle = {};
};

template <class Visitor>
void fields(Drive& o, Visitor&& field) {
  field("along", o.along, "names of the drifts whose centre lines it follows, in driving order");
  field("line", o.line, between(-1e5, 1e5), "m", "points at floor level, in place of drifts");
  field("path", o.path_file,
        "file of lines 'time tx ty tz qx qy qz qw', T_world_scanner, in place of drifts; the scans "
        "are spread evenly over its time");
  field("closed", o.closed, "whether it goes round, from the last drift or point to the first");
  field("scans", o.scans, between(1, 1e5), "", "scans on the way");
  field("step-min", o.step_min, above_up_to(0, 1000), "m", "from one scan to the next at least");
  field("step-max", o.step_max, above_up_to(0, 1000), "m", "at most");
  field("moving", o.moving, "whether it drives on while it scans");
}

/// Where the start poses of a data set's pairs come from.
enum class Guess {
  normal,         // the truth with normal errors
  odometry,       // the vehicle's odometry: planar, with slips
  total_station,  // an instrument that measures marks on the scanner
};
constexpr auto names_of(Guess) {
  return std::to_array<std::string_view>({"normal", "odometry", "total-station"});
}

struct Survey {
  std::string name = {};
  std::string description = {};
  std::string scene = {};              // name in scenes()
  Settings scene_settings = {};        // fields of the scene that differ from its defaults
  std::vector<Station> stations = {};  // without a drive
  std::optional<Drive> drive = {};     // the stations come from it
  Trajectory trajectory = {};          // T_world_scanner while it scans; empty: it stands
  std::vector<StationPair> pairs = {};
  Guess guess = Guess::normal;
  // One sigma of normal errors from one station to the next, per axis.
  double odometry_translation = 0.12;  // metres; the size of error in section 5.1 of the paper
  double odometry_rotation = 0.02;     // radians
  OdometryOptions odometry = {};
  TotalStationOptions total_station = {};
};

/// What can be set beside scene, stations and drive.
template <class Visitor>
void fields(Survey& o, Visitor&& field) {
  field("guess", o.guess, "where the start poses of pairs come from");
  field("odometry-translation", o.odometry_translation, between(0, 100), "m",
        "normal: errors per axis from one station to the next, one sigma");
  field("odometry-rotation", o.odometry_rotation, between(0, 3), "rad",
        "normal: errors about each axis, one sigma");
  fields(o.odometry, under("odometry.", field));
  fields(o.total_station, under("total-station.", field));
}

/// All surveys known by name.
const std::vector<Survey>& surveys();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Survey& find_survey(const std::string& name);

/// The scanner that stands there: its row with the station's settings. Throws std::invalid_argument
/// for an unknown scanner or a wrong setting.
Scanner station_scanner(const Station& station);

/// The height of what a ray straight down from `from` meets, or none.
std::optional<double> height_below(const RayCaster& caster, const Eigen::Vector3d& from);

/// Centre lines of drifts by name: points at floor level, metres.
using DriftLines = std::map<std::string, std::vector<Eigen::Vector3d>>;

/// About where the scans of a survey are taken, metres: before there is ground to stand on. Throws
/// std::invalid_argument for a drive that cannot be (an unknown drift, lines that do not meet, a
/// route that is too short).
std::vector<Eigen::Vector3d> planned_places(const Survey& survey, const DriftLines& lines,
                                            std::uint64_t seed);

/// The survey with a vehicle standing on the ground at each stop of its drive: its stations and,
/// for a moving one, its trajectory. One without a drive stays as it is, its scans a minute apart
/// (assumed). Throws std::invalid_argument too for a moving scanner that is not done by the next
/// stop, and std::runtime_error where there is no ground.
Survey driven(const Survey& survey, const DriftLines& lines, const Ground& ground,
              std::uint64_t seed);

/// T_world_scanner of all stations as they are believed, after `survey.guess`; `T_world_scanner`
/// are the true ones. The guess for a pair is believed_target^-1 * believed_source.
std::vector<Pose> believed_poses(const Survey& survey, std::uint64_t seed);

/// Throws std::invalid_argument, naming the station, for one that cannot be scanned from or a pair
/// of stations that are not there.
void check(const Survey& survey);

/// The scans of all stations, in order, each handed to `take` when it is done and kept no longer.
/// `caster_at` gives what station i's rays meet. Station i uses derived_seed(seed, "scan i"). A
/// drive has been `driven` before.
void run_survey(const Survey& survey,
                const std::function<RayCaster(std::size_t station)>& caster_at, std::uint64_t seed,
                const std::function<void(std::size_t station, Scan scan)>& take);

/// The same in one mesh, all kept; a drive goes along its own `line`, on the ground of the mesh.
std::vector<Scan> run_survey(const Survey& survey, const TriangleMesh& mesh, std::uint64_t seed);

}  // namespace minescan
