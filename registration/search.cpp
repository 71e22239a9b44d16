// SPDX-License-Identifier: MIT
#include "registration/search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "registration/newton.h"

namespace minescan {
namespace {

/// Counts what an objective is asked for.
struct Counted {
  const Objective& objective;
  Curvature curvature = Curvature::full;
  int evaluations = 0;

  Score score(const Pose& pose) {
    ++evaluations;
    return objective.score(pose, curvature);
  }
  double value(const Pose& pose) {
    ++evaluations;
    return objective.value(pose);
  }
};

Found line_searches(Counted& f, const Pose& start, const SearchOptions& options) {
  Found found{.pose = start, .score = f.score(start)};
  while (!found.converged && found.iterations < options.max_iterations) {
    ++found.iterations;
    const Score& at = found.score;
    const Vector6d step =
        newton_step(at.gradient, at.hessian, f.objective.length, options.max_step, options.repair);
    const double slope = at.gradient.dot(step);

    // The full step mostly leads down, so there the derivatives are computed at once.
    double alpha = 1;
    bool decreased = false;
    for (int halvings = 0; halvings <= 10 && !decreased; ++halvings) {
      if (halvings > 0) alpha /= 2;
      const Pose trial = stepped(found.pose, alpha * step);
      const double limit = at.value + 1e-4 * alpha * slope;  // Armijo
      if (halvings > 0 && !(f.value(trial) <= limit)) continue;
      const Score there = f.score(trial);
      if (!(there.value <= limit)) continue;
      found.pose = trial;
      found.score = there;
      decreased = true;
    }
    found.converged = !decreased || alpha * step.norm() < options.stop_step;
  }
  return found;
}

Found damped_steps(Counted& f, const Pose& start, const SearchOptions& options) {
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>() /= f.objective.length;
  Found found{.pose = start, .score = f.score(start)};
  double lambda = 0, growth = 2;
  while (!found.converged && found.iterations < options.max_iterations) {
    ++found.iterations;
    const Matrix6d H = scale.asDiagonal() * found.score.hessian * scale.asDiagonal();
    const Vector6d g = scale.cwiseProduct(found.score.gradient);
    const double largest = H.diagonal().maxCoeff();
    if (!(largest > 0)) break;  // nothing is held: no step leads anywhere
    if (lambda == 0) lambda = 1e-3 * largest;

    const Matrix6d damped = H + lambda * Matrix6d::Identity();
    Vector6d step = -damped.ldlt().solve(g);
    const double norm = scale.cwiseProduct(step).norm();
    if (norm > options.max_step) step *= options.max_step / norm;
    const double promised = -(g.dot(step) + step.dot(H * step) / 2);
    const Pose trial = stepped(found.pose, scale.cwiseProduct(step));
    const Score there = f.score(trial);
    const double gain = promised > 0 ? (found.score.value - there.value) / promised : -1;
    if (gain > 0) {
      found.pose = trial;
      found.score = there;
      lambda *= std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3));
      lambda = std::max(lambda, 1e-12 * largest);
      growth = 2;
    } else {
      lambda *= growth;
      growth *= 2;
    }
    // A short step that leads up is one too short to go on as well.
    found.converged = std::min(norm, options.max_step) < options.stop_step;
  }
  return found;
}

}  // namespace

Found minimise(const Objective& objective, const Pose& start, const SearchOptions& options) {
  Counted counted{.objective = objective,
                  .curvature = options.optimiser == Optimiser::newton ? Curvature::full
                                                                      : Curvature::gauss_newton};
  Found found = options.optimiser == Optimiser::levenberg_marquardt
                    ? damped_steps(counted, start, options)
                    : line_searches(counted, start, options);
  found.evaluations = counted.evaluations;
  found.pose = normalized(found.pose);
  return found;
}

double rms_distance(const std::vector<Eigen::Vector3d>& points) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += p.squaredNorm();
  const double rms = std::sqrt(sum / static_cast<double>(points.size()));
  return rms > 0 ? rms : 1;
}

}  // namespace minescan
