// SPDX-License-Identifier: MIT
#include "sim/survey.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "core/random.h"
#include "core/text.h"
#include "sim/raycaster.h"
#include "sim/scan.h"

namespace minescan {

Scanner station_scanner(const Station& station) {
  return with_settings(find_scanner(station.scanner), station.settings);
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
  for (const StationPair& pair : survey.pairs) {
    if (!(pair.target < survey.stations.size() && pair.source < survey.stations.size()))
      throw std::invalid_argument(
          fmt::format("survey '{}': pair ({}, {}): expected stations below {}", survey.name,
                      pair.target, pair.source, survey.stations.size()));
  }
}

void run_survey(const Survey& survey, const std::function<RayCaster(std::size_t)>& caster_at,
                std::uint64_t seed, const std::function<void(std::size_t, Scan)>& take) {
  // Everything a user may have got wrong comes to light before the first ray.
  check(survey);
  for (std::size_t i = 0; i < survey.stations.size(); ++i) {
    const Station& station = survey.stations[i];
    take(i, scan(caster_at(i), station_scanner(station), station.T_world_scanner,
                 derived_seed(seed, fmt::format("scan {}", i)), survey.scene));
  }
}

std::vector<Scan> run_survey(const Survey& survey, const TriangleMesh& mesh, std::uint64_t seed) {
  check(survey);
  const RayCaster caster(mesh);
  std::vector<Scan> scans;
  run_survey(
      survey, [&](std::size_t) { return caster; }, seed,
      [&](std::size_t, Scan scan) { scans.push_back(std::move(scan)); });
  return scans;
}

}  // namespace minescan
