// SPDX-License-Identifier: MIT
#include "registration/icp_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/parallel.h"

namespace minescan {
namespace {

constexpr std::uint32_t nobody = TrackedNeighbours::nobody;

bool compares_normals(const IcpOptions& o) {
  return o.metric == IcpMetric::symmetric || o.metric == IcpMetric::generalized ||
         o.matcher == IcpMatcher::normal_shooting || o.weights == PairWeights::normals ||
         o.max_angle < std::numbers::pi;
}

}  // namespace

bool uses_source_normals(const IcpOptions& o) { return compares_normals(o) || o.resample; }
bool uses_target_normals(const IcpOptions& o) {
  return compares_normals(o) || o.metric == IcpMetric::plane;
}

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

bool TrackedNeighbours::knows(std::size_t number, const Eigen::Vector3d& query, double max_distance,
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

void TrackedNeighbours::find(std::span<const std::uint32_t> numbers,
                             const std::vector<Eigen::Vector3d>& queries, double max_distance,
                             std::vector<Neighbour>& nearest) {
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

IcpMatching::IcpMatching(const PointCloud& target, const PointCloud& used, const KdTree& tree,
                         Normals& normals, const IcpOptions& options)
    : target_(target),
      used_(used),
      tree_(tree),
      normals_(normals),
      options_(options),
      tracked_(tree, target.points, used.points.size()),
      placed_(used.points.size()),
      nearest_(used.points.size()),
      is_outside_(used.points.size()) {}

void IcpMatching::find(const Pose& T, double max_distance, IcpPairs& pairs) {
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
    // Packets stay within a block: which points are looked up together does not depend on threads.
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
      kept[i] = pairs.source_normal[i].dot(pairs.target_normal[i]) >= std::cos(options_.max_angle);
    pairs.keep(kept);
  }
  if (options_.kept_pairs < 1) trim(pairs, options_.kept_pairs);
  matched_ = pairs.size();
  if (options_.resample) keep_stable(pairs);
  weigh(pairs, options_.weights);
}

void IcpMatching::keep_stable(IcpPairs& pairs) const {
  const std::size_t wanted = sample_size(used_.points.size(), options_.sampling.ratio);
  if (wanted >= pairs.size()) return;
  std::vector<std::uint8_t> chosen(pairs.size());
  for (const std::uint32_t i : sample_stable(pairs.source, pairs.source_normal, wanted))
    chosen[i] = 1;
  pairs.keep(chosen);
}

}  // namespace minescan
