// SPDX-License-Identifier: MIT
#include "eval/method_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace minescan {
namespace {

Outcome outcome(const std::string& pair, const std::string& method, double translation,
                const std::map<std::string, double>& axes = {}) {
  Outcome o;
  o.trial.pair = pair;
  o.trial.method = method;
  o.trial.axes = axes;
  o.result.status = Status::converged;
  o.result.cpu = 0.002;
  o.result.target_bytes = 45000;
  o.error = {.translation = translation, .rotation = 0.001};
  return o;
}

TEST(MethodTable, CountsAndTakesMediansByPairAndMethod) {
  const std::string table = method_table(
      {outcome("tunnel", "ndt", 0.3), outcome("hall", "ndt", 0.02), outcome("tunnel", "ndt", 0.01),
       outcome("tunnel", "ndt", 0.02), outcome("tunnel", "icp", 0.02)});
  // 2 of 3: Wilson's interval at 95 % is 21 to 94 %.
  EXPECT_THAT(table, testing::HasSubstr(
                         "| tunnel | ndt | 1 m, 0.1 rad | 2 of 3 | 21-94 % | 20 | 1 | 2 | 45 |\n"));
  EXPECT_LT(table.find("hall"), table.find("tunnel"));
  EXPECT_LT(table.find("| tunnel | icp"), table.find("| tunnel | ndt"));
}

TEST(MethodTable, TellsPointsOfAStudyApart) {
  const std::string table = method_table({outcome("hall", "ndt", 0.3, {{"cell-size", 2}}),
                                          outcome("hall", "ndt", 0.02, {{"cell-size", 0.5}})});
  EXPECT_THAT(table, testing::HasSubstr("| hall | ndt | 1 m, 0.1 rad, cell-size 2 | 0 of 1"));
  EXPECT_THAT(table, testing::HasSubstr("| hall | ndt | 1 m, 0.1 rad, cell-size 0.5 | 1 of 1"));
}

TEST(MethodTable, TellsStartErrorsAndSettingsApart) {
  Outcome far = outcome("hall", "ndt", 0.3), set = outcome("hall", "ndt", 0.3);
  far.trial.initial_translation = 3;
  set.trial.settings = {{"levels", "2"}};
  const std::string table = method_table({outcome("hall", "ndt", 0.02), far, set});
  EXPECT_THAT(table, testing::HasSubstr("| hall | ndt | 1 m, 0.1 rad | 1 of 1"));
  EXPECT_THAT(table, testing::HasSubstr("| hall | ndt | 3 m, 0.1 rad | 0 of 1"));
  EXPECT_THAT(table, testing::HasSubstr("| hall | ndt | 1 m, 0.1 rad, levels 2 | 0 of 1"));
}

}  // namespace
}  // namespace minescan
