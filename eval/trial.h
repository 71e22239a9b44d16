// SPDX-License-Identifier: MIT
// One registration as plain data: what decides it (Trial), and what came of it (Outcome).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/methods.h"
#include "registration/result.h"

namespace minescan {

/// Two scans and the exact pose between them.
struct ScanPair {
  std::string name = {};  // "junction" or "junction/3", as results call it
  std::string origin =
      {};  // all that decides the points: configuration and seed, or a hash of files
  PointCloud target = {};  // each in its own scanner frame
  PointCloud source = {};
  Pose T_target_source = Pose::Identity();  // truth
};

/// Everything that decides the result of one registration, as plain data: written into its row of
/// the table, enough to run that row again alone.
struct Trial {
  std::string study = {};
  std::string pair = {};                    // name of the ScanPair
  std::string origin = {};                  // of the ScanPair
  std::string method = "ndt";               // name in methods()
  Settings settings = {};                   // options that differ from the method's defaults
  std::map<std::string, double> axes = {};  // values of the study's axes: what a figure puts on x
  double initial_translation = 1.0;         // error of the start pose, m
  double initial_rotation = 0.1;            // rad
  int start = 0;                            // which of the evenly spread start poses
  int starts = 100;                         // out of how many
  std::uint64_t seed = 1;
};

/// Names a trial: a hash of all of the above but the study and the axes, which only label it.
std::string trial_id(const Trial& trial);

/// One row of a result table.
struct Outcome {
  Trial trial = {};
  RegistrationResult result = {};  // status not_run if the method threw
  PoseError error = {};            // of the result against the truth
  // Metres, signed, along the line from the target's to the source's scanner; 0 if they coincide.
  double axial_error = 0;
  std::string message = {};  // what the method threw, or empty
};

/// Quality classes of section 5.2.2 of the paper: good within 0.10 m and 0.005 rad, acceptable
/// within 0.20 m and 0.010 rad. A result that did not converge has failed, wherever it ended.
enum class Quality { good, acceptable, failed };
constexpr auto names_of(Quality) {
  return std::to_array<std::string_view>({"good", "acceptable", "failed"});
}
Quality quality(const Outcome& outcome);

/// The start pose of a trial: displaced(pair.T_target_source, ...) as eval/start_poses.h spreads
/// them, from a seed made of the trial's seed and pair. Methods and settings have no part in it.
Pose start_pose(const Trial& trial, const ScanPair& pair);

/// The settings that the method is run with: those of the trial and, if the method draws samples
/// and the trial does not name the draw, a "sample-seed" of this start pose (the same for all
/// methods and levels, so that sampling varies within a box of a figure and not between them).
Settings run_settings(const Trial& trial, const Method& method);

/// Runs one trial. What the method throws becomes the outcome's message; the outcome is then the
/// start pose with status not_run. Throws std::invalid_argument if the pair is not the trial's or
/// the method is unknown.
Outcome run_trial(const Trial& trial, const ScanPair& pair);

/// The same with a method that need not be in methods(); its name must be the trial's.
Outcome run_trial(const Trial& trial, const ScanPair& pair, const Method& method);

}  // namespace minescan
