// SPDX-License-Identifier: MIT
// Values that several tests of this folder need: small pairs, and methods with a known outcome.
#pragma once

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/text.h"
#include "eval/trial.h"

namespace minescan {

/// Two points are enough: the methods below do not look at them.
inline ScanPair small_pair(const std::string& name = "pair") {
  ScanPair pair{.name = name, .origin = "two points"};
  pair.target.points = {{0, 0, 0}, {1, 2, 3}};
  pair.source.points = {{1, 0, 0}, {4, 5, 6}};
  pair.T_target_source = displaced(Pose::Identity(), {3, -1, 0.5}, {1, 2, 3}, 0.3);
  return pair;
}

/// Leaves `gain` of the start error of small_pair; fails to converge beyond `reach` metres.
inline Method shrinking_method(const std::string& name, double gain, double reach = 1e9) {
  Method method{.name = name, .description = "moves most of the way to the truth"};
  method.fields = {
      {.name = "cell-size",
       .unit = "m",
       .expected = "a number > 0",
       .value = "1",
       .number = true,
       .canonical =
           [](std::string_view text) { return number_text(read_number(text, positive, false)); }},
      {.name = "sample-seed",
       .expected = "a whole number >= 0",
       .value = "1",
       .number = true,
       .canonical = [](std::string_view text) {
         return number_text(read_number(text, not_negative, true));
       }}};
  method.run = [gain, reach](const PointCloud&, const PointCloud&, const Pose& guess,
                             const Settings& settings) {
    const Pose truth = small_pair().T_target_source;
    const Pose left = truth.inverse() * guess;
    const Eigen::AngleAxisd turn(left.linear());
    // A little noise that depends on the sampling seed, so that it must be the same on every run.
    Random random(static_cast<std::uint64_t>(parse_integer(settings.at("sample-seed"))), 0);
    const double factor = gain * std::exp(0.3 * random.normal());
    RegistrationResult result;
    result.T_target_source = displaced(truth, factor * left.translation(), turn.axis(),
                                       std::min(3.0, factor * turn.angle()));
    result.status = left.translation().norm() <= reach ? Status::converged : Status::no_overlap;
    result.iterations = 7;
    return result;
  };
  return method;
}

inline Method throwing_method(const std::string& name) {
  Method method{.name = name};
  method.run = [](const PointCloud&, const PointCloud&, const Pose&,
                  const Settings&) -> RegistrationResult {
    throw std::runtime_error("cannot, ever: \"quoted\"");
  };
  return method;
}

/// A folder of the running test, emptied first.
inline std::filesystem::path fresh_folder(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("minescan-" + name + "-" + std::to_string(getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace minescan
