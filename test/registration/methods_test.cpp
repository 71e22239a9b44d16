// SPDX-License-Identifier: MIT
#include "registration/methods.h"

#include <gtest/gtest.h>

#include <limits>

#include "clouds.h"
#include "core/parallel.h"
#include "registration/sampling.h"

namespace minescan {
namespace {

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

// What a method leaves as guessed, height, roll and pitch, has to be right to begin with.
Pose guess_for(const Method& method) {
  if (method.name != "ndt-2d" && method.name != "ndt-slices") return near_identity;
  return displaced(Pose::Identity(), {0.2, -0.15, 0}, {0, 0, 1}, 0.05);
}

std::string thrown_by(const std::function<void()>& body) {
  try {
    body();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing";
}

TEST(Methods, EveryRowRegistersASmallPair) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  for (const Method& method : methods()) {
    EXPECT_FALSE(method.description.empty()) << method.name;
    const RegistrationResult result = method.run(target, source, guess_for(method), {});
    EXPECT_EQ(result.status, Status::converged) << method.name;
    const PoseError error = pose_error(Pose::Identity(), result.T_target_source);
    EXPECT_LT(error.translation, 0.03) << method.name;
    EXPECT_LT(error.rotation, 0.003) << method.name;
    EXPECT_GT(result.iterations, 1) << method.name;
    if (const Field* ratio = find_field(method.fields, "sample-ratio")) {
      EXPECT_EQ(result.used_points, sample_size(20000, std::stod(ratio->value))) << method.name;
    }
    EXPECT_GE(result.used_points, 2000u) << method.name;
    EXPECT_GT(result.cpu, 0) << method.name;
    EXPECT_GT(result.time.align, 0) << method.name;
  }
}

TEST(Methods, EveryRowGivesTheSameBytesAgainAndForAnyNumberOfThreads) {
  const PointCloud target = bumpy_tunnel(5000, 1), source = bumpy_tunnel(5000, 2);
  for (const Method& method : methods()) {
    const RegistrationResult one = method.run(target, source, near_identity, {});
    const ThreadLimit limit(1);
    const RegistrationResult two = method.run(target, source, near_identity, {});
    EXPECT_TRUE(one.T_target_source.isApprox(two.T_target_source, 0)) << method.name;
    EXPECT_EQ(one.score, two.score) << method.name;
    EXPECT_EQ(one.iterations, two.iterations) << method.name;
  }
}

// Sampling by hand beforehand is the same as what the methods do.
TEST(Methods, EveryRowThatSamplesCanSampleTheTarget) {
  const PointCloud target = bumpy_tunnel(10000, 1), source = bumpy_tunnel(5000, 2);
  const SamplingOptions half{.ratio = 0.5, .of = SampleOf::both};
  int rows = 0;
  for (const Method& method : methods()) {
    if (!find_field(method.fields, "sample-of")) continue;
    ++rows;
    const RegistrationResult both =
        method.run(target, source, near_identity, {{"sample-ratio", "0.5"}, {"sample-of", "both"}});
    const RegistrationResult by_hand =
        method.run(*used_target(target, half), *used_source(source, half), near_identity,
                   {{"sample-ratio", "1"}});
    EXPECT_TRUE(both.T_target_source.isApprox(by_hand.T_target_source, 0)) << method.name;
    EXPECT_EQ(both.used_points, 2500u) << method.name;
    EXPECT_EQ(both.target_points, 10000u) << method.name;
    EXPECT_EQ(both.target_bytes, by_hand.target_bytes) << method.name;
    const RegistrationResult of_target = method.run(
        target, source, near_identity, {{"sample-ratio", "0.5"}, {"sample-of", "target"}});
    EXPECT_EQ(of_target.used_points, 5000u) << method.name;
    EXPECT_EQ(of_target.target_bytes, by_hand.target_bytes) << method.name;
  }
  EXPECT_GE(rows, 15);
  const Method& icp = find_method("icp");  // whose tree is in proportion to the points
  const Settings whole = {{"sample-ratio", "0.5"}},
                 part = {{"sample-ratio", "0.5"}, {"sample-of", "both"}};
  EXPECT_NEAR(static_cast<double>(icp.run(target, source, near_identity, part).target_bytes) /
                  static_cast<double>(icp.run(target, source, near_identity, whole).target_bytes),
              0.5, 0.1);  // leaves are filled up to fours
}

TEST(Methods, EveryRowRefusesBadClouds) {
  const PointCloud good = bumpy_tunnel(100, 1);
  PointCloud bad = good;
  bad.points[7].y() = std::numeric_limits<double>::quiet_NaN();
  const Pose T = Pose::Identity();
  for (const Method& method : methods()) {
    EXPECT_EQ(thrown_by([&] { method.run({}, good, T, {}); }), "the target cloud is empty");
    EXPECT_EQ(thrown_by([&] { method.run(good, {}, T, {}); }), "the source cloud is empty");
    EXPECT_NE(thrown_by([&] { method.run(good, bad, T, {}); }).find("point 7 of the source cloud"),
              std::string::npos);
    Pose not_finite = T;
    not_finite.translation().x() = std::numeric_limits<double>::infinity();
    EXPECT_THROW(method.run(good, good, not_finite, {}), std::invalid_argument);
  }
}

TEST(Methods, EveryNumberOfEveryRowHasLimits) {
  const PointCloud cloud = bumpy_tunnel(100, 1);
  for (const Method& method : methods()) {
    for (const Field& field : method.fields) {
      EXPECT_FALSE(field.help.empty()) << field.name;
      if (!field.number || field.name == "sample-seed") continue;
      for (const char* value : {"-1e12", "1e12", "nan", "inf", "many"}) {
        EXPECT_THROW(method.run(cloud, cloud, Pose::Identity(), {{field.name, value}}),
                     std::invalid_argument)
            << method.name << " " << field.name << " " << value;
      }
    }
  }
}

TEST(Methods, EveryRowSurvivesHopelessClouds) {
  const PointCloud point{.points = {{1, 2, 3}}};
  const PointCloud far{.points = {{0, 0, 0}, {9e5, -9e5, 9e5}, {1, 1, 1}}};
  for (const Method& method : methods()) {
    for (const PointCloud& target : {point, far, plane(50, 3, 0, 1)}) {
      for (const PointCloud& source : {point, plane(50, 3, 0, 2)}) {
        try {
          const RegistrationResult result = method.run(target, source, Pose::Identity(), {});
          EXPECT_TRUE(result.T_target_source.matrix().allFinite()) << method.name;
          EXPECT_NE(result.status, Status::not_run) << method.name;
        } catch (const std::invalid_argument&) {
          // their cells do not reach across the far cloud
          EXPECT_TRUE(method.name == "pcl-ndt" || method.name == "pcl-fpfh" ||
                      method.name == "quadrics-octree")
              << method.name;
        }
      }
    }
  }
}

TEST(Methods, AreFoundByName) {
  EXPECT_EQ(find_method("ndt").name, "ndt");
  EXPECT_NE(thrown_by([] { find_method("nd"); }).find("ndt"), std::string::npos);
}

}  // namespace
}  // namespace minescan
