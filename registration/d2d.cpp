// SPDX-License-Identifier: MIT
#include "registration/d2d.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/pose.h"
#include "registration/ndt_score.h"
#include "registration/newton.h"
#include "registration/registered.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix36 = PointJacobian;

// Beyond it a term is left out of the value and the derivatives alike, as in 3D-NDT.
constexpr double max_exponent = 120;

/// One term at a pose: everything that value and derivatives are made of.
struct Term {
  Vector3d y = Vector3d::Zero();   // R m_s
  Matrix3d C = Matrix3d::Zero();   // R C_s R^T
  Matrix3d B = Matrix3d::Zero();   // (C + C_t)^-1
  Vector3d mu = Vector3d::Zero();  // R m_s + t - m_t
  double square = 0;               // mu^T B mu
  double height = 0;               // exp(-d2 / 2 square)
};

Term term_of(const Distribution& target, const Distribution& source, const Pose& T, double d2) {
  Term term;
  term.y = T.linear() * source.mean;
  term.C = T.linear() * source.covariance * T.linear().transpose();
  term.B = (term.C + target.covariance).inverse();
  term.mu = term.y + T.translation() - target.mean;
  term.square = term.mu.dot(term.B * term.mu);
  const double exponent = d2 / 2 * term.square;
  term.height = exponent < max_exponent ? std::exp(-exponent) : 0;
  return term;
}

void add(Score& sum, const Term& term, double d2, Curvature curvature) {
  if (!(term.height > 0)) return;
  sum.value -= term.height;
  const Matrix36 J = point_jacobian(term.y);
  const Vector3d v = term.B * term.mu;
  // How the turned covariance changes.
  std::array<Matrix3d, 3> E, Z;
  for (int a = 0; a < 3; ++a) {
    E[static_cast<std::size_t>(a)] = skew(Vector3d::Unit(a));
    Z[static_cast<std::size_t>(a)] =
        E[static_cast<std::size_t>(a)] * term.C - term.C * E[static_cast<std::size_t>(a)];
  }
  Vector6d Q = 2 * (J.transpose() * v);
  Matrix36 Zv = Matrix36::Zero();
  for (int a = 0; a < 3; ++a) {
    Zv.col(3 + a) = Z[static_cast<std::size_t>(a)] * v;
    Q[3 + a] -= v.dot(Zv.col(3 + a));
  }
  const double w = d2 / 2 * term.height;
  sum.gradient += w * Q;
  const Matrix36 BJ = term.B * J;
  Matrix6d H = 2 * (J.transpose() * BJ);
  if (curvature == Curvature::full) {
    const Matrix36 BZv = term.B * Zv;
    const Matrix6d mixed = J.transpose() * BZv;
    H += -2 * (mixed + mixed.transpose()) + 2 * (Zv.transpose() * BZv) - d2 / 2 * Q * Q.transpose();
    Matrix3d turns = v * term.y.transpose() + term.y * v.transpose();
    turns.diagonal().array() -= 2 * v.dot(term.y);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) {
        const Matrix3d twice = (E[a] * E[b] + E[b] * E[a]) / 2;
        const Matrix3d C_ab = twice * term.C + term.C * twice.transpose() +
                              E[a] * term.C * E[b].transpose() + E[b] * term.C * E[a].transpose();
        turns(static_cast<int>(a), static_cast<int>(b)) -= v.dot(C_ab * v);
      }
    H.bottomRightCorner<3, 3>() += turns;
  }
  sum.hessian += w * H;
}

Distribution distribution_of(const NdtCell& cell) {
  return {.mean = cell.mean, .covariance = information_matrix(cell).inverse()};
}

/// The distributions of a cloud in cells of one size.
struct Cells {
  NdtGrid grid;
  std::vector<Distribution> all = {};  // in the order of grid.cells()

  explicit Cells(NdtGrid cells) : grid(std::move(cells)) {
    all.reserve(grid.cells().size());
    for (const NdtCell& cell : grid.cells()) all.push_back(distribution_of(cell));
  }
  std::size_t number(const NdtCell& cell) const {
    return static_cast<std::size_t>(&cell - grid.cells().data());
  }
  std::size_t bytes() const { return grid.bytes() + all.size() * sizeof(all[0]); }
};

/// Both clouds at one level.
struct Pair {
  const Cells& target;
  const Cells& source;
  double d2 = 1;
  int reach = 1;

  /// Calls visit(source number, target number) for all that meet at a pose.
  template <class Visit>
  void for_each_pair(const Pose& T, Visit&& visit) const {
    const double side = target.grid.lattice().side();
    for (std::size_t s = 0; s < source.all.size(); ++s) {
      const Vector3d mean = T * source.all[s].mean;
      for (int i = -reach; i <= reach; ++i)
        for (int j = -reach; j <= reach; ++j)
          for (int k = -reach; k <= reach; ++k)
            if (const NdtCell* cell = target.grid.find(mean + side * Vector3d(i, j, k)))
              visit(s, target.number(*cell));
    }
  }
  Score score(const Pose& T, Curvature curvature) const {
    Score sum;
    std::size_t last = source.all.size();
    for_each_pair(T, [&](std::size_t s, std::size_t t) {
      add(sum, term_of(target.all[t], source.all[s], T, d2), d2, curvature);
      if (s != last) ++sum.met;
      last = s;
    });
    return sum;
  }
  double value(const Pose& T) const {
    double sum = 0;
    for_each_pair(T, [&](std::size_t s, std::size_t t) {
      sum -= term_of(target.all[t], source.all[s], T, d2).height;
    });
    return sum;
  }
};

void conclude(const Pair& pair, const Found& found, const std::vector<Vector3d>& points,
              double length, const D2dOptions& options, RegistrationResult& result) {
  NdtInformation information;
  std::vector<std::uint8_t> met(pair.source.all.size(), 0);
  pair.for_each_pair(found.pose, [&](std::size_t s, std::size_t t) {
    met[s] = 1;
    const Term term = term_of(pair.target.all[t], pair.source.all[s], found.pose, pair.d2);
    const Matrix36 J = point_jacobian(term.y);
    const double w = pair.d2 * term.height;
    information.gauss_newton += w * (J.transpose() * term.B * J);
    const Vector6d held = J.transpose() * pair.target.grid.normal(pair.target.grid.cells()[t]);
    information.surface += w * held * held.transpose();
    information.weights += w;
    information.squares += w * term.square;
  });
  result.directions = directions_of(information.surface, length);
  result.score = found.score.value;
  result.empty_points = static_cast<std::size_t>(std::ranges::count_if(points, [&](const auto& p) {
    const NdtCell* cell = pair.source.grid.find(p);
    return !cell || met[pair.source.number(*cell)] == 0;
  }));
  result.status =
      status_of(result, found.score.met, needed_points(pair.source.all.size(), options.min_overlap),
                options.min_rank, found.converged);
  if (result.status == Status::converged || result.status == Status::max_iterations)
    result.covariance = pose_covariance(information);
}

void run_d2d(const PointCloud& target, const PointCloud& source, const D2dOptions& options,
             RegistrationResult& result) {
  Stopwatch watch;
  const UsedCloud moving = used_source(source, options.sampling);
  const double length = rms_distance(moving->points);
  result.used_points = moving->points.size();
  const UsedCloud still = used_target(target, options.sampling);
  result.time.source = watch.lap();
  for (int level = options.levels - 1; level >= 0; --level) {
    NdtGridOptions grid = options.grid;
    grid.cell_size = std::ldexp(grid.cell_size, level);
    const Cells fixed(NdtGrid(still->points, grid));
    result.target_bytes = std::max(result.target_bytes, fixed.bytes());
    result.time.target += watch.lap();
    const Cells moved(NdtGrid(moving->points, grid));
    result.time.source += watch.lap();

    const Pair pair{fixed, moved, options.d2, options.reach};
    const Objective objective{
        .score = [&](const Pose& T, Curvature curvature) { return pair.score(T, curvature); },
        .value = [&](const Pose& T) { return pair.value(T); },
        .length = length};
    const Found found = minimise(objective, result.T_target_source, options.search);
    result.T_target_source = found.pose;
    result.iterations += found.iterations;
    result.evaluations += found.evaluations;
    if (level == 0) conclude(pair, found, moving->points, length, options, result);
    result.time.align += watch.lap();
  }
}

}  // namespace

Score d2d_score(const Distribution& target, const Distribution& source, const Pose& T_target_source,
                double d2, Curvature curvature) {
  Score score;
  add(score, term_of(target, source, T_target_source, d2), d2, curvature);
  score.met = 1;
  return score;
}

RegistrationResult register_d2d(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const D2dOptions& options) {
  return registered(target, source, T_guess, options, run_d2d);
}

}  // namespace minescan
