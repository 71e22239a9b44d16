// SPDX-License-Identifier: MIT
#include "registration/registered.h"

#include <gtest/gtest.h>

#include <limits>

#include "clouds.h"
#include "registration/methods.h"

namespace minescan {
namespace {

// Zone coordinates of a map: seven digits before the point.
const Eigen::Vector3d map_target(6542336, 510976, 51200), map_source(6542300, 512345, -51234);

TEST(Registered, MapCoordinatesCostNoAccuracy) {
  const PointCloud target = bumpy_tunnel(8000, 1), source = bumpy_tunnel(8000, 2);
  const Pose guess = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);
  const Pose to_map{Eigen::Translation3d(map_target)}, from_map{Eigen::Translation3d(-map_source)};
  for (const Method& method : methods()) {
    const RegistrationResult here = method.run(target, source, guess, {});
    const RegistrationResult there =
        method.run(transformed(to_map, target), transformed(from_map.inverse(), source),
                   to_map * guess * from_map, {});
    EXPECT_EQ(there.status, here.status) << method.name;
    // Points are rounded to 1e-9 m up there, the translation too: a tenth of a micrometre is far
    // more than that does, unless a sample or a partner changes.
    const Pose back = to_map.inverse() * there.T_target_source * from_map.inverse();
    // PCL calculates in single precision and stops where that lets it.
    const double tolerance = method.name.starts_with("pcl-") ? 2e-3 : 1e-4;
    EXPECT_LT(pose_error(here.T_target_source, back).translation, tolerance) << method.name;
    EXPECT_LT(pose_error(here.T_target_source, back).rotation, tolerance / 5) << method.name;
  }
}

TEST(Registered, CovarianceIsThatOfTheFarOrigin) {
  const PointCloud cloud = bumpy_tunnel(10, 1);
  const Eigen::Vector3d far_source(10240, 0, 0);
  const auto turn_about_z = [](const PointCloud&, const PointCloud&, RegistrationResult& result) {
    result.covariance(5, 5) = 1e-6;
  };
  const PointCloud moved = transformed(Pose(Eigen::Translation3d(far_source)), cloud);
  const RegistrationResult result = registered(cloud, moved, Pose::Identity(), turn_about_z);
  EXPECT_NEAR(result.covariance(1, 1), 10240.0 * 10240.0 * 1e-6, 1e-6);
  EXPECT_NEAR(std::abs(result.covariance(1, 5)), 10240 * 1e-6, 1e-12);
  EXPECT_NEAR(result.covariance(0, 0), 0, 1e-12);
}

TEST(Registered, AFailureReturnsTheGuessToTheLastBit) {
  const PointCloud cloud = bumpy_tunnel(10, 1);
  const Pose guess = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);
  for (const Status status : {Status::no_overlap, Status::degenerate}) {
    const RegistrationResult result = registered(
        cloud, cloud, guess, [&](const PointCloud&, const PointCloud&, RegistrationResult& r) {
          r.status = status;
          r.T_target_source.translation().x() += 3;
        });
    EXPECT_TRUE(result.T_target_source.matrix() == guess.matrix());
  }
}

TEST(Registered, NoPoseOfNotANumberLeavesIt) {
  const PointCloud cloud = bumpy_tunnel(10, 1);
  const auto nonsense = [](const PointCloud&, const PointCloud&, RegistrationResult& result) {
    result.T_target_source.translation().x() = std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_THROW(registered(cloud, cloud, Pose::Identity(), nonsense), std::runtime_error);
}

TEST(Directions, AreNamedByTheTunnel) {
  // Held across and vertically, hardly along; turns held best about the axis.
  Vector6d holds;
  holds << 1, 50, 60, 1e4, 2e4, 3e4;
  const std::vector<Direction> directions = directions_of(holds.asDiagonal(), 10);
  EXPECT_NEAR(directions[0].hold, 1.0 / 300, 1e-12);
  EXPECT_EQ(direction_name(directions[0], {1, 0, 0}), "along");
  EXPECT_EQ(direction_name(directions[0], {0, -1, 0}), "across");
  EXPECT_EQ(direction_name(directions[2], {1, 0, 0}), "vertical");
  EXPECT_EQ(direction_name(directions[3], {1, 0, 0.1}), "turn about along");
  EXPECT_NEAR(directions[5].hold, 1, 1e-12);
}

}  // namespace
}  // namespace minescan
