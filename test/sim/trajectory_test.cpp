// SPDX-License-Identifier: MIT
#include "sim/trajectory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/random.h"

namespace minescan {
namespace {

Eigen::Vector3d random_vector(Random& random) {
  return {random.normal(), random.normal(), random.normal()};
}

// Uneven times and poses about a metre and a third of a radian apart.
Trajectory random_trajectory(std::uint64_t stream, std::size_t count) {
  Random random(21, stream);
  Trajectory trajectory;
  double time = random.normal();
  Pose pose = Pose::Identity();
  for (std::size_t i = 0; i < count; ++i) {
    trajectory.times.push_back(time);
    trajectory.poses.push_back(pose);
    time += 0.5 + random.uniform();
    pose = pose * Eigen::Translation3d(0.5 * random_vector(random));
    pose.linear() = pose.linear() * rotation_exp(0.2 * random_vector(random));
  }
  return trajectory;
}

using Path = std::function<Pose(double)>;

// What one would write first: straight from pose to pose at constant speeds.
Pose straight(const Trajectory& trajectory, double time) {
  const auto& [times, poses] = trajectory;
  std::size_t i = 0;
  while (i + 2 < times.size() && times[i + 1] <= time) ++i;
  const double u = (time - times[i]) / (times[i + 1] - times[i]);
  const Eigen::Quaterniond from(poses[i].linear());
  const Eigen::Quaterniond to(poses[i + 1].linear());
  return Eigen::Translation3d((1 - u) * poses[i].translation() + u * poses[i + 1].translation()) *
         from.slerp(u, to);
}

// Velocity (world) and angular velocity (body) over the short time h that begins at `time`.
Eigen::Matrix<double, 6, 1> rates(const Path& path, double time, double h) {
  const Pose before = path(time);
  const Pose after = path(time + h);
  const Eigen::AngleAxisd turn(before.linear().transpose() * after.linear());
  Eigen::Matrix<double, 6, 1> result;
  result << (after.translation() - before.translation()) / h, turn.angle() * turn.axis() / h;
  return result;
}

// The largest jump of those at the inner poses.
double largest_jump(const Trajectory& trajectory, const Path& path) {
  double largest = 0;
  for (std::size_t i = 1; i + 1 < trajectory.times.size(); ++i) {
    const double h = 1e-6;
    const Eigen::Matrix<double, 6, 1> jump =
        rates(path, trajectory.times[i], h) - rates(path, trajectory.times[i] - h, h);
    largest = std::max(largest, jump.cwiseAbs().maxCoeff());
  }
  return largest;
}

double difference(const Pose& a, const Pose& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

TEST(SmoothPath, PassesThroughEveryPose) {
  const Trajectory trajectory = random_trajectory(0, 20);
  const SmoothPath path(trajectory);
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    // A few roundings of entries of size 5.
    EXPECT_LT(difference(path.at(trajectory.times[i]), trajectory.poses[i]), 1e-14) << i;
  }
}

TEST(SmoothPath, KeepsConstantVelocityAndTurnRate) {
  const Eigen::Vector3d velocity(1.5, -0.5, 0.1);
  const Eigen::Vector3d turn_rate(0.3, -0.2, 1.1);  // body and world agree: its own axis
  const Eigen::Matrix3d start = rotation_exp({1, 2, 3});
  const Path exact = [&](double time) {
    return Eigen::Translation3d(time * velocity) * Pose(start * rotation_exp(time * turn_rate));
  };
  Trajectory trajectory;
  for (const double time : {-1.0, 0.3, 0.5, 1.75, 4.0}) {
    trajectory.times.push_back(time);
    trajectory.poses.push_back(exact(time));
  }
  const SmoothPath path(trajectory);
  for (double time = -1; time <= 4; time += 0.01)
    // Logarithm and exponential of up to 2.6 rad: a few roundings.
    EXPECT_LT(difference(path.at(time), exact(time)), 1e-14) << time;
}

TEST(SmoothPath, OfTwoPosesIsStraight) {
  const Trajectory trajectory = random_trajectory(1, 2);
  const SmoothPath path(trajectory);
  for (const double part : {0.0, 0.2, 0.7, 1.0}) {
    const double time = std::lerp(trajectory.times[0], trajectory.times[1], part);
    EXPECT_LT(difference(path.at(time), straight(trajectory, time)), 1e-14);
  }
}

TEST(SmoothPath, VelocitiesDoNotJumpAtThePoses) {
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    const Trajectory trajectory = random_trajectory(stream, 12);
    const SmoothPath path(trajectory);
    // Accelerations of up to 30 m/s^2 or rad/s^2 over 1e-6 s, and rounding of 1e-15 / 1e-6.
    EXPECT_LT(largest_jump(trajectory, [&](double time) { return path.at(time); }), 1e-4);
    // That the measure sees a jump where there is one.
    EXPECT_GT(largest_jump(trajectory, [&](double time) { return straight(trajectory, time); }),
              0.5);
  }
}

TEST(SmoothPath, ErrorFallsWithTheThirdPowerOfTheStep) {
  const Path exact = [](double t) {
    return Eigen::Translation3d(3 * std::sin(t), std::cos(2 * t), 0.2 * t * t) *
           Pose(rotation_exp({std::sin(t), 0.5 * std::cos(t), t}) *
                rotation_exp({0, 0.3 * t * t, 0}));
  };
  const auto errors = [&](std::size_t pieces) {
    Trajectory trajectory;
    for (std::size_t i = 0; i <= pieces; ++i) {
      // Long and short steps in turn: 1.3 and 0.7 of their mean.
      const double place = static_cast<double>(i) + (i % 2 == 1 ? 0.3 : 0);
      trajectory.times.push_back(2 * place / static_cast<double>(pieces));
      trajectory.poses.push_back(exact(trajectory.times.back()));
    }
    const SmoothPath path(trajectory);
    PoseError largest;
    for (double time = 0; time <= 2; time += 1.0 / 1024) {
      const PoseError error = pose_error(exact(time), path.at(time));
      largest.translation = std::max(largest.translation, error.translation);
      largest.rotation = std::max(largest.rotation, error.rotation);
    }
    return largest;
  };
  const PoseError coarse = errors(64);
  const PoseError fine = errors(128);
  EXPECT_LT(fine.translation, 1e-5);
  EXPECT_LT(fine.rotation, 1e-5);
  // 2^3 = 8, approached from below; second order would give 4.
  EXPECT_GT(coarse.translation / fine.translation, 7);
  EXPECT_GT(coarse.rotation / fine.rotation, 7);
}

TEST(SmoothPath, RefusesTimesBeyondItsEnds) {
  const SmoothPath path({.times = {1, 2}, .poses = {Pose::Identity(), Pose::Identity()}});
  EXPECT_NO_THROW(path.at(1));
  EXPECT_NO_THROW(path.at(2));
  EXPECT_THROW(path.at(0.999), std::invalid_argument);
  EXPECT_THROW(path.at(2.001), std::invalid_argument);
  EXPECT_THROW(path.at(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

std::string complaint(const Trajectory& trajectory) {
  try {
    check(trajectory);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST(Trajectory, ComplaintsNameTheIndexAndTheValue) {
  const Pose here = Pose::Identity();
  EXPECT_EQ(complaint({.times = {0, 1}, .poses = {here, here}}), "none");
  EXPECT_EQ(complaint({.times = {0}, .poses = {here}}),
            "trajectory: expected two poses or more, found 1");
  EXPECT_EQ(complaint({.times = {0, 1}, .poses = {here}}),
            "trajectory: 2 times for 1 poses: expected as many of one as of the other");
  EXPECT_EQ(complaint({.times = {0, 1, 2, 1.5}, .poses = {here, here, here, here}}),
            "trajectory: time 3 = 1.5 s: expected more than the 2 s before it");
  EXPECT_EQ(
      complaint({.times = {0, std::numeric_limits<double>::infinity()}, .poses = {here, here}}),
      "trajectory: time 1 = inf s: expected a finite number");
  Pose lost = here;
  lost.translation().y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(complaint({.times = {0, 1}, .poses = {here, lost}}),
            "trajectory: pose 1 is at (0, nan, 0): expected finite numbers");
  Pose stretched = here;
  stretched.linear() *= 1.5;
  EXPECT_EQ(complaint({.times = {0, 1}, .poses = {stretched, here}}),
            "trajectory: pose 0: expected a rotation, R^T R differs from the identity by 1.25");
  Pose mirrored = here;
  mirrored.linear().col(0) *= -1;
  EXPECT_EQ(complaint({.times = {0, 1}, .poses = {mirrored, here}}),
            "trajectory: pose 0: expected a rotation, found a mirror image");
  EXPECT_THROW(SmoothPath({.times = {0}, .poses = {here}}), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
