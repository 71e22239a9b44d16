// SPDX-License-Identifier: MIT
#include "registration/icp.h"

#include <gtest/gtest.h>

#include <limits>

#include "clouds.h"
#include "registration/icp_pairs.h"

namespace minescan {
namespace {

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

TEST(RegisterIcp, RegistersACloudWithItselfExactly) {
  Random random(1, 0);
  const Pose truth = random_pose(random, 3, 2);
  const PointCloud target = bumpy_tunnel(20000, 1);
  const PointCloud source = transformed(truth.inverse(), target);
  const RegistrationResult result =
      register_icp(target, source, near_identity * truth, {.tree_error = 0, .stop_step = 1e-9});
  EXPECT_EQ(result.status, Status::converged);
  // Every point finds itself: rounding only.
  EXPECT_LT(pose_error(truth, result.T_target_source).translation, 1e-9);
  EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 1e-9);
  EXPECT_LT(result.score, 1e-20);
}

TEST(RegisterIcp, FindsTheTrueMotionBetweenDifferentSamples) {
  const PointCloud target = bumpy_tunnel(60000, 1);
  for (std::uint64_t stream = 0; stream < 3; ++stream) {
    Random random(2, stream);
    const Pose truth = random_pose(random, 3, 2);
    const PointCloud source = transformed(truth.inverse(), bumpy_tunnel(30000, 2 + stream));
    const RegistrationResult result = register_icp(target, source, near_identity * truth);
    EXPECT_EQ(result.status, Status::converged);
    // A fifth of the start error (0.27 m, 0.05 rad): where only relief holds the pose, along the
    // tunnel, steps fall below 1e-4 before the end is reached.
    EXPECT_LT(pose_error(truth, result.T_target_source).translation, 0.05);
    EXPECT_LT(pose_error(truth, result.T_target_source).rotation, 0.01);
    EXPECT_EQ(result.used_points, 3000u);
    EXPECT_GT(result.covariance.determinant(), 0);
  }
}

// Every step is the same in another frame, so the ends differ by the rounding of coordinates of
// some tens of metres, carried through as many steps.
TEST(RegisterIcp, MovingBothCloudsMovesTheResultAlong) {
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(5000, 2);
  const IcpOptions options{.sampling = {.ratio = 1}, .tree_error = 0};
  const Pose here = register_icp(target, source, near_identity, options).T_target_source;
  for (std::uint64_t stream = 0; stream < 3; ++stream) {
    Random random(5, stream);
    const Pose move = random_pose(random, 10, 3);
    const RegistrationResult there =
        register_icp(transformed(move, target), transformed(move, source),
                     move * near_identity * move.inverse(), options);
    const PoseError error = pose_error(move * here * move.inverse(), there.T_target_source);
    EXPECT_LT(error.translation, 1e-9) << stream;
    EXPECT_LT(error.rotation, 1e-9) << stream;
  }
}

// Both ways see the same surface with the same noise; each ends within a few times the noise of the
// mean, 5 mm / sqrt(5000), and within the bias that noise gives to nearest points, below 1 mm.
TEST(RegisterIcp, SwappingTheCloudsInvertsTheResult) {
  const PointCloud target = bumpy_tunnel(20000, 1);
  PointCloud source = target;
  Random random(6, 0);
  for (Eigen::Vector3d& p : source.points) p += 0.005 * random_vector(random);
  const IcpOptions options{.sampling = {.ratio = 1}, .tree_error = 0};
  const Pose forth = register_icp(target, source, near_identity, options).T_target_source;
  const Pose back = register_icp(source, target, near_identity.inverse(), options).T_target_source;
  EXPECT_LT(pose_error(forth.inverse(), back).translation, 0.002);
  EXPECT_LT(pose_error(forth.inverse(), back).rotation, 0.0005);
}

TEST(RegisterIcp, FollowingNeighboursFindsTheSamePairsAsSearching) {
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(5000, 2);
  for (const int iterations : {1, 2, 5, 20}) {
    const auto run = [&](bool tracked) {
      return register_icp(target, source, near_identity,
                          {.max_distance = 0.5,
                           .tracked = tracked,
                           .search = TreeSearch::exact,
                           .max_iterations = iterations});
    };
    const RegistrationResult followed = run(true), searched = run(false);
    EXPECT_TRUE(followed.T_target_source.isApprox(searched.T_target_source, 0));
    EXPECT_EQ(followed.score, searched.score);
    EXPECT_EQ(followed.empty_points, searched.empty_points);
  }
}

// Besl and McKay's theorem: it holds with exact neighbours and without rejection only.
TEST(RegisterIcp, MeanSquaredDistanceNeverGrows) {
  const PointCloud target = bumpy_tunnel(5000, 1), source = bumpy_tunnel(5000, 2);
  double last = std::numeric_limits<double>::infinity();
  for (int iterations = 1; iterations <= 30; ++iterations) {
    const RegistrationResult result =
        register_icp(target, source, near_identity,
                     {.max_distance = 1000, .tree_error = 0, .max_iterations = iterations});
    EXPECT_LE(result.score, last * (1 + 1e-12));  // rounding of a sum of 500
    last = result.score;
  }
  EXPECT_LT(last, 0.05);
}

TEST(RegisterIcp, DecreasingLimitShedsTheFarPairs) {
  PointCloud source = bumpy_tunnel(20000, 2);
  for (std::size_t i = 0; i < source.points.size(); ++i)  // a tenth of the scene has moved on
    if (std::abs(source.points[i].x()) < 1.2) source.points[i].y() += 0.4;
  const auto error = [&](const IcpOptions& options) {
    const RegistrationResult result =
        register_icp(bumpy_tunnel(40000, 1), source, near_identity, options);
    EXPECT_EQ(result.status, Status::converged);
    return pose_error(Pose::Identity(), result.T_target_source).translation;
  };
  const double decreasing =
      error({.decrease_iterations = 30, .final_distance = 0.1, .tracked = false});
  EXPECT_LT(decreasing, 0.02);
  EXPECT_LT(decreasing, error({}) / 2);
}

TEST(RegisterIcp, SaysThatScansDoNotOverlap) {
  const Pose guess(Eigen::Translation3d(0, 500, 0));
  const RegistrationResult result =
      register_icp(bumpy_tunnel(5000, 1), bumpy_tunnel(5000, 2), guess);
  EXPECT_EQ(result.status, Status::no_overlap);
  EXPECT_TRUE(result.T_target_source.isApprox(guess, 0));
}

TEST(RegisterIcp, SaysThatALineDoesNotFixThePose) {
  PointCloud line;
  for (int i = 0; i < 200; ++i) line.points.push_back({0.1 * i, 0.05 * i, 1});
  const RegistrationResult result = register_icp(line, line, near_identity);
  EXPECT_EQ(result.status, Status::degenerate);
  EXPECT_TRUE(result.T_target_source.isApprox(near_identity, 0));
}

TEST(RegisterIcp, StopsAtTheIterationLimit) {
  const RegistrationResult result = register_icp(bumpy_tunnel(5000, 1), bumpy_tunnel(5000, 2),
                                                 near_identity, {.max_iterations = 2});
  EXPECT_EQ(result.status, Status::max_iterations);
  EXPECT_EQ(result.iterations, 2);
}

// PCL with its own defaults stops from here after few iterations, far off.
TEST(RegisterIcp, PlanesAndBothNormalsPullToTheTruth) {
  const PointCloud target = bumpy_tunnel(60000, 1), source = bumpy_tunnel(30000, 2);
  const Pose guess = displaced(Pose::Identity(), {0.3, -0.4, 0.2}, {0.5, -0.3, 0.8}, 0.1);
  for (const IcpMetric metric : {IcpMetric::plane, IcpMetric::symmetric, IcpMetric::generalized}) {
    const RegistrationResult result =
        register_icp(target, source, guess, {.metric = metric, .neighbours = 20});
    EXPECT_EQ(result.status, Status::converged);
    // Walls hold it across to millimetres, waves of 10 cm along.
    EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).translation, 0.01);
    EXPECT_LT(pose_error(Pose::Identity(), result.T_target_source).rotation, 0.002);
    EXPECT_GT(result.iterations, 3);
    EXPECT_EQ(result.directions.size(), 6u);
    EXPECT_GT(result.covariance(0, 0), result.covariance(2, 2));  // along and vertically
  }
}

TEST(RegisterIcp, OnAPlaneThePlaneMetricIsDegenerateAndThePointMetricIsNot) {
  const PointCloud target = plane(5000, 12, 0.01, 1), source = plane(5000, 12, 0.01, 2);
  for (const IcpMetric metric : {IcpMetric::plane, IcpMetric::symmetric, IcpMetric::generalized}) {
    const RegistrationResult result =
        register_icp(target, source, near_identity, {.metric = metric, .neighbours = 30});
    EXPECT_EQ(result.status, Status::degenerate);
    EXPECT_TRUE(result.T_target_source.isApprox(near_identity, 0));
  }
  EXPECT_NE(register_icp(target, source, near_identity, {}).status, Status::degenerate);
}

TEST(RegisterIcp, BothClosedFormsAndAllSearchesAgree) {
  const PointCloud target = bumpy_tunnel(20000, 1), source = bumpy_tunnel(5000, 2);
  const auto run = [&](const IcpOptions& options) {
    return register_icp(target, source, near_identity, options).T_target_source;
  };
  const Pose reference = run({.tracked = false, .search = TreeSearch::exact});
  const Pose quaternion =
      run({.closed_form = ClosedForm::quaternion, .tracked = false, .search = TreeSearch::exact});
  EXPECT_LT(pose_error(reference, quaternion).translation, 1e-9);
  for (const TreeSearch search : {TreeSearch::relative, TreeSearch::additive})
    EXPECT_LT(pose_error(reference, run({.tracked = false, .search = search, .tree_error = 0}))
                  .translation,
              1e-12);
  // Leaves cut the surface: pairs are wrong at their borders, the pose is not.
  EXPECT_LT(
      pose_error(reference, run({.leaf_size = 50, .tracked = false, .search = TreeSearch::leaf}))
          .translation,
      0.1);
}

TEST(RegisterIcp, RejectionsShedPointsThatTheTargetDoesNotHave) {
  const PointCloud target = bumpy_tunnel(40000, 1);
  PointCloud source = bumpy_tunnel(20000, 2);
  for (std::size_t i = 0; i < source.points.size(); i += 4) source.points[i].y() *= 0.85;
  const auto error = [&](const IcpOptions& options) {
    return pose_error(Pose::Identity(),
                      register_icp(target, source, near_identity, options).T_target_source)
        .translation;
  };
  const double plain = error({});
  EXPECT_LT(error({.kept_pairs = 0.7}), 0.8 * plain);
}

// A box that only the source has seen holds it along the tunnel better than all relief does: points
// chosen once are mostly on it and find no partner; chosen anew, they are in the overlap.
TEST(RegisterIcp, StablePointsChosenAnewAreInTheOverlap) {
  PointCloud target, source = bumpy_tunnel(20000, 2);
  for (const Eigen::Vector3d& p : bumpy_tunnel(40000, 1).points)
    if (p.x() < 1) target.points.push_back(p);
  Random random(31, 0);
  for (int i = 0; i < 2000; ++i)
    source.points.push_back({4, random.uniform() - 0.5, random.uniform() - 0.5});
  IcpOptions options{.sampling = {.ratio = 0.05, .sampling = Sampling::stable},
                     .metric = IcpMetric::plane};
  const RegistrationResult once = register_icp(target, source, near_identity, options);
  options.resample = true;
  const RegistrationResult anew = register_icp(target, source, near_identity, options);
  EXPECT_EQ(anew.used_points, source.points.size());
  ASSERT_EQ(anew.status, Status::converged);
  // As in FindsTheTrueMotionBetweenDifferentSamples: only relief holds along the tunnel.
  EXPECT_LT(pose_error(Pose::Identity(), anew.T_target_source).translation, 0.05);
  EXPECT_GT(pose_error(Pose::Identity(), once.T_target_source).translation, 0.1);

  for (SamplingOptions sampling :
       {SamplingOptions{.sampling = Sampling::spatial},
        SamplingOptions{.sampling = Sampling::stable, .of = SampleOf::target}})
    EXPECT_THROW(
        register_icp(target, source, near_identity, {.sampling = sampling, .resample = true}),
        std::invalid_argument);
}

TEST(IcpPairs, AreWeighedByDistanceAsInEquationOne) {
  IcpPairs pairs{.source = std::vector<Eigen::Vector3d>(3, {0, 0, 0}), .distance = {0.2, 0.8, 0.4}};
  weigh(pairs, PairWeights::distance);
  EXPECT_EQ(pairs.weight, (std::vector<double>{0.75, 0, 0.5}));
  pairs.distance = {0, 0, 0};
  weigh(pairs, PairWeights::distance);
  EXPECT_EQ(pairs.weight, (std::vector<double>{1, 1, 1}));
  pairs.source_normal = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  pairs.target_normal = {{1, 0, 0}, {0.6, 0.8, 0}, {-1, 0, 0}};
  weigh(pairs, PairWeights::normals);
  EXPECT_EQ(pairs.weight, (std::vector<double>{1, 0.6, 0}));
}

TEST(IcpPairs, AreTrimmedToTheClosest) {
  IcpPairs pairs;
  for (int i = 0; i < 10; ++i) {
    pairs.source.push_back({1.0 * i, 0, 0});
    pairs.distance.push_back(i % 5);
  }
  trim(pairs, 0.55);  // 6 of 10: distances 0 0 1 1 2, and the first of the two with 2
  ASSERT_EQ(pairs.size(), 6u);
  const int kept[] = {0, 1, 2, 5, 6, 7};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(pairs.source[i].x(), kept[i]);
}

TEST(NormalShooting, MeetsAPlaneWhereTheLineDoes) {
  PointCloud wall = plane(20000, 6, 0, 1);  // z = -1.3
  const KdTree tree(wall.points);
  Normals normals(wall, tree, 10);
  const Eigen::Vector3d point(0.4, -0.2, -1), direction = Eigen::Vector3d(0.3, 0, -1).normalized();
  const std::optional<SurfacePlace> place = shoot(tree, wall.points, normals, point, direction, 1);
  ASSERT_TRUE(place);
  EXPECT_TRUE(place->point.isApprox(Eigen::Vector3d(0.49, -0.2, -1.3), 1e-9));
  EXPECT_NEAR(std::abs(place->normal.z()), 1, 1e-9);
  EXPECT_FALSE(shoot(tree, wall.points, normals, point, {1, 0, 0}, 1));  // along the wall
  EXPECT_FALSE(shoot(tree, wall.points, normals, point, direction, 0.3));
}

TEST(Normals, AreThoseOfTheNeighboursAndFaceTheScanner) {
  const PointCloud wall = plane(2000, 6, 0, 1);
  const KdTree tree(wall.points);
  Normals normals(wall, tree, 12);
  EXPECT_TRUE(normals.of(7).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));  // the scanner is above
  const auto unknown = [](const PointCloud& cloud) {
    const KdTree small(cloud.points);
    return Normals(cloud, small, 10).of(0).isZero(0);
  };
  PointCloud line;
  for (int i = 0; i < 50; ++i) line.points.push_back({0.1 * i, 0.2 * i, 1});
  EXPECT_TRUE(unknown(line));
  EXPECT_TRUE(unknown({.points = {{1, 2, 3}, {1, 2, 4}}}));
  EXPECT_TRUE(unknown({.points = std::vector<Eigen::Vector3d>(20, {1, 2, 3})}));
  // A cloud that has normals keeps them.
  PointCloud own = wall;
  own.normals.assign(own.points.size(), Eigen::Vector3d::UnitX());
  EXPECT_EQ(Normals(own, tree, 12).of(7), Eigen::Vector3d::UnitX());
}

// Lines 15 cm apart with a point every 2 cm: the nearest ten lie on one line, whose noise says
// nothing of the plane.
TEST(Normals, OfDenseLinesAreThoseOfTheSurface) {
  PointCloud lines;
  Random random(32, 0);
  for (int line = 0; line < 20; ++line)
    for (int i = 0; i < 200; ++i)
      lines.points.push_back({0.02 * i, 0.15 * line, -1.3 + 0.005 * random.normal()});
  for (const Eigen::Vector3d& n : found_normals(lines.points, 10)) {
    // From 20 points on two or three lines: 5 mm / 15 cm, times 4 for the worst of 4000.
    EXPECT_GT(n.z(), std::cos(4 * 0.005 / 0.15));
  }
}

TEST(RegisterIcp, PairsOfWhichNoneCountsAreDegenerate) {
  PointCloud target = bumpy_tunnel(2000, 1), facing_away = target;
  target.normals.assign(2000, Eigen::Vector3d::UnitX());
  facing_away.normals.assign(2000, -Eigen::Vector3d::UnitX());
  for (const IcpMetric metric : {IcpMetric::point, IcpMetric::plane, IcpMetric::generalized}) {
    const RegistrationResult result = register_icp(
        target, facing_away, near_identity, {.metric = metric, .weights = PairWeights::normals});
    EXPECT_EQ(result.status, Status::degenerate);
    EXPECT_EQ(result.score, 0);
    EXPECT_TRUE(result.covariance.isZero(0));
  }
}

}  // namespace
}  // namespace minescan
