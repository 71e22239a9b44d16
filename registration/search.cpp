// SPDX-License-Identifier: MIT
#include "registration/search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "registration/newton.h"

namespace minescan {
namespace {

/// The search's view of a pose moved by (tau, omega). Counts what the objective is asked for.
struct LocalSpace {
  using State = Pose;
  using Value = Score;
  using Vector = Vector6d;
  using Matrix = Matrix6d;

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
  Vector6d scale(Eigen::Index) const {
    Vector6d scale = Vector6d::Ones();
    scale.tail<3>() /= objective.length;
    return scale;
  }
  Vector6d newton(const Score& at, const SearchOptions& options) const {
    return newton_step(at.gradient, at.hessian, objective.length, options.max_step, options.repair);
  }
  static Pose moved(const Pose& pose, const Vector6d& step) { return stepped(pose, step); }
  /// What stop_step is compared with, of a step with this norm.
  static double change(const Pose&, const Pose&, double step) { return step; }
};

/// The same for the parameters of a PoseForm.
struct ParameterSpace {
  using State = PoseParameters;
  using Value = ParameterScore;
  using Vector = Parameters;
  using Matrix = ParameterMatrix;

  const Objective& objective;
  const PoseOptions& options;
  Curvature curvature = Curvature::full;
  int evaluations = 0;

  ParameterScore score(const PoseParameters& at) {
    ++evaluations;
    const PoseDerivatives pose = at.derivatives();
    return options.is_rigid()
               ? chained(objective.score(at.pose(), curvature), pose, at.size(), curvature)
               : chained(objective.affine(at.pose(), curvature), pose, at.size(), curvature);
  }
  double value(const PoseParameters& at) {
    ++evaluations;
    return objective.value(at.pose());
  }
  Parameters scale(Eigen::Index size) const {
    Parameters scale = Parameters::Ones(size);
    const Eigen::Index lengths = options.form == PoseForm::planar ? 2 : 3;
    scale.tail(size - lengths) /= objective.length;
    return scale;
  }
  Parameters newton(const ParameterScore& at, const SearchOptions& how) const {
    return newton_step(at, scale(at.gradient.size()), how.max_step, how.repair);
  }
  static PoseParameters moved(const PoseParameters& at, const Parameters& step) {
    return at.moved(step);
  }
  double change(const PoseParameters& from, const PoseParameters& to, double step) const {
    return options.stop_rule == StopRule::step
               ? step
               : std::abs(to.values().norm() - from.values().norm());
  }
};

/// Where a search ended in a space.
template <class Space>
struct Reached {
  typename Space::State state;
  typename Space::Value score;
  int iterations = 0;
  bool converged = false;
};

template <class Space>
Reached<Space> line_searches(Space& f, const typename Space::State& start,
                             const SearchOptions& options) {
  using Vector = typename Space::Vector;
  Reached<Space> found{.state = start, .score = f.score(start)};
  while (!found.converged && found.iterations < options.max_iterations) {
    ++found.iterations;
    const typename Space::Value& at = found.score;
    const Vector step = f.newton(at, options);
    const double slope = at.gradient.dot(step);

    // The full step mostly leads down, so there the derivatives are computed at once.
    double alpha = 1;
    bool decreased = false;
    double change = 0;
    for (int halvings = 0; halvings <= 10 && !decreased; ++halvings) {
      if (halvings > 0) alpha /= 2;
      const typename Space::State trial = f.moved(found.state, alpha * step);
      const double limit = at.value + 1e-4 * alpha * slope;  // Armijo
      if (halvings > 0 && !(f.value(trial) <= limit)) continue;
      const typename Space::Value there = f.score(trial);
      if (!(there.value <= limit)) continue;
      change = f.change(found.state, trial, alpha * step.norm());
      found.state = trial;
      found.score = there;
      decreased = true;
    }
    found.converged = !decreased || change < options.stop_step;
  }
  return found;
}

template <class Space>
Reached<Space> damped_steps(Space& f, const typename Space::State& start,
                            const SearchOptions& options) {
  using Vector = typename Space::Vector;
  using Matrix = typename Space::Matrix;
  Reached<Space> found{.state = start, .score = f.score(start)};
  const Eigen::Index size = found.score.gradient.size();
  const Vector scale = f.scale(size);
  double lambda = 0, growth = 2;
  while (!found.converged && found.iterations < options.max_iterations) {
    ++found.iterations;
    const Matrix H = scale.asDiagonal() * found.score.hessian * scale.asDiagonal();
    const Vector g = scale.cwiseProduct(found.score.gradient);
    const double largest = H.diagonal().maxCoeff();
    if (!(largest > 0)) break;  // nothing is held: no step leads anywhere
    if (lambda == 0) lambda = 1e-3 * largest;

    const Matrix damped = H + lambda * Matrix::Identity(size, size);
    Vector step = -damped.ldlt().solve(g);
    const double norm = scale.cwiseProduct(step).norm();
    if (norm > options.max_step) step *= options.max_step / norm;
    const double promised = -(g.dot(step) + step.dot(H * step) / 2);
    const typename Space::State trial = f.moved(found.state, scale.cwiseProduct(step));
    const typename Space::Value there = f.score(trial);
    const double gain = promised > 0 ? (found.score.value - there.value) / promised : -1;
    double change = std::min(norm, options.max_step);
    if (gain > 0) {
      change = f.change(found.state, trial, change);
      found.state = trial;
      found.score = there;
      lambda *= std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3));
      lambda = std::max(lambda, 1e-12 * largest);
      growth = 2;
    } else {
      lambda *= growth;
      growth *= 2;
    }
    // A short step that leads up is one too short to go on as well.
    found.converged = change < options.stop_step;
  }
  return found;
}

template <class Space>
Reached<Space> search_in(Space& space, const typename Space::State& start,
                         const SearchOptions& options) {
  return options.optimiser == Optimiser::levenberg_marquardt ? damped_steps(space, start, options)
                                                             : line_searches(space, start, options);
}

Curvature curvature_of(const SearchOptions& options) {
  return options.optimiser == Optimiser::newton ? Curvature::full : Curvature::gauss_newton;
}

}  // namespace

ParameterScore chained(const Score& score, const PoseDerivatives& pose, int parameters,
                       Curvature curvature) {
  // (tau, omega) under which the pose moves as its parameters change: to first order
  // omega_i = vee(R_i R^T), and Exp(omega) = R(p) R^T to second leaves [omega_ij]x =
  // R_ij R^T - ([omega_i]x [omega_j]x + [omega_j]x [omega_i]x) / 2, whose last part is symmetric.
  const Eigen::Matrix3d R = pose.at.leftCols<3>();
  const auto local = [&](const PoseDerivatives::Matrix& d) {
    const Eigen::Matrix3d W = d.leftCols<3>() * R.transpose();
    Vector6d v;
    v << d.col(3), (W(2, 1) - W(1, 2)) / 2, (W(0, 2) - W(2, 0)) / 2, (W(1, 0) - W(0, 1)) / 2;
    return v;
  };
  std::array<Vector6d, 7> first;
  for (std::size_t i = 0; i < first.size(); ++i) first[i] = local(pose.first[i]);
  ParameterScore to{.value = score.value,
                    .gradient = Parameters(parameters),
                    .hessian = ParameterMatrix(parameters, parameters)};
  for (int i = 0; i < parameters; ++i) {
    const auto a = static_cast<std::size_t>(i);
    to.gradient[i] = score.gradient.dot(first[a]);
    const Vector6d Hi = score.hessian * first[a];
    for (int j = 0; j < parameters; ++j) {
      const auto b = static_cast<std::size_t>(j);
      to.hessian(i, j) = Hi.dot(first[b]);
      if (curvature == Curvature::full)
        to.hessian(i, j) += score.gradient.dot(local(pose.second[a][b]));
    }
  }
  return to;
}

ParameterScore chained(const AffineScore& score, const PoseDerivatives& pose, int parameters,
                       Curvature curvature) {
  const auto flat = [](const PoseDerivatives::Matrix& m) {
    return Eigen::Map<const AffineScore::Vector>(m.data());
  };
  ParameterScore to{.value = score.value,
                    .gradient = Parameters(parameters),
                    .hessian = ParameterMatrix(parameters, parameters)};
  for (int i = 0; i < parameters; ++i) {
    const auto a = static_cast<std::size_t>(i);
    to.gradient[i] = score.gradient.dot(flat(pose.first[a]));
    const AffineScore::Vector Hi = score.hessian * flat(pose.first[a]);
    for (int j = 0; j < parameters; ++j) {
      const auto b = static_cast<std::size_t>(j);
      to.hessian(i, j) = Hi.dot(flat(pose.first[b]));
      if (curvature == Curvature::full)
        to.hessian(i, j) += score.gradient.dot(flat(pose.second[a][b]));
    }
  }
  return to;
}

Found minimise(const Objective& objective, const Pose& start, const SearchOptions& options) {
  LocalSpace space{.objective = objective, .curvature = curvature_of(options)};
  const Reached<LocalSpace> reached = search_in(space, start, options);
  return {.pose = normalized(reached.state),
          .score = reached.score,
          .iterations = reached.iterations,
          .evaluations = space.evaluations,
          .converged = reached.converged};
}

Found minimise(const Objective& objective, const Pose& start, const SearchOptions& options,
               const PoseOptions& pose) {
  const PoseParameters parameters(start, pose);  // which checks the options
  if (pose.form == PoseForm::local) return minimise(objective, start, options);
  if (!pose.is_rigid() && !objective.affine)
    throw std::invalid_argument("renormalise = false: expected an objective with an affine score");
  ParameterSpace space{.objective = objective, .options = pose, .curvature = curvature_of(options)};
  const Reached<ParameterSpace> reached = search_in(space, parameters, options);
  Found found{.pose = normalized(reached.state.rigid_pose()),
              .iterations = reached.iterations,
              .evaluations = space.evaluations + 1,
              .converged = reached.converged};
  found.score = objective.score(found.pose, space.curvature);
  return found;
}

double rms_distance(const std::vector<Eigen::Vector3d>& points) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += p.squaredNorm();
  const double rms = std::sqrt(sum / static_cast<double>(points.size()));
  return rms > 0 ? rms : 1;
}

}  // namespace minescan
