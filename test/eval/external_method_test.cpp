// SPDX-License-Identifier: MIT
#include "eval/external_method.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <limits>

#include "eval/trial.h"

namespace minescan {
namespace {

using testing::HasSubstr;

const PointCloud cloud{.points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}}};

class ExternalMethods : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& yaml) {
    const std::filesystem::path path =
        std::filesystem::path(testing::TempDir()) /
        ("external_" + std::to_string(reinterpret_cast<std::uintptr_t>(this)) + ".yaml");
    std::ofstream(path) << yaml;
    return path;
  }
  /// A program that runs a line of shell, which is its own choice.
  ExternalMethod shell(const std::string& line, const std::string& timeout = "20") {
    return external_method(write("name: mine\ntimeout_s: " + timeout +
                                 "\ncommand:\n  - sh\n  - -c\n  - '" + line +
                                 "'\n  - sh\n  - '{target}'\n  - '{source}'\n  - '{guess}'\n"));
  }
  std::string thrown_by(const ExternalMethod& external) {
    try {
      external.method.run(cloud, cloud, Pose::Identity(), external.settings);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "nothing";
  }
  std::string refused(const std::string& yaml) {
    try {
      external_method(write(yaml));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing";
  }
};

TEST_F(ExternalMethods, GetFilesAndAnswerWithAMatrix) {
  const Pose guess = displaced(Pose::Identity(), {4e6, -0.1, 0.3}, {0.1, 0.2, 1}, 0.3);
  const ExternalMethod external = shell("test -s \"$1\" && test -s \"$2\" && cat \"$3\"");
  const RegistrationResult result = external.method.run(cloud, cloud, guess, external.settings);
  EXPECT_EQ(result.status, Status::converged);
  // The matrix is written in digits that read back to the same numbers, far from the origin, too.
  EXPECT_TRUE(result.T_target_source.isApprox(guess, 1e-15));
  EXPECT_EQ(result.used_points, 4u);
  EXPECT_GT(result.time.align, 0);
  // Commas are as good as blanks.
  const ExternalMethod commas =
      shell("printf \"1@0@0@5 0@1@0@6 0@0@1@7 0@0@0@1\" | tr @ \"\\\\054\"");
  EXPECT_EQ(commas.method.run(cloud, cloud, guess, commas.settings).T_target_source.translation(),
            Eigen::Vector3d(5, 6, 7));
}

TEST_F(ExternalMethods, LeaveNothingBehind) {
  const auto count = [] {
    std::size_t sum = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::temp_directory_path()))
      sum += entry.path().filename().string().starts_with("minescan-");
    return sum;
  };
  const std::size_t before = count();
  EXPECT_EQ(thrown_by(shell("cat \"$3\"")), "nothing");
  EXPECT_NE(thrown_by(shell("exit 3")), "nothing");
  EXPECT_EQ(count(), before);
}

TEST_F(ExternalMethods, SayWhatWentWrong) {
  EXPECT_THAT(thrown_by(shell("exit 3")), HasSubstr("exit code 3"));
  EXPECT_THAT(thrown_by(shell("kill -SEGV $$")), HasSubstr("signal 11"));
  EXPECT_THAT(thrown_by(shell("echo hello")), HasSubstr("no 4 x 4 matrix"));
  EXPECT_THAT(thrown_by(shell("true")), HasSubstr("found 0 numbers"));
  EXPECT_THAT(thrown_by(shell("echo 2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 1")),
              HasSubstr("no 4 x 4 matrix"));
  EXPECT_THAT(thrown_by(shell("echo nan 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1")),
              HasSubstr("no 4 x 4 matrix"));
  EXPECT_THAT(thrown_by(shell("yes 1")), HasSubstr("printed more than"));
  EXPECT_THAT(
      thrown_by(external_method(write("name: mine\ncommand: [/there/is/no/such/program]\n"))),
      HasSubstr("cannot be started"));
}

TEST_F(ExternalMethods, AreStoppedWithAllThatTheyHaveStarted) {
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT(thrown_by(shell("sleep 600 & sleep 600", "0.3")), HasSubstr("not done after 0.3 s"));
  // One that closes its output and goes on.
  EXPECT_THAT(thrown_by(shell("exec >&-; sleep 600", "0.3")), HasSubstr("not done after 0.3 s"));
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  EXPECT_LT(taken.count(), 60);  // not 600
}

TEST_F(ExternalMethods, RefuseBadCloudsAndConfigurations) {
  const ExternalMethod external = shell("cat \"$3\"");
  EXPECT_THROW(external.method.run({}, cloud, Pose::Identity(), external.settings),
               std::invalid_argument);
  EXPECT_THROW(external.method.run(cloud, cloud, Pose::Identity(), {}), std::invalid_argument);
  EXPECT_THAT(refused("command: [cat]\n"), HasSubstr("expected a key 'name'"));
  EXPECT_THAT(refused("name: mine\n"), HasSubstr("expected a key 'command'"));
  EXPECT_THAT(refused("name: icp\ncommand: [cat]\n"), HasSubstr("there is a method of that name"));
  EXPECT_THAT(refused("name: ../x\ncommand: [cat]\n"), HasSubstr("expected lower-case letters"));
  EXPECT_THAT(refused("name: mine\ncommand: [cat]\nshell: true\n"), HasSubstr("shell"));
  EXPECT_THAT(refused("name: mine\ncommand: [cat]\ntimeout_s: 0\n"), HasSubstr("timeout_s"));
  EXPECT_THROW(external_method("there/is/no/such.yaml"), std::runtime_error);
}

TEST_F(ExternalMethods, ResultsOfDifferentCommandsAreToldApart) {
  const auto id = [&](const ExternalMethod& external) {
    return trial_id({.pair = "p", .method = external.method.name, .settings = external.settings});
  };
  EXPECT_EQ(id(shell("cat \"$3\"")), id(shell("cat \"$3\"")));
  EXPECT_NE(id(shell("cat \"$3\"")), id(shell("cat  \"$3\"")));
  EXPECT_NE(id(shell("true", "3")), id(shell("true", "4")));
}

}  // namespace
}  // namespace minescan
