// SPDX-License-Identifier: MIT
// Two pairs of real scans with known poses, where somebody has put them (see README, "Real scans").
#include <gtest/gtest.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace minescan {
namespace {

struct RealPair {
  std::string folder, target, source, guess;
  std::vector<std::string> ndt, icp;  // settings
};

const std::string identity = "0,0,0,0,0,0,1";

void expect_found(const RealPair& pair, const std::string& method, const std::string& guess,
                  const std::vector<std::string>& settings) {
  const std::filesystem::path data = std::filesystem::path(MINESCAN_REAL_SCANS) / pair.folder;
  const ScratchFolder folder;
  std::vector<std::string> command = {
      "register", data / pair.target,           data / pair.source, "--method", method,
      "--truth",  data / "T_target_source.txt", "--json",           "-",        "--guess",
      guess};
  for (const std::string& setting : settings) command.insert(command.end(), {"--set", setting});
  const ProgramResult result = run_minescan(command, folder);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  const double translation = json["translation_error_m"], rotation = json["rotation_error_rad"];
  std::cout << pair.folder << " " << method << ": " << translation << " m, " << rotation
            << " rad\n";
  EXPECT_EQ(json["status"], "converged");
  // The truth itself is good to about 2 cm and 4 mrad.
  EXPECT_LE(translation, 0.05) << pair.folder << " " << method;
  EXPECT_LE(rotation, 0.01) << pair.folder << " " << method;
}

class RealScans : public testing::TestWithParam<RealPair> {};

TEST_P(RealScans, AreRegistered) {
  if (!std::filesystem::exists(std::filesystem::path(MINESCAN_REAL_SCANS) / GetParam().folder))
    GTEST_SKIP() << "no real scans at " << MINESCAN_REAL_SCANS << "/" << GetParam().folder
                 << "; configure with -D MINESCAN_REAL_SCANS=<folder> to run this";
  const RealPair& pair = GetParam();
  expect_found(pair, "robust", identity, {});
  expect_found(pair, "ndt", pair.guess, pair.ndt);
  expect_found(pair, "icp", pair.guess, pair.icp);
}

// The settings that the README gives.
const std::vector<std::string> small_cells = {"cell-size=0.5", "levels=3"};
const std::vector<std::string> closing_gate = {"decrease-iterations=20", "final-distance=0.1"};

// The start poses are those that came with the scans: odometry for the room (0.6931 rad about z),
// none for the street.
INSTANTIATE_TEST_SUITE_P(Pairs, RealScans,
                         testing::Values(RealPair{"room_pair", "room_scan1.pcd", "room_scan2.pcd",
                                                  "1.79387,0.720047,0,0,0,0.339654937,0.940550118",
                                                  small_cells, closing_gate},
                                         RealPair{"kitti_pair", "target.ply", "source.ply",
                                                  identity, small_cells, closing_gate}),
                         [](const auto& instance) { return instance.param.folder; });

}  // namespace
}  // namespace minescan
