// SPDX-License-Identifier: MIT
#include "registration/newton.h"

#include <gtest/gtest.h>

#include "clouds.h"

namespace minescan {
namespace {

Vector6d random_vector6(Random& random) {
  Vector6d v;
  for (int i = 0; i < 6; ++i) v[i] = random.normal();
  return v;
}

Matrix6d random_symmetric(Random& random) {
  Matrix6d H;
  for (int i = 0; i < 6; ++i) H.col(i) = random_vector6(random);
  return H + H.transpose();
}

TEST(Newton, SolvesAQuadraticInOneStep) {
  for (std::uint64_t stream = 0; stream < 50; ++stream) {
    Random random(1, stream);
    const Matrix6d root = random_symmetric(random);
    const Matrix6d H = root * root.transpose() + Matrix6d::Identity();
    const Vector6d g = random_vector6(random);
    // Whatever the length: for a positive definite Hessian scaling changes nothing.
    for (const double length : {1.0, 12.0})
      EXPECT_TRUE(newton_step(g, H, length, 1e9).isApprox(-H.inverse() * g, 1e-9));
  }
}

TEST(Newton, GoesDownhillWhateverTheHessian) {
  for (std::uint64_t stream = 0; stream < 200; ++stream) {
    Random random(2, stream);
    const Vector6d g = random_vector6(random);
    const Matrix6d H = random_symmetric(random);  // indefinite, nearly always
    EXPECT_LT(newton_step(g, H, 10, 0.05).dot(g), 0);
    EXPECT_LT(newton_step(g, -H * H, 10, 0.05).dot(g), 0);
  }
  EXPECT_LT(newton_step(Vector6d::Ones(), Matrix6d::Zero(), 10, 0.05).sum(), 0);
  EXPECT_EQ(newton_step(Vector6d::Zero(), Matrix6d::Identity(), 10, 0.05).norm(), 0);
}

TEST(Newton, KeepsToTheLongestStep) {
  Random random(3, 0);
  const Vector6d step = newton_step(random_vector6(random), Matrix6d::Identity(), 1, 0.05);
  EXPECT_NEAR(step.norm(), 0.05, 1e-15);
}

TEST(Newton, StepsTurnAboutTheSourceOriginInTheTargetFrame) {
  Random random(4, 0);
  const Pose T = random_pose(random, 3, 2);
  Vector6d step = Vector6d::Zero();
  step.tail<3>() << 0, 0, 0.2;
  EXPECT_TRUE(stepped(T, step).translation().isApprox(T.translation()));
  EXPECT_NEAR(pose_error(T, stepped(T, step)).rotation, 0.2, 1e-12);
  EXPECT_TRUE(((stepped(T, step).linear() * T.linear().transpose()).col(2))
                  .isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
}

TEST(Newton, RotationsStayRotationsOverManySteps) {
  Random random(5, 0);
  Pose T = Pose::Identity();
  for (int i = 0; i < 1000; ++i) T = stepped(T, 0.05 * random_vector6(random));
  // 1000 products, each rounded to 1e-16.
  EXPECT_NEAR((T.linear() * T.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace minescan
