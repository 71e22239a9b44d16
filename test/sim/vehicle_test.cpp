// SPDX-License-Identifier: MIT
#include "sim/vehicle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "core/random.h"

namespace minescan {
namespace {

// Ground that is nowhere missing.
Ground everywhere(const std::function<double(double x, double y)>& height) {
  return [height](const Eigen::Vector3d& from) -> std::optional<double> {
    return height(from.x(), from.y());
  };
}

double yaw(const Pose& pose) { return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)); }

void expect_rotation(const Pose& pose) {
  const Eigen::Matrix3d R = pose.linear();
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_GT(R.determinant(), 0);
}

TEST(Stand, OnAPlaneIsExact) {
  const VehicleOptions options{.scanner_height = 1.2};
  for (std::uint64_t stream = 0; stream < 50; ++stream) {
    Random random(31, stream);
    const Eigen::Vector3d normal =
        Eigen::Vector3d(0.3 * random.normal(), 0.3 * random.normal(), 1).normalized();
    const Eigen::Vector3d on_it(3 * random.normal(), 3 * random.normal(), random.normal());
    const double heading = 10 * random.normal();
    const Ground plane = everywhere([&](double x, double y) {
      return on_it.z() - (normal.x() * (x - on_it.x()) + normal.y() * (y - on_it.y())) / normal.z();
    });
    const Eigen::Vector3d line = on_it + Eigen::Vector3d(0, 0, 0.4 * random.uniform() - 0.2);
    const Pose pose = stand(options, plane, line, heading);
    expect_rotation(pose);
    // A few roundings of numbers up to 10.
    EXPECT_LT((pose.translation() - (on_it + 1.2 * normal)).norm(), 1e-13);
    EXPECT_LT((pose.linear().col(2) - normal).norm(), 1e-13);
    EXPECT_NEAR(std::remainder(yaw(pose) - heading, 2 * std::numbers::pi), 0, 1e-13);
    EXPECT_NEAR(tilt(pose), std::acos(normal.z()), 1e-7);
  }
}

TEST(Stand, OneWheelOnAStoneTiltsByTheLeastSquares) {
  // 4 cm under the front left wheel: the mean rises by 1 cm, each slope is half of 4 cm over base.
  const VehicleOptions options{.wheelbase = 0.4, .track = 0.5, .scanner_height = 0};
  const Ground stone =
      everywhere([](double x, double y) { return x > 0.1 && y > 0.1 ? 0.04 : 0.0; });
  const Pose pose = stand(options, stone, {0, 0, 0}, 0);
  EXPECT_NEAR(pose.translation().z(), 0.01, 1e-15);
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.02 / 0.4, -0.02 / 0.5, 1).normalized();
  EXPECT_LT((pose.linear().col(2) - normal).norm(), 1e-15);
  // The other way round it is the rear right wheel that stands on it.
  EXPECT_LT((stand(options, stone, {0, 0, 0}, std::numbers::pi).linear().col(2) - normal).norm(),
            1e-15);
}

TEST(Stand, PatchesEvenOutWhatIsFinerThanThey) {
  // On a flat floor with ripples 3 cm long the wheels stand nearly level; point contacts do not.
  const auto worst = [](double patch) {
    const VehicleOptions options{.wheel_patch = patch};
    const Ground ripples =
        everywhere([](double x, double y) { return 0.01 * std::sin(210 * x) * std::cos(210 * y); });
    double most = 0;
    for (int i = 0; i < 200; ++i)
      most = std::max(most, tilt(stand(options, ripples, {0.0137 * i, 0.0071 * i, 0}, 0.1 * i)));
    return most;
  };
  EXPECT_LT(worst(0.05), 0.6 * worst(0));
}

TEST(Stand, NamesThePlaceWithoutGround) {
  const auto complaint = [](const Ground& ground) -> std::string {
    try {
      stand({}, ground, {12, -3, 0.5}, 0);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "none";
  };
  const std::string expected =
      "vehicle at (12, -3, 0.5): no ground for its wheels within 1 m above and 2 m below";
  EXPECT_EQ(complaint([](const Eigen::Vector3d&) { return std::nullopt; }), expected);
  // Below one wheel only; too deep; too high; not a number.
  EXPECT_EQ(complaint([](const Eigen::Vector3d& p) {
              return p.x() > 12 && p.y() > -3 ? std::optional<double>() : 0.4;
            }),
            expected);
  EXPECT_EQ(complaint(everywhere([](double, double) { return -1.6; })), expected);
  EXPECT_EQ(complaint(everywhere([](double, double) { return 1.6; })), expected);
  EXPECT_EQ(complaint(everywhere(
                [](double, double) { return std::numeric_limits<double>::quiet_NaN(); })),
            expected);
  EXPECT_EQ(complaint(everywhere([](double, double) { return -1.4; })), "none");
  EXPECT_EQ(complaint(everywhere([](double, double) { return 1.4; })), "none");
}

TEST(Stand, LooksForTheGroundBelowTheRoof) {
  stand(
      {},
      [](const Eigen::Vector3d& from) -> std::optional<double> {
        EXPECT_NEAR(from.z(), 2.5 + 1, 1e-12);
        return 2.5;
      },
      {0, 0, 2.5}, 0);
}

TEST(StandClear, StepsAsideOnlyWhereItMust) {
  const VehicleOptions options{.wheel_patch = 0, .max_tilt = 0.1, .sidestep = 0.5};
  // On a level floor, or one tilted less than allowed, it stays.
  const Ground slope = everywhere([](double x, double) { return 0.09 * x; });
  EXPECT_EQ(stand_clear(options, slope, {1, 2, 0}, 0.3).matrix(),
            stand(options, slope, {1, 2, 0}, 0.3).matrix());
  // A kerb of 0.2 m below the left wheels, y > 0.15: a step to the right is clear of it.
  const Ground kerb = everywhere([](double, double y) { return y > 0.15 ? 0.2 : 0.0; });
  const Pose aside = stand_clear(options, kerb, {0, 0, 0}, 0);
  EXPECT_LT((aside.translation() - Eigen::Vector3d(0, -0.1, 1)).norm(), 1e-12);
  EXPECT_NEAR(tilt(aside), 0, 1e-12);
  // Seen from the other direction, the same side is the left.
  EXPECT_LT((stand_clear(options, kerb, {0, 0, 0}, std::numbers::pi).translation() -
             Eigen::Vector3d(0, -0.1, 1))
                .norm(),
            1e-12);
}

TEST(StandClear, TriesTheLeftFirst) {
  const VehicleOptions options{.wheel_patch = 0, .max_tilt = 0.1, .sidestep = 0.5};
  // A stone below the left wheels, 0.2 m beside the line: 0.1 m to either side clears it.
  const Ground stone =
      everywhere([](double, double y) { return std::abs(y - 0.2) < 0.05 ? 0.2 : 0.0; });
  EXPECT_NEAR(stand_clear(options, stone, {0, 0, 0}, 0).translation().y(), 0.1, 1e-12);
}

TEST(StandClear, TakesTheFlattestIfNoneIsFlatEnough) {
  // A bowl: the farther from y = -0.3, the steeper; and everywhere too steep along x.
  const VehicleOptions options{.wheel_patch = 0, .max_tilt = 0.1, .sidestep = 0.5};
  const Ground bowl =
      everywhere([](double x, double y) { return 0.2 * x + 0.5 * (y + 0.3) * (y + 0.3); });
  const Pose pose = stand_clear(options, bowl, {0, 0, 0}, 0);
  EXPECT_EQ(pose.matrix(), stand(options, bowl, {0, 3 * -0.1, 0}, 0).matrix());
  // 0.2 m do not reach there.
  const VehicleOptions near{.wheel_patch = 0, .max_tilt = 0.1, .sidestep = 0.2};
  EXPECT_EQ(stand_clear(near, bowl, {0, 0, 0}, 0).matrix(),
            stand(near, bowl, {0, 2 * -0.1, 0}, 0).matrix());
}

TEST(StandClear, NeedsGroundAtOneOfThePlaces) {
  const Ground half = [](const Eigen::Vector3d& p) {
    return p.y() > 0 ? std::optional<double>() : 0.0;
  };
  EXPECT_THROW(stand({}, half, {0, 0, 0}, 0), std::runtime_error);
  EXPECT_LT(stand_clear({}, half, {0, 0, 0}, 0).translation().y(), -0.2);
  EXPECT_THROW(stand_clear({}, half, {0, 5, 0}, 0), std::runtime_error);
}

TEST(Drive, StandsAtEveryPlaceAtItsTime) {
  const VehicleOptions options{.speed = 0.8};
  const Route route({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, false, 3);
  const Ground waves =
      everywhere([](double x, double y) { return 0.1 * std::sin(x) + 0.05 * std::cos(y); });
  const Trajectory trajectory = drive(options, waves, route, 1.05, 12);
  EXPECT_NO_THROW(check(trajectory));
  EXPECT_EQ(trajectory.times.front(), 0);
  EXPECT_NEAR(trajectory.times.back(), (12 - 1.05) / 0.8, 1e-12);
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    const RoutePlace place = route.at(1.05 + 0.8 * trajectory.times[i]);
    const Pose expected = stand(options, waves, place.position, place.heading);
    EXPECT_LT((trajectory.poses[i].matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-12);
    if (i > 0) {
      const double step = 0.8 * (trajectory.times[i] - trajectory.times[i - 1]);
      EXPECT_LT(std::abs(step - 0.1), 0.001);
    }
  }
}

// Between its poses the smooth path is where the vehicle would stand, as the ground it feels is
// smooth over 0.1 m.
TEST(Drive, IsDenseEnoughForTheGround) {
  const VehicleOptions options{.speed = 1};
  const Route route({{0, 0, 0}, {10, 0, 0}}, false, 3);
  const Ground waves = everywhere([](double x, double y) {
    return 0.03 * std::sin(2 * std::numbers::pi * x / 0.8) + 0.02 * std::sin(5 * y + x);
  });
  const SmoothPath path(drive(options, waves, route, 0, 10));
  for (double time = 0.5; time < 9.5; time += 0.013) {
    const PoseError error = pose_error(stand(options, waves, {time, 0, 0}, 0), path.at(time));
    // Cubics over steps of 1/8 of a wave: (2 pi / 8)^3 / 125 or so of amplitudes 3 cm and 0.2 rad.
    EXPECT_LT(error.translation, 0.002);
    EXPECT_LT(error.rotation, 0.002);
  }
}

TEST(Drive, RefusesWhatIsNotOnTheRoute) {
  const Ground level = everywhere([](double, double) { return 0.0; });
  const Route open({{0, 0, 0}, {10, 0, 0}}, false, 3);
  EXPECT_THROW(drive({}, level, open, 5, 5), std::invalid_argument);
  EXPECT_THROW(drive({}, level, open, 5, 11), std::invalid_argument);
  EXPECT_THROW(drive({.speed = 0}, level, open, 5, 6), std::invalid_argument);
  EXPECT_NO_THROW(drive({}, level, open, 0, 10));
  const Route ring({{0, 0, 0}, {10, 0, 0}, {5, 8, 0}}, true, 2);
  EXPECT_NO_THROW(drive({}, level, ring, 20, 60));
}

TEST(VehicleOptions, DefaultsAreWithinTheirLimits) {
  VehicleOptions options;
  for (const Field& field : fields_of(options)) {
    EXPECT_NO_THROW(field.canonical(field.value)) << field.name;
    EXPECT_FALSE(field.help.empty());
  }
}

}  // namespace
}  // namespace minescan
