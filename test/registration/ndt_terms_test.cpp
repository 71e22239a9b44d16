// SPDX-License-Identifier: MIT
#include "registration/ndt_terms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "clouds.h"
#include "registration/ndt.h"
#include "registration/ndt_sums.h"
#include "registration/newton.h"

namespace minescan {
namespace {

// As in the test of fields: coordinates in single precision, cells 0.03 m thick.
constexpr double tolerance = 2e-4;

const Pose T = displaced(Pose::Identity(), {0.05, -0.03, 0.02}, {0.5, -0.3, 0.8}, 0.02);

/// Points whose cell is the same in single and in double precision, for lattices of 1/4 m.
std::vector<Eigen::Vector3d> sources() {
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& p : bumpy_tunnel(3000, 2).points) {
    const Eigen::Array3d quarters = 4 * (T * p).array();
    if ((quarters - quarters.round()).abs().minCoeff() > 4e-4) kept.push_back(p);
  }
  return kept;
}

Score sum_over(const std::vector<NdtField>& fields, Curvature curvature = Curvature::full) {
  Score sum;
  const PackedPoints points(sources());
  for (const NdtField& field : fields) {
    const Score score = ndt_score(field, T, points, curvature);
    sum.value += score.value;
    sum.gradient += score.gradient;
    sum.hessian += score.hessian;
    sum.met += score.met;
  }
  return sum;
}

Score fields_score(const NdtGridOptions& grid, const NdtTermOptions& options,
                   Curvature curvature = Curvature::full) {
  return sum_over(ndt_fields(bumpy_tunnel(20000, 1).points, grid, options), curvature);
}

void expect_equal(const Score& a, const Score& b) {
  EXPECT_EQ(a.met, b.met);
  EXPECT_NEAR(a.value, b.value, tolerance * std::abs(b.value));
  EXPECT_TRUE(a.gradient.isApprox(b.gradient, 10 * tolerance));  // terms of both signs
  EXPECT_TRUE(a.hessian.isApprox(b.hessian, tolerance));
}

/// The plain sum over cells around the one that a point lies in.
template <class Counts>
Score plain_sum(const NdtGrid& grid, Counts&& counts, Curvature curvature = Curvature::full) {
  Score sum;
  const double side = grid.lattice().side();
  for (const Eigen::Vector3d& p : sources()) {
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const Eigen::Vector3d moved = T * p;
          const double weight = counts(moved, Eigen::Vector3i(x, y, z));
          const NdtCell* cell = grid.find(moved + side * Eigen::Vector3d(x, y, z));
          if (weight == 0 || !cell) continue;
          const Score term = ndt_score(*cell, T, p, curvature);
          sum.value += weight * term.value;
          sum.gradient += weight * term.gradient;
          sum.hessian += weight * term.hessian;
          ++sum.met;
        }
  }
  return sum;
}

TEST(NdtTerms, NeighboursAreTheCellsAround) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
    const auto faces = [](const Eigen::Vector3d&, const Eigen::Vector3i& at) {
      return at.cwiseAbs().sum() <= 1 ? 1.0 : 0.0;
    };
    expect_equal(fields_score({}, {.neighbourhood = Neighbourhood::faces}, curvature),
                 plain_sum(grid, faces, curvature));
    // The centre among them: an implementation elsewhere left it out.
    const auto all = [](const Eigen::Vector3d&, const Eigen::Vector3i&) { return 1.0; };
    expect_equal(fields_score({}, {.neighbourhood = Neighbourhood::all}, curvature),
                 plain_sum(grid, all, curvature));
  }
}

TEST(NdtTerms, TrilinearWeighsTheCentresAround) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  const auto weight = [](const Eigen::Vector3d& moved, const Eigen::Vector3i& at) {
    double product = 1;
    for (int i = 0; i < 3; ++i) {
      const double from_centre = moved[i] - (std::floor(moved[i]) + 0.5 + at[i]);
      product *= std::max(0.0, 1 - std::abs(from_centre));
    }
    return product;
  };
  const Score fields = fields_score({}, {.neighbourhood = Neighbourhood::trilinear});
  const Score plain = plain_sum(grid, weight);
  expect_equal(fields, plain);

  // Where all cells say the same, it says that as well: weights sum to 1.
  std::vector<NdtField> constant =
      ndt_fields(bumpy_tunnel(200000, 1).points, {.cell_size = 4, .min_cell_points = 4},
                 {.neighbourhood = Neighbourhood::trilinear, .linked = true, .endless = true});
  for (NdtField& field : constant)
    for (NdtField::Row& row : field.rows) row.set_information(Eigen::Matrix3d::Zero());
  EXPECT_NEAR(sum_over(constant).value, -static_cast<double>(sources().size()), 0.01);
}

// Of the plain sum of densities times weights, the 8 cells of every point held fast, and of weights
// held fast, too.
TEST(NdtTerms, TrilinearDerivativesMatchDifferencesWithChangingWeights) {
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  struct Near {
    Eigen::Vector3d point;
    Eigen::Vector3d centre;
    const NdtCell* cell;
  };
  std::vector<Near> list;
  for (const Eigen::Vector3d& p : sources()) {
    const Eigen::Vector3d low = ((T * p).array() - 0.5).floor();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d at = low + Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2);
      const Eigen::Vector3d centre = at.array() + 0.5;
      if (const NdtCell* cell = grid.find(centre)) list.push_back({p, centre, cell});
    }
  }
  const auto value = [&](const Vector6d& step) {
    const Pose moved = stepped(T, step);
    double sum = 0;
    for (const Near& near : list) {
      const Eigen::Array3d weights = 1 - ((moved * near.point - near.centre).array() *
                                          (T * near.point - near.centre).array().sign());
      sum += weights.prod() * ndt_score(*near.cell, moved, near.point).value;
    }
    return sum;
  };
  const Score exact =
      fields_score({}, {.neighbourhood = Neighbourhood::trilinear, .weights_change = true});
  const Score constant = fields_score({}, {.neighbourhood = Neighbourhood::trilinear});
  EXPECT_EQ(exact.value, constant.value);
  // At 12 m a turn by h moves a point by 0.4 mm, a hundredth of a cell's thickness: truncation 1e-4
  // at most; rounding 1e-13 of the sum over h^2. Single precision as in expect_equal.
  const double h = 3e-5;
  Vector6d gradient;
  Matrix6d hessian;
  for (int i = 0; i < 6; ++i) {
    const Vector6d a = h * Vector6d::Unit(i);
    gradient[i] = (value(a) - value(-a)) / (2 * h);
    for (int j = 0; j < 6; ++j) {
      const Vector6d b = h * Vector6d::Unit(j);
      hessian(i, j) = (value(a + b) - value(a - b) - value(b - a) + value(-a - b)) / (4 * h * h);
    }
  }
  EXPECT_TRUE(exact.gradient.isApprox(gradient, 10 * tolerance));
  EXPECT_TRUE(exact.hessian.isApprox(hessian, 10 * tolerance));
  EXPECT_GT((constant.gradient - gradient).norm(), 0.02 * gradient.norm());
}

TEST(NdtTerms, RadiusIsAllMeansWithinOneCellSize) {
  for (const double side : {1.0, 2.0}) {
    const std::vector<Eigen::Vector3d> points = bumpy_tunnel(20000, 1).points;
    const NdtGrid grid(points, {.cell_size = side});
    std::vector<Eigen::Vector3d> kept;
    std::size_t met = 0;
    Score plain;
    for (const Eigen::Vector3d& p : sources()) {
      std::vector<const NdtCell*> near;
      bool border = false;  // as far away as that, within the rounding of single precision
      for (const NdtCell& cell : grid.cells()) {
        const double distance = (T * p - cell.mean).norm();
        if (distance <= side) near.push_back(&cell);
        border = border || std::abs(distance - side) < 1e-5;
      }
      if (border) continue;
      kept.push_back(p);
      met += !near.empty();
      for (const NdtCell* cell : near) {
        const Score term = ndt_score(*cell, T, p);
        plain.value += term.value;
        plain.gradient += term.gradient;
        plain.hessian += term.hessian;
      }
    }
    const std::vector<NdtField> fields =
        ndt_fields(points, {.cell_size = side}, {.neighbourhood = Neighbourhood::radius});
    Score sum;
    for (const NdtField& field : fields) {
      const Score score = ndt_score(field, T, PackedPoints(kept));
      EXPECT_EQ(score.value, ndt_value(field, T, PackedPoints(kept)));
      sum.value += score.value;
      sum.gradient += score.gradient;
      sum.hessian += score.hessian;
    }
    expect_equal(sum, plain);
    EXPECT_EQ(count_met(fields, T, kept).met, met);
    // It is neither the cell alone nor all around.
    for (const Neighbourhood other : {Neighbourhood::own, Neighbourhood::all}) {
      double value = 0;
      for (const NdtField& field :
           ndt_fields(points, {.cell_size = side}, {.neighbourhood = other}))
        value += ndt_value(field, T, PackedPoints(kept));
      EXPECT_GT(std::abs(value - sum.value), 1e-3 * std::abs(sum.value));
    }
  }
  for (const bool linked : {true, false})
    EXPECT_THROW(
        ndt_fields(sources(), {},
                   {.neighbourhood = Neighbourhood::radius, .linked = linked, .endless = !linked}),
        std::invalid_argument);
}

TEST(NdtTerms, OverlapIsEightLattices) {
  Score plain;
  for (int shift = 0; shift < 8; ++shift) {
    const Eigen::Vector3d origin(0.5 * (shift & 1), 0.5 * (shift >> 1 & 1), 0.5 * (shift >> 2));
    const NdtGrid grid(bumpy_tunnel(20000, 1).points, {.lattice_origin = origin});
    const Score part = ndt_score(grid, T, sources());
    plain.value += part.value;
    plain.gradient += part.gradient;
    plain.hessian += part.hessian;
    plain.met += part.met;
  }
  expect_equal(fields_score({}, {.neighbourhood = Neighbourhood::overlap}), plain);
}

// A point in an empty cell takes the mean nearest to it, found here by looking at all of them.
TEST(NdtTerms, LinksOfPointsGoToTheMeanNearestToThem) {
  for (const bool endless : {false, true}) {
    // So few points that many cells have no distribution.
    const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
    const NdtGrid grid(points, {});
    const std::vector<NdtField> fields =
        ndt_fields(points, {}, {.linked = true, .linked_by = LinkedBy::point, .endless = endless});
    ASSERT_EQ(fields.size(), 1u);
    const NdtField& field = fields[0];
    Score plain;
    std::size_t missed = 0;
    const Pose far = Eigen::Translation3d(1.5, 0.3, 0.2) * T;  // away from the cells
    for (const Eigen::Vector3d& p : sources()) {
      const Eigen::Vector3d at = far * p;
      const Eigen::Array3d cell = (at - field.corner).array() / field.side;
      const bool inside = (cell >= 0).all() && cell[0] < field.size[0] && cell[1] < field.size[1] &&
                          cell[2] < field.size[2];
      if (!inside && !endless) continue;
      const NdtCell* taken = inside ? grid.find(at) : nullptr;
      if (!inside) {
        const Eigen::Array3d last(field.size[0] - 0.5, field.size[1] - 0.5, field.size[2] - 0.5);
        taken = grid.find(field.corner + field.side * cell.max(0.5).min(last).matrix());
      }
      if (!taken) {
        ++missed;
        for (const NdtCell& other : grid.cells())
          if (!taken || (other.mean - at).norm() < (taken->mean - at).norm()) taken = &other;
      }
      const Score term = ndt_score(*taken, far, p);
      plain.value += term.value;
      plain.gradient += term.gradient;
      plain.hessian += term.hessian;
      ++plain.met;
    }
    EXPECT_GT(missed, 100u);
    const Score score = ndt_score(field, far, PackedPoints(sources()));
    expect_equal(score, plain);
    EXPECT_EQ(score.value, ndt_value(field, far, PackedPoints(sources())));
    EXPECT_EQ(count_met(fields, far, sources()).met, plain.met);
    // The other two definitions say something else.
    for (const LinkedBy by : {LinkedBy::centre, LinkedBy::mean}) {
      const double other = ndt_value(
          ndt_fields(points, {}, {.linked = true, .linked_by = by, .endless = endless}).at(0), far,
          PackedPoints(sources()));
      EXPECT_GT(std::abs(other - score.value), 1e-3 * std::abs(score.value));
    }
  }
  EXPECT_THROW(
      ndt_fields(
          sources(), {},
          {.neighbourhood = Neighbourhood::faces, .linked = true, .linked_by = LinkedBy::point}),
      std::invalid_argument);
}

// Wherever cells are kept, and whatever looks them up.
TEST(NdtTerms, EveryStorageHasTheSameScore) {
  const std::vector<NdtTermOptions> lookups = {
      {},
      {.neighbourhood = Neighbourhood::faces},
      {.neighbourhood = Neighbourhood::trilinear},
      {.linked = true},
      {.linked = true, .linked_by = LinkedBy::point},
      {.endless = true},
      {.discretisation = Discretisation::additive, .split_spread = 0.03}};
  for (NdtTermOptions options : lookups) {
    for (const double cell_size : {0.3, 1.0}) {
      const NdtGridOptions grid{.cell_size = cell_size};
      options.storage = Storage::dense;
      const Score dense = fields_score(grid, options);
      EXPECT_GT(dense.met, 100u);
      for (const Storage storage : {Storage::hash, Storage::morton, Storage::runs}) {
        options.storage = storage;
        const Score other = fields_score(grid, options);
        EXPECT_EQ(other.value, dense.value);
        EXPECT_EQ(other.gradient, dense.gradient);
        EXPECT_EQ(other.hessian, dense.hessian);
        EXPECT_EQ(other.met, dense.met);
      }
    }
  }
}

// A surface of cells a quarter as large: the box takes 64 times the memory, the cells 16 times.
TEST(NdtTerms, SparseStoragesGrowWithTheSurface) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(200000, 1).points;
  const auto bytes = [&](double cell_size, Storage storage) {
    double sum = 0;
    for (const NdtField& field : ndt_fields(points, {.cell_size = cell_size}, {.storage = storage}))
      sum += static_cast<double>(field.bytes() - field.rows.size() * sizeof(field.rows[0]));
    return sum;
  };
  EXPECT_GT(bytes(0.25, Storage::dense) / bytes(1, Storage::dense), 40);  // boxes are whole cells
  for (const Storage storage : {Storage::hash, Storage::morton, Storage::runs}) {
    EXPECT_LT(bytes(0.25, storage) / bytes(1, storage), 32) << value_text(storage);
    // A tunnel fills a tenth of its box with cells, of which a table takes 64 bytes each.
    if (storage == Storage::hash) continue;
    EXPECT_LT(bytes(0.25, storage), bytes(0.25, Storage::dense)) << value_text(storage);
  }
}

TEST(NdtTerms, AnOctreeThatIsNeverDividedIsFixed) {
  const NdtGridOptions grid{.cell_size = 2};
  const Score fixed = fields_score(grid, {});
  for (const Discretisation kind : {Discretisation::octree, Discretisation::additive}) {
    expect_equal(fields_score(grid, {.discretisation = kind, .split_spread = 1000}), fixed);
    expect_equal(fields_score(grid, {.discretisation = kind, .depth = 0, .split_spread = 0}),
                 fixed);
  }
}

TEST(NdtTerms, AnOctreeThatIsAlwaysDividedIsFixedOneSizeDown) {
  // Enough points everywhere that no cell stays whole for want of them.
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(200000, 1).points;
  const NdtTermOptions octree{.discretisation = Discretisation::octree, .split_spread = 0};
  const std::vector<NdtField> divided = ndt_fields(points, {.cell_size = 2}, octree);
  const std::vector<NdtField> small = ndt_fields(points, {.cell_size = 1}, {});
  ASSERT_EQ(divided.size(), 1u);
  // A few large cells have all their points in a corner that holds them as one.
  const Score a = sum_over(divided), b = sum_over(small);
  EXPECT_NEAR(a.value, b.value, 0.01 * std::abs(b.value));
  EXPECT_GE(a.met, b.met);
}

// A test for normality that always says "divide" has been seen elsewhere.
TEST(NdtTerms, AnOctreeDividesWhereTheWallBendsOnly) {
  std::vector<Eigen::Vector3d> points;
  Random random(1, 0);
  for (int i = 0; i < 4000; ++i) {
    const double x = 8 * random.uniform(), y = 2 * random.uniform();
    points.push_back({x, y, 0.5 + (x < 4 ? 0.01 * random.normal() : 0.8 * (i % 2))});
  }
  const std::vector<NdtField> fields = ndt_fields(
      points, {.cell_size = 2}, {.discretisation = Discretisation::octree, .split_spread = 0.1});
  ASSERT_EQ(fields.size(), 1u);
  // Two flat cells stay whole; two of two layers, at z = 0.5 and 1.3, become 8 parts each.
  EXPECT_EQ(fields[0].rows.size() - 1, 2u + 16u);
}

TEST(NdtTerms, AdditiveScoresAPointByAllPartsOfItsCell) {
  const NdtGridOptions grid{.cell_size = 2};
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(20000, 1).points;
  const std::vector<NdtField> octree =
      ndt_fields(points, grid, {.discretisation = Discretisation::octree, .split_spread = 0.03});
  const std::vector<NdtField> additive =
      ndt_fields(points, grid, {.discretisation = Discretisation::additive, .split_spread = 0.03});
  std::size_t leaves = 0;
  for (const NdtField& field : additive) leaves += field.rows.size() - 1;
  EXPECT_EQ(leaves, octree[0].rows.size() - 1);
  EXPECT_GT(additive.size(), 1u);
  EXPECT_LT(sum_over(additive).value, sum_over(octree).value);  // more terms, all of one sign
}

TEST(NdtTerms, LinksAndEndlessBoundsChangeNothingWhereAllIsMet) {
  // A block full of points: no cell is empty.
  std::vector<Eigen::Vector3d> block;
  Random random(2, 0);
  for (int i = 0; i < 20000; ++i) {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    block.push_back({6 * x - 3, 6 * y - 3, 6 * z - 3});
  }
  std::vector<Eigen::Vector3d> inside;
  for (const Eigen::Vector3d& p : sources())
    if (p.cwiseAbs().maxCoeff() < 2.5) inside.push_back(p);
  const auto value = [&](const NdtTermOptions& options) {
    return ndt_value(ndt_fields(block, {}, options).at(0), T, PackedPoints(inside));
  };
  EXPECT_EQ(value({.linked = true}), value({}));
  EXPECT_EQ(value({.endless = true}), value({}));
  EXPECT_EQ(value({.linked = true, .endless = true}), value({}));
  // And where not all is met, they do: links for points inside, bounds for those outside.
  const std::vector<Eigen::Vector3d> tunnel = bumpy_tunnel(3000, 1).points;
  const auto count = [&](const NdtTermOptions& options) {
    return count_met(ndt_fields(tunnel, {}, options), Pose(Eigen::Translation3d(4.3, 0, 0)),
                     sources());
  };
  const MetCount plain = count({}), linked = count({.linked = true}),
                 both = count({.linked = true, .endless = true});
  EXPECT_LT(plain.met, plain.inside);
  EXPECT_EQ(linked.met, linked.inside);
  EXPECT_EQ(linked.inside, plain.inside);
  EXPECT_LT(linked.inside, sources().size());
  EXPECT_EQ(both.met, sources().size());
}

// Values of d2 for an outlier ratio of 0.55, and the three points that the fit goes through.
TEST(MixtureFit, IsThatOfThePublishedTable) {
  for (const auto& [side, d2] :
       {std::pair{0.5, 0.756}, std::pair{1.0, 0.433}, std::pair{2.0, 0.249}, std::pair{3.0, 0.193}})
    EXPECT_NEAR(mixture_fit(0.55, side).d2, d2, 6e-4) << side;  // three digits
  const double c1 = 10 * 0.45, c2 = 0.55;
  const MixtureFit fit = mixture_fit(0.55, 1);
  const double d3 = -std::log(c2);
  for (const double u : {0.0, 1.0, 1000.0})
    EXPECT_NEAR(fit.d1 * std::exp(-fit.d2 * u / 2) + d3, -std::log(c1 * std::exp(-u / 2) + c2),
                1e-12);
  EXPECT_LT(fit.d1, 0);  // a sign that was wrong for years elsewhere
}

TEST(NdtTerms, MixtureIsTheSameWithWiderCellsAndAnotherHeight) {
  const MixtureFit fit = mixture_fit(0.55, 1);
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {});
  double plain = 0;
  for (const Eigen::Vector3d& p : sources()) {
    const NdtCell* cell = grid.find(T * p);
    if (!cell) continue;
    const Eigen::Vector3d x = T * p - cell->mean;
    plain += fit.d1 * std::exp(-fit.d2 / 2 * x.dot(information_matrix(*cell) * x));
  }
  EXPECT_NEAR(fields_score({}, {.density = Density::mixture}).value, plain,
              tolerance * std::abs(plain));
}

TEST(NdtTerms, CellMixtureIntegratesToOne) {
  const double o = 0.4, side = 2;
  const NdtGrid grid(bumpy_tunnel(20000, 1).points, {.cell_size = side});
  Score plain;
  double lowest = 1e9, highest = 0;
  for (const Eigen::Vector3d& p : sources()) {
    const NdtCell* cell = grid.find(T * p);
    if (!cell) continue;
    const Eigen::Matrix3d C = information_matrix(*cell).inverse();
    // The integral of c1 exp(-u / 2) over space, and that of c2 over the cell: 1 - o and o.
    const double volume = std::sqrt(std::pow(2 * std::numbers::pi, 3) * C.determinant());
    const double c1 = (1 - o) / volume, c2 = o / std::pow(side, 3);
    // The approximation goes through u = 0, 1 and infinity.
    const double d3 = -std::log(c2), d1 = -std::log(c1 + c2) - d3;
    const double at_one = -std::log(c1 * std::exp(-0.5) + c2) - d3;
    const double d2 = 2 * std::log(d1 / at_one);
    NdtCell wider = *cell;
    for (double& x : wider.information) x *= d2;
    const Score term = ndt_score(wider, T, p);
    plain.value += -d1 * term.value;
    plain.gradient += -d1 * term.gradient;
    plain.hessian += -d1 * term.hessian;
    ++plain.met;
    lowest = std::min(lowest, -d1), highest = std::max(highest, -d1);
  }
  EXPECT_GT(highest, 1.3 * lowest);  // thin cells weigh more
  const NdtTermOptions options{.density = Density::cell_mixture, .outlier_ratio = o};
  expect_equal(fields_score({.cell_size = side}, options), plain);
  // All neighbourhoods take the same distributions: one more cell is one more term.
  NdtTermOptions all = options;
  all.neighbourhood = Neighbourhood::all;
  EXPECT_LT(fields_score({.cell_size = side}, all).value, plain.value);
}

TEST(RegisterNdt, NearAndFarEndsWhereTheSmallCellsDo) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const Pose guess = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);
  const RegistrationResult plain = register_ndt(target, source, guess);
  const RegistrationResult result = register_ndt(target, source, guess, {.far_distance = 6});
  EXPECT_EQ(result.status, Status::converged);
  EXPECT_GT(result.target_bytes, plain.target_bytes);
  // The score jumps by millimetres around its minimum: two ways there end that far apart.
  EXPECT_LT(pose_error(plain.T_target_source, result.T_target_source).translation, 0.005);
  // Nobody is far: nothing changes.
  const RegistrationResult none = register_ndt(target, source, guess, {.far_distance = 1000});
  EXPECT_TRUE(none.T_target_source.isApprox(plain.T_target_source, 0));
}

TEST(RegisterNdt, RefusesABoxOfTooManyCells) {
  std::vector<Eigen::Vector3d> points = bumpy_tunnel(2000, 1).points;
  for (int i = 0; i < 20; ++i) points.push_back({1e5 + 0.01 * i, 400.001 * 1e2, 0.02 * (i % 3)});
  EXPECT_THROW(ndt_fields(points, {}, {.endless = true}), std::invalid_argument);
}

TEST(NdtTerms, RefuseNeighboursOfDividedCells) {
  for (const Discretisation kind : {Discretisation::octree, Discretisation::additive})
    EXPECT_THROW(ndt_fields(bumpy_tunnel(2000, 1).points, {},
                            {.discretisation = kind, .neighbourhood = Neighbourhood::faces}),
                 std::invalid_argument);
}

TEST(RegisterNdt, RefusesFarPointsInABoxOfTooManyCells) {
  PointCloud cloud = bumpy_tunnel(2000, 1);
  for (int i = 0; i < 20; ++i) cloud.points.push_back({300 + 0.01 * i, 300, 300 + 0.02 * (i % 3)});
  const NdtOptions options{.grid = {.cell_size = 0.5}, .far_distance = 5};
  EXPECT_THROW(register_ndt(cloud, cloud, Pose::Identity(), options), std::invalid_argument);
}

}  // namespace
}  // namespace minescan
