// SPDX-License-Identifier: MIT
#include "registration/pose_parameters.h"

#include <gtest/gtest.h>

#include <numbers>

#include "clouds.h"
#include "registration/ndt.h"
#include "registration/ndt_score.h"
#include "registration/newton.h"

namespace minescan {
namespace {

constexpr PoseForm forms[] = {PoseForm::local,           PoseForm::twist,      PoseForm::right,
                              PoseForm::rotation_vector, PoseForm::axis_angle, PoseForm::quaternion,
                              PoseForm::euler,           PoseForm::planar};

std::string name_of(PoseForm form) { return value_text(form); }

Parameters random_parameters(Random& random, int size) {
  Parameters p(size);
  for (int i = 0; i < size; ++i) p[i] = random.normal();
  return p;
}

/// A sum of terms, each with its cell for good, in the plainest form.
struct FrozenCells {
  std::vector<NdtCell> cells = {};
  std::vector<Eigen::Vector3d> points = {};

  FrozenCells(Random& random, const Pose& T) {
    for (int i = 0; i < 10; ++i) {
      Eigen::Matrix3d root;
      for (int k = 0; k < 9; ++k) root(k) = random.normal();
      const Eigen::Matrix3d L = root * root.transpose();
      cells.push_back({.mean = random_vector(random),
                       .information = {L(0, 0), L(0, 1), L(0, 2), L(1, 1), L(1, 2), L(2, 2)}});
      points.push_back(T.inverse() * (cells.back().mean + 0.5 * random_vector(random)));
    }
  }
  double value(const Pose& T) const {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d x = T.linear() * points[i] + T.translation() - cells[i].mean;
      sum -= std::exp(-x.dot(information_matrix(cells[i]) * x) / 2);
    }
    return sum;
  }
  Score score(const Pose& T, Curvature curvature) const {
    Score sum;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Score term = ndt_score(cells[i], T, points[i], curvature);
      sum.value += term.value;
      sum.gradient += term.gradient;
      sum.hessian += term.hessian;
    }
    return sum;
  }
};

/// Central differences of `value` about zero.
template <class Value>
Parameters gradient_of(const Value& value, int size) {
  const double h = 1e-5;
  Parameters g(size);
  for (int i = 0; i < size; ++i) {
    const Parameters step = h * Parameters::Unit(size, i);
    g[i] = (value(step) - value(Parameters(-step))) / (2 * h);
  }
  return g;
}
template <class Value>
ParameterMatrix hessian_of(const Value& value, int size, double k) {
  ParameterMatrix H(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      const auto at = [&](double a, double b) {
        return value(Parameters(a * Parameters::Unit(size, i) + b * Parameters::Unit(size, j)));
      };
      // Richardson's combination of two widths: what is left goes with k^4.
      const auto mixed = [&](double w) {
        return (at(w, w) - at(w, -w) - at(-w, w) + at(-w, -w)) / (4 * w * w);
      };
      H(i, j) = (4 * mixed(k) - mixed(2 * k)) / 3;
    }
  }
  return H;
}

// Frozen cells, rigid poses: gradient truncation 1e-10 times a third derivative of up to 1e3,
// Hessian truncation 1e-12 times a sixth one, rounding 1e-15 / k^2 = 1e-9.
TEST(PoseParameters, ScoreHasTheDerivativesOfDifferences) {
  for (const PoseForm form : forms) {
    for (std::uint64_t stream = 0; stream < 20; ++stream) {
      Random random(11, stream);
      const Pose T = random_pose(random, 1, 3);
      const FrozenCells frozen(random, T);
      const PoseParameters at(T, {.form = form});
      const int n = at.size();
      const auto value = [&](const Parameters& step) {
        return frozen.value(at.moved(step).pose());
      };
      const ParameterScore score =
          chained(frozen.score(at.pose(), Curvature::full), at.derivatives(), n, Curvature::full);
      EXPECT_TRUE(at.pose().isApprox(T, 1e-12)) << name_of(form);
      EXPECT_LT((score.gradient - gradient_of(value, n)).norm(), 1e-6) << name_of(form) << stream;
      EXPECT_LT((score.hessian - hessian_of(value, n, 1e-3)).norm(),
                1e-5 * score.hessian.norm() + 1e-5)
          << name_of(form) << stream;
    }
  }
}

/// The plain sum over a cloud of means, displaced so little that every point keeps its cell.
struct OneCloud {
  NdtGrid grid{bumpy_tunnel(20000, 1).points, {}};
  std::vector<Eigen::Vector3d> points = {};

  explicit OneCloud(const Pose& T) {
    Random random(12, 0);
    // 5 cm from the means of those cells in which this leaves another 5 cm to every face.
    for (const NdtCell& cell : grid.cells()) {
      const Eigen::Vector3d middle = (cell.mean.array().floor() + 0.5).matrix();
      if ((cell.mean - middle).cwiseAbs().maxCoeff() < 0.4)
        points.push_back(T.inverse() * (cell.mean + 0.05 * random_vector(random).normalized()));
    }
    points.resize(std::min<std::size_t>(points.size(), 60));
  }
};

// Through the 12 numbers of the matrix, also where the axis is none of unit length.
TEST(PoseParameters, AffineScoreHasTheDerivativesOfDifferences) {
  for (const PoseForm form : forms) {
    Random random(13, 0);
    const Pose T = random_pose(random, 1, 2);
    const OneCloud cloud(T);
    ASSERT_EQ(cloud.points.size(), 60u);
    for (const double length : {1.0, 1.0005}) {
      const PoseParameters start(T, {.form = form, .renormalise = false});
      Parameters stretch = Parameters::Zero(start.size());
      if (form == PoseForm::axis_angle)
        stretch.segment<3>(3) = (length - 1) * start.values().segment<3>(3);
      const PoseParameters at = start.moved(stretch);
      const int n = at.size();
      const auto value = [&](const Parameters& step) {
        return ndt_value(cloud.grid, at.moved(step).pose(), cloud.points);
      };
      const AffineScore affine = ndt_affine_score(cloud.grid, at.pose(), cloud.points);
      EXPECT_EQ(affine.value, ndt_value(cloud.grid, at.pose(), cloud.points));
      const ParameterScore score = chained(affine, at.derivatives(), n, Curvature::full);
      // Here the information is up to 1e4 1/m^2 and levers are 12 m, so that derivatives are large
      // and steps must be short. Truncation: (12 m h)^2 times the information, (12 m k)^4 times
      // its square.
      const Parameters g = gradient_of(value, n);
      const ParameterMatrix H = hessian_of(value, n, 2e-4);
      const double turn = form == PoseForm::quaternion ? 2 : 1;  // of which its numbers are halves
      EXPECT_LT((score.gradient - g).norm(), turn * turn * 1e-5 * g.norm())
          << name_of(form) << length;
      EXPECT_LT((score.hessian - H).norm(), 1e-4 * H.norm()) << name_of(form) << length;
    }
  }
}

// Two chains from sums of the same points: where parameters move rigidly they must agree.
TEST(PoseParameters, BothChainsGiveTheSameDerivatives) {
  for (const PoseForm form : forms) {
    for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
      Random random(14, 0);
      const Pose T = random_pose(random, 1, 2);
      const OneCloud cloud(T);
      const PoseParameters at(T, {.form = form});
      const ParameterScore rigid = chained(ndt_score(cloud.grid, T, cloud.points, curvature),
                                           at.derivatives(), at.size(), curvature);
      const ParameterScore affine =
          chained(ndt_affine_score(cloud.grid, T, cloud.points, curvature), at.derivatives(),
                  at.size(), curvature);
      // Rounding of sums of 60 terms with levers of 12 m.
      EXPECT_TRUE(rigid.gradient.isApprox(affine.gradient, 1e-10)) << name_of(form);
      EXPECT_TRUE(rigid.hessian.isApprox(affine.hessian, 1e-10)) << name_of(form);
      EXPECT_TRUE(rigid.hessian.isApprox(rigid.hessian.transpose(), 1e-10)) << name_of(form);
    }
  }
}

// A direction in which the pose moves has one slope, whatever the parameters: of axis_angle, too,
// along what keeps the axis a unit vector.
TEST(PoseParameters, EveryFormHasTheSameSlope) {
  for (const PoseForm form : forms) {
    Random random(15, 0);
    const Pose T = random_pose(random, 1, 2);
    const FrozenCells frozen(random, T);
    const Score local = frozen.score(T, Curvature::full);
    const PoseParameters at(T, {.form = form});
    const ParameterScore score = chained(local, at.derivatives(), at.size(), Curvature::full);
    Parameters direction = random_parameters(random, at.size());
    if (form == PoseForm::axis_angle) {
      const Eigen::Vector3d r = at.values().segment<3>(3), d = direction.segment<3>(3);
      direction.segment<3>(3) -= r * r.dot(d);
    }
    const double h = 1e-6;
    const Pose there = at.moved(h * direction).pose(), back = at.moved(-h * direction).pose();
    Vector6d motion;
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(there.linear() * back.linear().transpose()));
    motion << there.translation() - back.translation(), turn.angle() * turn.axis();
    // Central differences: h^2 and, of angles by a quaternion, 1e-16 / h.
    EXPECT_NEAR(score.gradient.dot(direction), local.gradient.dot(motion) / (2 * h), 1e-7)
        << name_of(form);
  }
}

TEST(PoseParameters, RotationsStayRotationsOverManySteps) {
  for (const PoseForm form : forms) {
    Random random(16, 0);
    PoseParameters at(random_pose(random, 1, 2), {.form = form});
    for (int i = 0; i < 1000; ++i) at = at.moved(0.05 * random_parameters(random, at.size()));
    const Eigen::Matrix3d R = at.pose().linear();
    // 1000 products, each rounded to 1e-16.
    EXPECT_NEAR(R.determinant(), 1, 1e-12) << name_of(form);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12) << name_of(form);
    if (form == PoseForm::axis_angle) {
      EXPECT_NEAR(at.values().segment<3>(3).norm(), 1, 1e-12);
    }
    if (form == PoseForm::rotation_vector) {
      EXPECT_LE(at.values().segment<3>(3).norm(), std::numbers::pi);
    }
  }
}

TEST(PoseParameters, AnAxisThatIsNotRenormalisedDeforms) {
  Random random(17, 0);
  const Pose T = random_pose(random, 1, 2);
  PoseParameters at(T, {.form = PoseForm::axis_angle, .renormalise = false});
  Parameters step = Parameters::Zero(7);
  step.segment<3>(3) = 0.1 * at.values().segment<3>(3);
  at = at.moved(step);
  const Eigen::Matrix3d R = at.pose().linear();
  EXPECT_GT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-3);
  EXPECT_TRUE(at.rigid_pose().isApprox(T, 1e-12));
}

TEST(PoseParameters, HoldForEveryRotation) {
  const double pi = std::numbers::pi;
  for (const PoseForm form : forms) {
    for (const double angle : {0.0, 1e-13, 1e-9, 1e-4, pi / 2, pi - 1e-9, pi}) {
      for (int axis = 0; axis < 3; ++axis) {
        const Pose T(Eigen::Translation3d(1, 2, 3) *
                     Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)));
        const PoseParameters at(T, {.form = form});
        EXPECT_TRUE(at.pose().isApprox(T, 1e-12)) << name_of(form) << angle << axis;
        for (const PoseDerivatives::Matrix& m : at.derivatives().first)
          EXPECT_TRUE(m.allFinite()) << name_of(form) << angle << axis;
      }
    }
  }
}

TEST(PoseParameters, RefuseAnAxisOfNoLength) {
  EXPECT_THROW(PoseParameters(Pose::Identity(), {.form = PoseForm::axis_angle,
                                                 .start_axis = Eigen::Vector3d::Zero()}),
               std::invalid_argument);
}

// The search ends after the first step that changes the norm by less than stop_step, however long
// the step is.
TEST(PoseParameters, StopByTheChangeOfTheNorm) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const Pose start = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);
  const PoseOptions by_norm{.form = PoseForm::rotation_vector, .stop_rule = StopRule::norm_change};
  const PoseOptions by_step{.form = PoseForm::rotation_vector};
  const auto after = [&](const PoseOptions& pose, double stop_step, int iterations) {
    return register_ndt(
        target, source, start,
        {.search = {.stop_step = stop_step, .max_iterations = iterations}, .pose = pose});
  };
  for (const double stop_step : {0.01, 1e-3, 1e-4}) {
    const RegistrationResult stopped = after(by_norm, stop_step, 100);
    ASSERT_EQ(stopped.status, Status::converged);
    ASSERT_GT(stopped.iterations, 1);
    double norm = PoseParameters(start, by_step).values().norm();
    for (int i = 1; i <= stopped.iterations; ++i) {
      const Pose pose = after(by_step, 1e-12, i).T_target_source;
      const double next = PoseParameters(pose, by_step).values().norm();
      EXPECT_EQ(std::abs(next - norm) < stop_step, i == stopped.iterations)
          << stop_step << ' ' << i;
      norm = next;
    }
  }
  for (const PoseForm form : {PoseForm::local, PoseForm::twist, PoseForm::right})
    EXPECT_THROW(register_ndt(target, source, start,
                              {.pose = {.form = form, .stop_rule = StopRule::norm_change}}),
                 std::invalid_argument);
}

TEST(RegisterNdt, FindsTheTrueMotionInEveryForm) {
  const PointCloud target = bumpy_tunnel(30000, 1);
  const Pose error = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);
  const Pose level = displaced(Pose::Identity(), {0.2, -0.15, 0}, {0, 0, 1}, 0.05);
  for (const PoseForm form : forms) {
    for (const bool renormalise : {true, false}) {
      if (!renormalise && form != PoseForm::axis_angle) continue;
      for (const Optimiser optimiser : {Optimiser::newton, Optimiser::levenberg_marquardt}) {
        Random random(18, 0);
        const Pose truth = random_pose(random, 2, 3);
        const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(20000, 2));
        const Pose guess = (form == PoseForm::planar ? level : error) * truth;
        const RegistrationResult result =
            register_ndt(target, source, guess,
                         {.search = {.optimiser = optimiser},
                          .pose = {.form = form, .renormalise = renormalise}});
        const PoseError left = pose_error(truth, result.T_target_source);
        EXPECT_EQ(result.status, Status::converged) << name_of(form);
        // As RegisterNdt.FindsTheTrueMotionFromNearby: the bias of 1 m cells.
        EXPECT_LT(left.translation, 0.01) << name_of(form);
        EXPECT_LT(left.rotation, 0.001) << name_of(form);
      }
    }
  }
}

// Without a rotation the matrix does not depend on the axis: with a Hessian that is shifted, steps
// of the axis stay so small that only turns about the stored one are found. Absolute eigenvalues
// make them long enough to escape.
TEST(RegisterNdt, AxisAngleWithoutARotationTurnsAboutTheStoredAxis) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const Pose truth = displaced(Pose::Identity(), {0.1, -0.1, 0.1}, {1, 0, 0}, 0.08);
  const auto rotation_left = [&](const PoseOptions& pose, Repair repair) {
    const RegistrationResult result =
        register_ndt(target, transformed(truth.inverse(), source), Pose::Identity(),
                     {.search = {.repair = repair}, .pose = pose});
    return pose_error(truth, result.T_target_source).rotation;
  };
  const PoseOptions about_z{.form = PoseForm::axis_angle};
  const PoseOptions about_x{.form = PoseForm::axis_angle, .start_axis = Eigen::Vector3d::UnitX()};
  EXPECT_LT(rotation_left({}, Repair::shift), 0.001);
  EXPECT_GT(rotation_left(about_z, Repair::shift), 0.07);
  EXPECT_LT(rotation_left(about_z, Repair::absolute), 0.003);
  EXPECT_LT(rotation_left(about_x, Repair::shift), 0.003);
}

TEST(RegisterNdt, AnAxisOfAnyLengthIsForTheBaselinesCells) {
  const PointCloud cloud = bumpy_tunnel(1000, 1);
  EXPECT_THROW(register_ndt(cloud, cloud, Pose::Identity(),
                            {.terms = {.linked = true},
                             .pose = {.form = PoseForm::axis_angle, .renormalise = false}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace minescan
