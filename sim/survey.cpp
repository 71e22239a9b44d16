// SPDX-License-Identifier: MIT
#include "sim/survey.h"

#include <fmt/format.h>

#include <stdexcept>

#include "core/random.h"
#include "core/text.h"
#include "sim/raycaster.h"
#include "sim/scanner.h"

namespace minescan {

Scanner station_scanner(const Station& station) {
  return with_settings(find_scanner(station.scanner), station.settings);
}

std::vector<Scan> run_survey(const Survey& survey, const TriangleMesh& mesh, std::uint64_t seed,
                             const std::function<void(std::size_t)>& done) {
  // Everything a user may have got wrong comes to light before the first ray.
  std::vector<Scanner> scanners_used;
  for (std::size_t i = 0; i < survey.stations.size(); ++i) {
    try {
      scanners_used.push_back(station_scanner(survey.stations[i]));
      check(scanners_used.back());
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

  const RayCaster caster(mesh);
  std::vector<Scan> scans;
  scans.reserve(survey.stations.size());
  for (std::size_t i = 0; i < survey.stations.size(); ++i) {
    scans.push_back(scan(caster, scanners_used[i], survey.stations[i].T_world_scanner,
                         derived_seed(seed, fmt::format("scan {}", i)), survey.scene));
    if (done) done(scans.size());
  }
  return scans;
}

}  // namespace minescan
