// SPDX-License-Identifier: MIT
#include "eval/baseline.h"

#include <fmt/format.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/output_file.h"
#include "core/text.h"

namespace minescan {
namespace {

// Keys stay in the order written, which is the order of interest to a reader.
using Json = nlohmann::ordered_json;

// To be raised when the meaning of the file changes.
constexpr int format_version = 1;

Json trial_json(const Outcome& o) {
  Json pose = Json::array();
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Eigen::RowVector4d row = o.result.T_target_source.matrix().row(i);
    pose.push_back({row[0], row[1], row[2], row[3]});
  }
  return {{"id", trial_id(o.trial)},
          {"pair", o.trial.pair},
          {"origin", o.trial.origin},
          {"method", o.trial.method},
          {"settings", o.trial.settings},
          {"axes", o.trial.axes},
          {"initial_translation_m", o.trial.initial_translation},
          {"initial_rotation_rad", o.trial.initial_rotation},
          {"start", o.trial.start},
          {"starts", o.trial.starts},
          {"seed", o.trial.seed},
          {"status", value_text(o.result.status)},
          {"iterations", o.result.iterations},
          {"translation_error_m", o.error.translation},
          {"rotation_error_rad", o.error.rotation},
          {"T_target_source", pose},
          {"message", o.message}};
}

Outcome read_trial(const Json& json) {
  Outcome o;
  json.at("pair").get_to(o.trial.pair);
  json.at("origin").get_to(o.trial.origin);
  json.at("method").get_to(o.trial.method);
  o.trial.settings = json.at("settings").get<Settings>();
  o.trial.axes = json.at("axes").get<std::map<std::string, double>>();
  json.at("initial_translation_m").get_to(o.trial.initial_translation);
  json.at("initial_rotation_rad").get_to(o.trial.initial_rotation);
  json.at("start").get_to(o.trial.start);
  json.at("starts").get_to(o.trial.starts);
  json.at("seed").get_to(o.trial.seed);
  read_value(json.at("status").get<std::string>(), any_number, o.result.status);
  json.at("iterations").get_to(o.result.iterations);
  json.at("translation_error_m").get_to(o.error.translation);
  json.at("rotation_error_rad").get_to(o.error.rotation);
  for (Eigen::Index i = 0; i < 4; ++i)
    for (Eigen::Index j = 0; j < 4; ++j)
      o.result.T_target_source.matrix()(i, j) = json.at("T_target_source")
                                                    .at(static_cast<std::size_t>(i))
                                                    .at(static_cast<std::size_t>(j))
                                                    .get<double>();
  json.at("message").get_to(o.message);
  if (json.at("id").get<std::string>() != trial_id(o.trial))
    throw std::invalid_argument("its id does not fit what it says");
  return o;
}

}  // namespace

void write_baseline(const std::filesystem::path& path, const std::vector<Outcome>& outcomes,
                    const std::string& reason, const std::string& version) {
  if (trimmed(reason).empty())
    throw std::invalid_argument("a baseline needs a reason: why should others be held to it?");
  if (outcomes.empty()) throw std::invalid_argument("a baseline needs results; there are none");
  std::map<std::string, const Outcome*> by_id;
  for (const Outcome& outcome : outcomes) by_id.try_emplace(trial_id(outcome.trial), &outcome);

  OutputFile file(path);
  file.stream() << fmt::format(
      "{{\n\"minescan_baseline\": {},\n\"version\": {},\n\"reason\": {},\n", format_version,
      Json(version).dump(), Json(std::string(trimmed(reason))).dump());
  file.stream() << "\"trials\": [";
  const char* separator = "\n";
  for (const auto& [id, outcome] : by_id) {
    file.stream() << separator << trial_json(*outcome).dump();
    separator = ",\n";
  }
  file.stream() << "\n]\n}\n";
  file.commit();
}

Baseline read_baseline(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw std::runtime_error(path.string() + ": cannot be read; expected a baseline");
  const auto fail = [&](const std::string& what) -> std::runtime_error {
    return std::runtime_error(path.string() + ": " + what);
  };
  Json json;
  try {
    json = Json::parse(file);
  } catch (const Json::exception&) {
    throw fail("not a baseline: not JSON, or cut short");
  }
  if (!json.is_object() || !json.contains("minescan_baseline"))
    throw fail("not a baseline: there is no 'minescan_baseline'");
  if (json["minescan_baseline"] != format_version)
    throw fail(fmt::format("baseline of version {}, expected {}", json["minescan_baseline"].dump(),
                           format_version));
  Baseline baseline;
  std::size_t number = 0;
  try {
    json.at("version").get_to(baseline.version);
    json.at("reason").get_to(baseline.reason);
    for (const Json& trial : json.at("trials")) {
      ++number;
      baseline.outcomes.push_back(read_trial(trial));
    }
  } catch (const std::exception& error) {
    throw fail(number == 0 ? std::string("not a baseline: ") + error.what()
                           : fmt::format("trial {}: {}", number, error.what()));
  }
  return baseline;
}

}  // namespace minescan
