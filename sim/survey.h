// SPDX-License-Identifier: MIT
// Surveys: where a scanner stands in which mine, and which pairs of its scans are to be registered.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "core/pose.h"
#include "sim/raycaster.h"
#include "sim/scanner.h"

namespace minescan {

/// One place to scan from.
struct Station {
  std::string scanner = {};  // name in scanners()
  Settings settings = {};    // fields of the scanner that differ from its row
  Pose T_world_scanner = Pose::Identity();
};

/// Indices of two stations; the source is registered to the target.
struct StationPair {
  std::size_t target = 0;
  std::size_t source = 1;
};

struct Survey {
  std::string name = {};
  std::string description = {};
  std::string scene = {};        // name in scenes()
  Settings scene_settings = {};  // fields of the scene that differ from its defaults
  std::vector<Station> stations = {};
  std::vector<StationPair> pairs = {};
  // One sigma of what the vehicle's odometry errs by from one station to the next, per axis. The
  // pairs' start poses in a data set come from it.
  double odometry_translation = 0.12;  // metres; the size of error in section 5.1 of the paper
  double odometry_rotation = 0.02;     // radians
};

/// All surveys known by name.
const std::vector<Survey>& surveys();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Survey& find_survey(const std::string& name);

/// The scanner that stands there: its row with the station's settings. Throws std::invalid_argument
/// for an unknown scanner or a wrong setting.
Scanner station_scanner(const Station& station);

/// Throws std::invalid_argument, naming the station, for one that cannot be scanned from or a pair
/// of stations that are not there.
void check(const Survey& survey);

/// The scans of all stations, in order, each handed to `take` when it is done and kept no longer.
/// `caster_at` gives what station i's rays meet. Station i uses derived_seed(seed, "scan i").
void run_survey(const Survey& survey,
                const std::function<RayCaster(std::size_t station)>& caster_at, std::uint64_t seed,
                const std::function<void(std::size_t station, Scan scan)>& take);

/// The same in one mesh, all kept.
std::vector<Scan> run_survey(const Survey& survey, const TriangleMesh& mesh, std::uint64_t seed);

}  // namespace minescan
