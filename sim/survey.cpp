// SPDX-License-Identifier: MIT
#include "sim/survey.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>
#include <utility>

#include "core/random.h"
#include "core/text.h"
#include "sim/kinematics.h"
#include "sim/scan.h"

namespace minescan {
namespace {

// Seconds between the starts of two scans without a drive: a vehicle that stops, scans for half a
// minute and drives on (assumed).
constexpr double scan_interval = 60;

Scanner drive_scanner(const Drive& drive) {
  return with_settings(find_scanner(drive.scanner), drive.settings);
}

Route route_of(const Drive& drive, const DriftLines& lines) {
  if (drive.along.empty() == drive.line.empty())
    throw std::invalid_argument(
        "drive: expected one of drifts (along), points (line) or a file of poses (path)");
  std::vector<Eigen::Vector3d> points = drive.line;
  if (!drive.along.empty()) {
    std::vector<std::vector<Eigen::Vector3d>> chosen;
    for (const std::string& name : drive.along) {
      const auto found = lines.find(name);
      if (found == lines.end()) {
        std::vector<std::string> known;
        for (const auto& [drift, line] : lines) known.push_back(drift);
        throw std::invalid_argument("drive: " + unknown_name("drift", name, known));
      }
      chosen.push_back(found->second);
    }
    points = joined_lines(chosen, drive.closed);
  }
  return Route(points, drive.closed, drive.vehicle.turn_radius);
}

std::vector<double> stops_of(const Drive& drive, const Route& route, std::uint64_t seed) {
  return stops(route, drive.step_min, drive.step_max, static_cast<std::size_t>(drive.scans), seed);
}

// When the scans along a given path begin.
std::vector<double> starts_on_path(const Drive& drive) {
  check(drive.path);
  const double duration = Kinematics(drive_scanner(drive)).duration();
  const double first = drive.path.times.front();
  const double time = drive.path.times.back() - first;
  if (!(time >= drive.scans * duration))
    throw std::invalid_argument(
        fmt::format("drive: {} scans of {:.3g} s take longer than the {:.3g} s of the path {}",
                    drive.scans, duration, time, drive.path_file));
  std::vector<double> starts;
  for (int k = 0; k < drive.scans; ++k)
    starts.push_back(first + (drive.scans > 1 ? (time - duration) * k / (drive.scans - 1) : 0));
  return starts;
}

// Scans while driving: the path from the first stop to where the last scan ends.
void drive_through(Survey& survey, const Drive& drive, const Route& route,
                   const std::vector<double>& halts, const Ground& ground) {
  const double speed = drive.vehicle.speed;
  const double scan_length = Kinematics(drive_scanner(drive)).duration() * speed;
  for (std::size_t k = 1; k < halts.size(); ++k)
    if (!(halts[k] - halts[k - 1] >= scan_length))
      throw std::invalid_argument(fmt::format(
          "drive: a scan takes {:.3g} m at {} m/s; expected steps of at least that, found {:.3g} m",
          scan_length, speed, halts[k] - halts[k - 1]));
  survey.trajectory =
      minescan::drive(drive.vehicle, ground, route, halts.front(), halts.back() + scan_length);
  const SmoothPath path(survey.trajectory);
  for (std::size_t k = 0; k < halts.size(); ++k) {
    survey.stations[k].time = (halts[k] - halts.front()) / speed;
    survey.stations[k].T_world_scanner = path.at(survey.stations[k].time);
  }
}

// The truth with normal errors of each step, in its own frame.
std::vector<Pose> normal_errors(const Survey& survey, std::uint64_t seed) {
  std::vector<Pose> believed;
  for (std::size_t k = 0; k < survey.stations.size(); ++k) {
    const Pose& here = survey.stations[k].T_world_scanner;
    if (k == 0) {
      believed.push_back(here);
      continue;
    }
    Random random(derived_seed(seed, "odometry"), k);
    const auto normal = [&](double sigma) {
      const double x = random.normal(), y = random.normal(), z = random.normal();
      return Eigen::Vector3d(sigma * x, sigma * y, sigma * z);
    };
    Pose step = survey.stations[k - 1].T_world_scanner.inverse() * here;
    step.translation() += normal(survey.odometry_translation);
    step.linear() = step.linear() * rotation_exp(normal(survey.odometry_rotation));
    believed.push_back(normalized(believed.back() * step));
  }
  return believed;
}

}  // namespace

Scanner station_scanner(const Station& station) {
  return with_settings(find_scanner(station.scanner), station.settings);
}

std::optional<double> height_below(const RayCaster& caster, const Eigen::Vector3d& from) {
  const std::optional<Hit> hit =
      caster.cast(from, -Eigen::Vector3d::UnitZ(), 0, std::numeric_limits<double>::infinity());
  if (!hit) return std::nullopt;
  return from.z() - hit->range;
}

std::vector<Eigen::Vector3d> planned_places(const Survey& survey, const DriftLines& lines,
                                            std::uint64_t seed) {
  std::vector<Eigen::Vector3d> places;
  for (const Station& station : survey.stations)
    places.push_back(station.T_world_scanner.translation());
  if (!survey.drive) return places;
  const Drive& drive = *survey.drive;
  if (!drive.path_file.empty()) {
    const std::vector<double> starts = starts_on_path(drive);
    const SmoothPath path(drive.path);
    for (const double start : starts) places.push_back(path.at(start).translation());
    return places;
  }
  const Route route = route_of(drive, lines);
  for (const double along : stops_of(drive, route, seed))
    places.push_back(route.at(along).position +
                     drive.vehicle.scanner_height * Eigen::Vector3d::UnitZ());
  return places;
}

Survey driven(const Survey& survey, const DriftLines& lines, const Ground& ground,
              std::uint64_t seed) {
  Survey result = survey;
  for (std::size_t k = 0; k < result.stations.size(); ++k)
    result.stations[k].time = scan_interval * static_cast<double>(k);
  if (!survey.drive) return result;
  const Drive& drive = *survey.drive;
  if (!drive.path_file.empty()) {
    result.trajectory = drive.path;
    const SmoothPath path(drive.path);
    for (const double start : starts_on_path(drive))
      result.stations.push_back({drive.scanner, drive.settings, path.at(start), start});
    return result;
  }
  const Route route = route_of(drive, lines);
  const std::vector<double> halts = stops_of(drive, route, seed);
  result.stations.assign(halts.size(), {.scanner = drive.scanner, .settings = drive.settings});
  if (drive.moving) {
    drive_through(result, drive, route, halts, ground);
    return result;
  }
  const double scan_time = Kinematics(drive_scanner(drive)).duration();
  for (std::size_t k = 0; k < halts.size(); ++k) {
    const RoutePlace place = route.at(halts[k]);
    result.stations[k].T_world_scanner =
        stand_clear(drive.vehicle, ground, place.position, place.heading);
    if (k > 0)
      result.stations[k].time =
          result.stations[k - 1].time + scan_time + (halts[k] - halts[k - 1]) / drive.vehicle.speed;
  }
  return result;
}

std::vector<Pose> believed_poses(const Survey& survey, std::uint64_t seed) {
  std::vector<Pose> truth;
  for (const Station& station : survey.stations) truth.push_back(station.T_world_scanner);
  switch (survey.guess) {
    case Guess::normal:
      break;
    case Guess::odometry:
      return odometry(truth, survey.odometry, seed);
    case Guess::total_station: {
      for (std::size_t k = 0; k < truth.size(); ++k) {
        Random random(derived_seed(seed, "total station"), k);
        truth[k] = total_station_pose(truth[k], survey.total_station, random);
      }
      return truth;
    }
  }
  return normal_errors(survey, seed);
}

void check(const Survey& survey) {
  for (std::size_t i = 0; i < survey.stations.size(); ++i) {
    try {
      check(station_scanner(survey.stations[i]));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(
          fmt::format("survey '{}', station {}: {}", survey.name, i, error.what()));
    }
  }
  std::size_t scans = survey.stations.size();
  if (survey.drive) {
    check(drive_scanner(*survey.drive));
    scans = static_cast<std::size_t>(survey.drive->scans);
  }
  for (const StationPair& pair : survey.pairs) {
    if (!(pair.target < scans && pair.source < scans))
      throw std::invalid_argument(
          fmt::format("survey '{}': pair ({}, {}): expected stations below {}", survey.name,
                      pair.target, pair.source, scans));
  }
}

void run_survey(const Survey& survey, const std::function<RayCaster(std::size_t)>& caster_at,
                std::uint64_t seed, const std::function<void(std::size_t, Scan)>& take) {
  // Everything a user may have got wrong comes to light before the first ray.
  check(survey);
  std::optional<SmoothPath> path;
  if (!survey.trajectory.times.empty()) path.emplace(survey.trajectory);
  for (std::size_t i = 0; i < survey.stations.size(); ++i) {
    const Station& station = survey.stations[i];
    const std::uint64_t scan_seed = derived_seed(seed, fmt::format("scan {}", i));
    const RayCaster caster = caster_at(i);
    const Scanner scanner = station_scanner(station);
    take(i, path ? scan(caster, scanner, *path, station.time, scan_seed, survey.scene)
                 : scan(caster, scanner, station.T_world_scanner, scan_seed, survey.scene,
                        station.time));
  }
}

std::vector<Scan> run_survey(const Survey& survey, const TriangleMesh& mesh, std::uint64_t seed) {
  check(survey);
  const RayCaster caster(mesh);
  const Ground ground = [&](const Eigen::Vector3d& from) { return height_below(caster, from); };
  std::vector<Scan> scans;
  run_survey(
      driven(survey, {}, ground, seed), [&](std::size_t) { return caster; }, seed,
      [&](std::size_t, Scan scan) { scans.push_back(std::move(scan)); });
  return scans;
}

}  // namespace minescan
