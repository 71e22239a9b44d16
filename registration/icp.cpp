// SPDX-License-Identifier: MIT
#include "registration/icp.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "registration/alignment.h"
#include "registration/newton.h"
#include "registration/registered.h"
#include "registration/search.h"
#include "registration/stopwatch.h"

namespace minescan {
namespace {

constexpr std::uint32_t nobody = std::numeric_limits<std::uint32_t>::max();

/// The limit for pairs in iteration 1, 2, ...
double distance_limit(int iteration, const IcpOptions& o) {
  if (o.decrease_iterations == 0) return o.max_distance;
  const double part = std::min(1.0, static_cast<double>(iteration - 1) / o.decrease_iterations);
  return o.max_distance + part * (o.final_distance - o.max_distance);
}

bool compares_normals(const IcpOptions& o) {
  return o.metric == IcpMetric::symmetric || o.metric == IcpMetric::generalized ||
         o.matcher == IcpMatcher::normal_shooting || o.weights == PairWeights::normals ||
         o.max_angle < std::numbers::pi;
}
bool uses_source_normals(const IcpOptions& o) { return compares_normals(o) || o.resample; }
bool uses_target_normals(const IcpOptions& o) {
  return compares_normals(o) || o.metric == IcpMetric::plane;
}

/// The same points, those close together close in the list: searches for them share their way.
PointCloud in_order_of_place(const PointCloud& cloud) {
  PointCloud sorted;
  for (const std::uint32_t i : KdTree(cloud.points).order()) {
    sorted.points.push_back(cloud.points[i]);
    if (!cloud.normals.empty()) sorted.normals.push_back(cloud.normals[i]);
  }
  return sorted;
}

/// The used source points with their normals, in the source frame.
PointCloud used_cloud(const PointCloud& source, const IcpOptions& options) {
  PointCloud used = options.resample ? source : *used_source(source, options.sampling);
  if (!uses_source_normals(options))
    used.normals.clear();
  else if (used.normals.empty())
    used.normals = found_normals(used.points, options.neighbours, options.leaf_size);
  return in_order_of_place(used);
}

/// Looks up the nearest neighbours of points that move a little between one look-up and the next.
///
/// Of every point it is known where it was when the tree was searched last, what the nearest point
/// was and how far all others were at least. As long as the old neighbour is no further than the
/// others can have become, it is still the nearest.
class TrackedNeighbours {
 public:
  TrackedNeighbours(const KdTree& tree, const std::vector<Eigen::Vector3d>& points,
                    std::size_t queries)
      : tree_(tree), points_(points), known_(queries) {}

  /// Whether it is clear without a search which point is the nearest within max_distance, or that
  /// there is none; `nearest` is then that, or nobody.
  bool knows(std::size_t number, const Eigen::Vector3d& query, double max_distance,
             Neighbour& nearest) const {
    const Known& known = known_[number];
    const double others = known.others - (query - known.query).norm();
    nearest = {.index = nobody};
    if (known.index == nobody) return others >= max_distance;
    const double squared = (points_[known.index] - query).squaredNorm();
    const double distance = std::sqrt(squared);
    if (distance < max_distance && distance <= others) {
      nearest = {.index = known.index, .squared_distance = squared};
      return true;
    }
    return distance >= max_distance && others >= max_distance;
  }

  /// Searches for the points nearest to those of `queries` with these numbers, of which there are 1
  /// to KdPacket::size, and puts them into `nearest`, which stays as it is where there is none.
  void find(std::span<const std::uint32_t> numbers, const std::vector<Eigen::Vector3d>& queries,
            double max_distance, std::vector<Neighbour>& nearest) {
    Eigen::Vector3d packet[KdPacket::size];
    for (std::size_t i = 0; i < numbers.size(); ++i) packet[i] = queries[numbers[i]];
    const KdTree::NearestAndRestOfEach found =
        tree_.nearest_and_rest(std::span(packet, numbers.size()), max_distance + margin);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const std::optional<Neighbour>& near = found[i].nearest;
      known_[numbers[i]] = {
          .query = packet[i], .others = found[i].rest, .index = near ? near->index : nobody};
      if (near && std::sqrt(near->squared_distance) < max_distance) nearest[numbers[i]] = *near;
    }
  }

 private:
  // Metres that a point without a neighbour may move before it is looked for again (assumed).
  static constexpr double margin = 0.25;
  struct Known {
    Eigen::Vector3d query = Eigen::Vector3d::Zero();
    double others = -1;  // nothing is known yet
    std::uint32_t index = nobody;
  };

  const KdTree& tree_;
  const std::vector<Eigen::Vector3d>& points_;
  std::vector<Known> known_;
};

/// Finds the pairs of one iteration after the other.
class Matcher {
 public:
  Matcher(const PointCloud& target, const PointCloud& used, const KdTree& tree, Normals& normals,
          const IcpOptions& options)
      : target_(target),
        used_(used),
        tree_(tree),
        normals_(normals),
        options_(options),
        tracked_(tree, target.points, used.points.size()),
        placed_(used.points.size()),
        nearest_(used.points.size()),
        is_outside_(used.points.size()) {}

  void find(const Pose& T, double max_distance, IcpPairs& pairs) {
    pairs.clear();
    outside_ = 0;
    const Eigen::Vector3d low = tree_.low().array() - max_distance,
                          high = tree_.high().array() + max_distance;
    const bool shooting = options_.matcher == IcpMatcher::normal_shooting;
    constexpr std::size_t block = 256;
    parallel_for(used_.points.size(), block, [&](std::size_t begin, std::size_t end) {
      std::array<std::uint32_t, block> unknown;
      std::size_t count = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3d p = placed_[i] = T * used_.points[i];
        nearest_[i].index = nobody;
        is_outside_[i] = (p.array() < low.array()).any() || (p.array() > high.array()).any();
        if (is_outside_[i] || shooting) continue;
        if (!options_.tracked)
          nearest_[i] = tree_.nearest(p, max_distance, policy_).value_or(Neighbour{nobody});
        else if (!tracked_.knows(i, p, max_distance, nearest_[i]))
          unknown[count++] = static_cast<std::uint32_t>(i);
      }
      for (std::size_t k = 0; k < count; k += KdPacket::size)
        tracked_.find(std::span(unknown).subspan(k, std::min(KdPacket::size, count - k)), placed_,
                      max_distance, nearest_);
    });
    if (uses_target_normals(options_) && !shooting) {
      wanted_.clear();
      for (const Neighbour& near : nearest_)
        if (near.index != nobody) wanted_.push_back(near.index);
      normals_.find(wanted_);
    }
    for (std::size_t i = 0; i < used_.points.size(); ++i) {
      const Eigen::Vector3d& p = placed_[i];
      if (is_outside_[i]) {
        ++outside_;
        continue;
      }
      if (shooting) {
        const std::optional<SurfacePlace> place =
            shoot(tree_, target_.points, normals_, p, T.linear() * used_.normals[i], max_distance);
        if (!place) continue;
        pairs.target.push_back(place->point);
        pairs.target_normal.push_back(place->normal);
        pairs.distance.push_back((place->point - p).norm());
      } else {
        const std::uint32_t index = nearest_[i].index;
        if (index == nobody) continue;
        pairs.target.push_back(target_.points[index]);
        if (uses_target_normals(options_)) pairs.target_normal.push_back(normals_.of(index));
        pairs.distance.push_back(std::sqrt(nearest_[i].squared_distance));
      }
      pairs.source.push_back(p);
      if (!used_.normals.empty()) pairs.source_normal.push_back(T.linear() * used_.normals[i]);
    }
    if (options_.max_angle < std::numbers::pi) {
      std::vector<std::uint8_t> kept(pairs.size());
      for (std::size_t i = 0; i < pairs.size(); ++i)
        kept[i] =
            pairs.source_normal[i].dot(pairs.target_normal[i]) >= std::cos(options_.max_angle);
      pairs.keep(kept);
    }
    if (options_.kept_pairs < 1) trim(pairs, options_.kept_pairs);
    matched_ = pairs.size();
    if (options_.resample) keep_stable(pairs);
    weigh(pairs, options_.weights);
  }
  std::size_t outside() const { return outside_; }
  /// Pairs found, before a sample of them was taken.
  std::size_t matched() const { return matched_; }

 private:
  void keep_stable(IcpPairs& pairs) const {
    const std::size_t wanted = sample_size(used_.points.size(), options_.sampling.ratio);
    if (wanted >= pairs.size()) return;
    std::vector<std::uint8_t> chosen(pairs.size());
    for (const std::uint32_t i : sample_stable(pairs.source, pairs.source_normal, wanted))
      chosen[i] = 1;
    pairs.keep(chosen);
  }

  const PointCloud& target_;
  const PointCloud& used_;
  const KdTree& tree_;
  Normals& normals_;
  const IcpOptions& options_;
  TreePolicy policy_ = {.search = options_.search, .bound = options_.tree_error};
  TrackedNeighbours tracked_;
  // Of every used point, before the pairs are put together in their order.
  std::vector<Eigen::Vector3d> placed_;   // target frame
  std::vector<Neighbour> nearest_;        // or nobody
  std::vector<std::uint8_t> is_outside_;  // of the target's box
  std::vector<std::uint32_t> wanted_;     // whose normals are asked for
  std::size_t outside_ = 0;
  std::size_t matched_ = 0;
};

/// What the pairs hold, and how far they are apart.
struct Pull {
  Matrix6d information = Matrix6d::Zero();  // sum of w J^T J
  Vector6d gradient = Vector6d::Zero();     // sum of w r J
  double squares = 0;                       // sum of w r^2
  double weights = 0;
};

/// Residuals n.(p - q), with the derivatives (n, lever x n) of (tau, omega) about `centre`.
Pull pull_along(const IcpPairs& pairs, const Eigen::Vector3d& centre, IcpMetric metric) {
  Pull pull;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d &p = pairs.source[i], &q = pairs.target[i];
    Eigen::Vector3d n = pairs.target_normal[i], lever = p - centre;
    if (metric == IcpMetric::symmetric) {
      // Both normals point to their scanner, which may see the surface from either side.
      n += (n.dot(pairs.source_normal[i]) < 0 ? -1 : 1) * pairs.source_normal[i];
      lever = (p + q) / 2 - centre;  // both ends turn, by half the angle each
    }
    const double r = n.dot(p - q), w = pairs.weight[i];
    Vector6d J;
    J << n, lever.cross(n);
    pull.information.noalias() += (w * J) * J.transpose();
    pull.gradient += w * r * J;
    pull.squares += w * r * r;
    pull.weights += w;
  }
  return pull;
}

/// The same for the distance between the points.
Pull pull_to_points(const IcpPairs& pairs, const Eigen::Vector3d& centre) {
  Pull pull;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PointJacobian J = point_jacobian(pairs.source[i] - centre);
    pull.information += pairs.weight[i] * J.transpose() * J;
    pull.squares += pairs.weight[i] * (pairs.source[i] - pairs.target[i]).squaredNorm();
    pull.weights += pairs.weight[i];
  }
  return pull;
}

/// The same for differences between two flat distributions: J^T M J with the inverse M of the sum
/// of both covariances. For the directions that are held, only what lies across the surfaces
/// counts: `surface` is the sum of w J^T n n^T J.
Pull pull_between_planes(const IcpPairs& pairs, const Eigen::Vector3d& centre, double flatness,
                         Matrix6d* surface = nullptr) {
  Pull pull;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d lever = pairs.source[i] - centre;
    const Eigen::Vector3d d = pairs.source[i] - pairs.target[i];
    const Eigen::Vector3d &a = pairs.source_normal[i], &b = pairs.target_normal[i];
    const double w = pairs.weight[i];
    // Both have the covariance I - (1 - flatness) n n^T; without a normal it is I.
    Eigen::Matrix3d C = -(1 - flatness) * (a * a.transpose() + b * b.transpose());
    C.diagonal().array() += 2;
    const Eigen::Matrix3d M = C.inverse();
    const Eigen::Matrix3d MX = M * -skew(lever), X = skew(lever);
    const Eigen::Vector3d v = M * d;
    pull.information.topLeftCorner<3, 3>() += w * M;
    pull.information.topRightCorner<3, 3>() += w * MX;
    pull.information.bottomRightCorner<3, 3>() += w * (X * MX);
    pull.gradient.head<3>() += w * v;
    pull.gradient.tail<3>() += w * lever.cross(v);
    pull.squares += w * d.dot(v);
    pull.weights += w;
    if (surface) {
      Vector6d along;
      along << b, lever.cross(b);
      *surface += w * along * along.transpose();
    }
  }
  pull.information.bottomLeftCorner<3, 3>() = pull.information.topRightCorner<3, 3>().transpose();
  return pull;
}

/// The motion of the target frame that brings the pairs together, or none if they do not fix it.
std::optional<Pose> motion(const IcpPairs& pairs, const IcpOptions& options) {
  if (options.metric == IcpMetric::point)
    return options.closed_form == ClosedForm::svd
               ? align_svd(pairs.target, pairs.source, pairs.weight)
               : align_quaternion(pairs.target, pairs.source, pairs.weight);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : pairs.source) centre += p / static_cast<double>(pairs.size());
  const Pull pull = options.metric == IcpMetric::generalized
                        ? pull_between_planes(pairs, centre, options.flatness)
                        : pull_along(pairs, centre, options.metric);
  const Eigen::LDLT<Matrix6d> ldlt(pull.information);
  const Vector6d step = -ldlt.solve(pull.gradient);
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive() || !step.allFinite()) return {};
  Pose moved = Pose::Identity();
  if (options.metric != IcpMetric::symmetric) {
    moved.linear() = rotation_exp(step.tail<3>());
    moved.translation() = centre + step.head<3>() - moved.linear() * centre;
    return moved;
  }
  // Rusinkiewicz 2019, section 2.3: half the turn, the shift, half the turn.
  const double half = std::atan(step.tail<3>().norm() / 2);
  const Eigen::Matrix3d turn =
      half > 0 ? rotation_exp(half * step.tail<3>().normalized()) : Eigen::Matrix3d::Identity();
  moved.linear() = turn * turn;
  moved.translation() = centre + turn * (std::cos(half) * step.head<3>()) - moved.linear() * centre;
  return moved;
}

double pose_change(const Pose& from, const Pose& to) {
  const double angle = pose_error(from, to).rotation;
  return std::hypot((to.translation() - from.translation()).norm(), angle);
}

/// What the last pairs say of the pose.
void conclude(const IcpPairs& pairs, const PointCloud& used, const IcpOptions& options,
              RegistrationResult& result) {
  const Eigen::Vector3d origin = result.T_target_source.translation();  // of the source
  Pull pull;
  Matrix6d held = Matrix6d::Zero();  // what surfaces hold
  double coordinates = 3;            // that a pair compares
  switch (options.metric) {
    case IcpMetric::point:
      pull = pull_to_points(pairs, origin);
      held = pull.information;
      break;
    case IcpMetric::generalized:
      pull = pull_between_planes(pairs, origin, options.flatness, &held);
      break;
    case IcpMetric::plane:
    case IcpMetric::symmetric:
      pull = pull_along(pairs, origin, options.metric);
      held = pull.information;
      coordinates = 1;
      break;
  }
  result.directions = directions_of(held, rms_distance(used.points));
  // No weights: pairs of which none counts.
  if (!(pull.weights > 0) || (options.metric != IcpMetric::point &&
                              !(result.directions.front().hold >= options.min_rank))) {
    result.status = Status::degenerate;
    return;
  }
  result.score = pull.squares / pull.weights;
  result.covariance = result.score / coordinates * pull.information.inverse();
}

void run_icp(const PointCloud& whole_target, const PointCloud& source, const IcpOptions& options,
             RegistrationResult& result) {
  if (options.resample &&
      (options.sampling.sampling != Sampling::stable || options.sampling.of == SampleOf::target))
    throw std::invalid_argument("resample: expected sampling stable of the source, found " +
                                value_text(options.sampling.sampling) + " of " +
                                value_text(options.sampling.of));
  Stopwatch watch;
  const PointCloud used = used_cloud(source, options);
  result.used_points = used.points.size();
  result.time.source = watch.lap();

  const UsedCloud used_of_target = used_target(whole_target, options.sampling);
  const PointCloud& target = *used_of_target;
  const KdTree tree(target.points, options.leaf_size);
  Normals normals(target, tree, options.neighbours);
  result.target_bytes = tree.bytes();
  result.time.target = watch.lap();

  const double needed = needed_points(used.points.size(), options.min_overlap);
  Matcher matcher(target, used, tree, normals, options);
  IcpPairs pairs;
  Pose& T = result.T_target_source;
  const auto find = [&] {
    ++result.evaluations;
    matcher.find(T, distance_limit(result.iterations, options), pairs);
  };
  while (result.status == Status::max_iterations && result.iterations < options.max_iterations) {
    ++result.iterations;
    find();
    if (static_cast<double>(matcher.matched()) < needed) {
      result.status = Status::no_overlap;
    } else if (const std::optional<Pose> moved = motion(pairs, options)) {
      const Pose next = normalized(*moved * T);
      const bool still = pose_change(T, next) < options.stop_step;
      if (still && result.iterations > options.decrease_iterations)
        result.status = Status::converged;
      T = next;
    } else {
      result.status = Status::degenerate;
    }
  }
  if (result.status == Status::converged || result.status == Status::max_iterations) {
    find();  // from the last pose
    if (static_cast<double>(matcher.matched()) < needed)
      result.status = Status::no_overlap;
    else
      conclude(pairs, used, options, result);
  }
  result.outside_points = matcher.outside();
  result.empty_points = used.points.size() - matcher.matched() - result.outside_points;
  result.time.align = watch.lap();
}

}  // namespace

void IcpPairs::clear() {
  for (auto* list : {&source, &target, &source_normal, &target_normal}) list->clear();
  distance.clear();
  weight.clear();
}

void IcpPairs::keep(const std::vector<std::uint8_t>& kept) {
  const auto filter = [&](auto& list) {
    if (list.size() != kept.size()) return;  // not asked for
    std::size_t count = 0;
    for (std::size_t i = 0; i < kept.size(); ++i)
      if (kept[i]) list[count++] = list[i];
    list.resize(count);
  };
  for (auto* list : {&target, &source_normal, &target_normal, &source}) filter(*list);
  filter(distance);
  filter(weight);
}

void weigh(IcpPairs& pairs, PairWeights weights) {
  pairs.weight.assign(pairs.size(), 1);
  if (weights == PairWeights::distance && pairs.size() > 0) {
    const double largest = *std::max_element(pairs.distance.begin(), pairs.distance.end());
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (largest > 0) pairs.weight[i] = 1 - pairs.distance[i] / largest;
  } else if (weights == PairWeights::normals) {
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs.weight[i] = std::max(0.0, pairs.source_normal[i].dot(pairs.target_normal[i]));
  }
}

void trim(IcpPairs& pairs, double part) {
  const auto kept = static_cast<std::size_t>(std::ceil(part * static_cast<double>(pairs.size())));
  if (kept >= pairs.size()) return;
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < pairs.size(); ++i) order.emplace_back(pairs.distance[i], i);
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end());
  std::vector<std::uint8_t> chosen(pairs.size(), 0);
  for (std::size_t i = 0; i < kept; ++i) chosen[order[i].second] = 1;
  pairs.keep(chosen);
}

std::optional<SurfacePlace> shoot(const KdTree& tree, const std::vector<Eigen::Vector3d>& points,
                                  Normals& normals, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction, double max_distance) {
  // From the tangent plane of one point to that of the next: on a smooth surface three steps reach
  // what the spacing of points allows.
  SurfacePlace place{.point = point};
  for (int step = 0; step < 3; ++step) {
    const std::optional<Neighbour> near = tree.nearest(place.point, max_distance);
    if (!near) return {};
    place.normal = normals.of(near->index);
    const double along = place.normal.dot(direction);
    if (std::abs(along) < 0.1) return {};  // within 6 degrees of the surface (assumed)
    place.point = point + place.normal.dot(points[near->index] - point) / along * direction;
  }
  if (!((place.point - point).norm() < max_distance)) return {};
  return place;
}

RegistrationResult register_icp(const PointCloud& target, const PointCloud& source,
                                const Pose& T_guess, const IcpOptions& options) {
  return registered(target, source, T_guess, options, run_icp);
}

}  // namespace minescan
