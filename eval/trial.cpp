// SPDX-License-Identifier: MIT
#include "eval/trial.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <numbers>
#include <stdexcept>

#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "eval/start_poses.h"

namespace minescan {
namespace {

// Length before text: no two lists of texts look the same when written one after the other.
void append(std::string& canonical, std::string_view text) {
  canonical += fmt::format("{}:{},", text.size(), text);
}

void append(std::string& canonical, double value) {
  append(canonical, number_text(value == 0 ? 0.0 : value));  // -0 is 0
}

std::uint64_t pair_seed(const Trial& trial) {
  return derived_seed(trial.seed, "pair " + trial.pair);
}

double axial_error(const Pose& truth, const Pose& estimate) {
  const double distance = truth.translation().norm();
  // Closer than a micrometre the line has no direction worth the name (assumed).
  if (distance < 1e-6) return 0;
  return truth.translation().dot(estimate.translation() - truth.translation()) / distance;
}

void check_pair(const Trial& trial, const ScanPair& pair) {
  if (trial.pair != pair.name || trial.origin != pair.origin)
    throw std::invalid_argument(fmt::format("trial of pair '{}' ({}): was given pair '{}' ({})",
                                            trial.pair, trial.origin, pair.name, pair.origin));
}

}  // namespace

std::string trial_id(const Trial& trial) {
  std::string canonical;
  append(canonical, trial.pair);
  append(canonical, trial.origin);
  append(canonical, trial.method);
  append(canonical, static_cast<double>(trial.settings.size()));
  for (const auto& [name, value] : trial.settings) {
    append(canonical, name);
    append(canonical, value);
  }
  append(canonical, trial.initial_translation);
  append(canonical, trial.initial_rotation);
  append(canonical, std::to_string(trial.start));
  append(canonical, std::to_string(trial.starts));
  append(canonical, std::to_string(trial.seed));
  return text_hash(canonical);
}

Quality quality(const Outcome& outcome) {
  if (outcome.result.status != Status::converged || !outcome.message.empty())
    return Quality::failed;
  const auto within = [&](double translation, double rotation) {
    return outcome.error.translation <= translation && outcome.error.rotation <= rotation;
  };
  if (within(0.10, 0.005)) return Quality::good;
  if (within(0.20, 0.010)) return Quality::acceptable;
  return Quality::failed;
}

Pose start_pose(const Trial& trial, const ScanPair& pair) {
  if (!(trial.initial_translation >= 0 && trial.initial_rotation >= 0 &&
        trial.initial_rotation <= std::numbers::pi))
    throw std::invalid_argument(
        fmt::format("start pose: expected a translation >= 0 m and a rotation in [0, pi] rad, "
                    "found {} and {}",
                    trial.initial_translation, trial.initial_rotation));
  return start_pose(pair.T_target_source, trial.start, trial.starts, pair_seed(trial),
                    trial.initial_translation, trial.initial_rotation);
}

Settings run_settings(const Trial& trial, const Method& method) {
  Settings settings = trial.settings;
  // 53 bits: option values are numbers, and a double holds no larger whole number exactly.
  if (find_field(method.fields, "sample-seed") && !settings.contains("sample-seed"))
    settings["sample-seed"] = std::to_string(
        derived_seed(pair_seed(trial), fmt::format("samples {}", trial.start)) >> 11);
  return settings;
}

Outcome run_trial(const Trial& trial, const ScanPair& pair) {
  return run_trial(trial, pair, find_method(trial.method));
}

Outcome run_trial(const Trial& trial, const ScanPair& pair, const Method& method) {
  check_pair(trial, pair);
  if (method.name != trial.method)
    throw std::invalid_argument(
        fmt::format("trial of method '{}': was given method '{}'", trial.method, method.name));
  const Pose guess = start_pose(trial, pair);
  Outcome outcome;
  outcome.trial = trial;
  try {
    const OneThread alone;  // trials run side by side, and their times are compared
    outcome.result = method.run(pair.target, pair.source, guess, run_settings(trial, method));
    if (!outcome.result.T_target_source.matrix().allFinite())
      outcome.message = "returned a pose that is not finite";
  } catch (const std::exception& error) {
    outcome.message = *error.what() ? error.what() : "threw an exception without a text";
  } catch (...) {
    outcome.message = "threw something that is not a std::exception";
  }
  if (!outcome.message.empty()) {
    outcome.result = {};
    outcome.result.T_target_source = guess;
  }
  outcome.error = pose_error(pair.T_target_source, outcome.result.T_target_source);
  outcome.axial_error = axial_error(pair.T_target_source, outcome.result.T_target_source);
  return outcome;
}

}  // namespace minescan
