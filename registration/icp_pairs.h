// SPDX-License-Identifier: MIT
// The pairs of points that ICP brings together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/cloud.h"
#include "registration/icp.h"
#include "registration/kdtree.h"
#include "registration/normals.h"

namespace minescan {

/// Source points and their places in the target, arrays of the same length; all in the target
/// frame, the source moved. Normals are there where options ask for them, and zero where not known.
struct IcpPairs {
  std::vector<Eigen::Vector3d> source = {};
  std::vector<Eigen::Vector3d> target = {};
  std::vector<Eigen::Vector3d> source_normal = {};
  std::vector<Eigen::Vector3d> target_normal = {};
  std::vector<double> distance = {};  // metres
  std::vector<double> weight = {};

  std::size_t size() const { return source.size(); }
  void clear();
  /// Keeps the pairs of which `kept` is not 0.
  void keep(const std::vector<std::uint8_t>& kept);
};

/// Sets the weights of pairs.
void weigh(IcpPairs& pairs, PairWeights weights);

/// Keeps `part` of the pairs, rounded up: those closest together, of equally close ones the first.
void trim(IcpPairs& pairs, double part);

/// A place on the target's surface.
struct SurfacePlace {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Where the line from `point` along `direction` meets the surface of the target: the tangent plane
/// of a target point near there. None if it meets none, or further away than `max_distance`.
std::optional<SurfacePlace> shoot(const KdTree& tree, const std::vector<Eigen::Vector3d>& points,
                                  Normals& normals, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& direction, double max_distance);

/// Whether the options ask for normals of the source, and of the target.
bool uses_source_normals(const IcpOptions& options);
bool uses_target_normals(const IcpOptions& options);

/// Looks up the nearest neighbours of points that move a little between one look-up and the next.
///
/// Of every point it is known where it was when the tree was searched last, what the nearest point
/// was and how far all others were at least. As long as the old neighbour is no further than the
/// others can have become, it is still the nearest.
class TrackedNeighbours {
 public:
  /// points   those of the tree; tree and points must outlive it
  /// queries  how many points are looked up; their numbers are 0 ... queries - 1
  TrackedNeighbours(const KdTree& tree, const std::vector<Eigen::Vector3d>& points,
                    std::size_t queries)
      : tree_(tree), points_(points), known_(queries) {}

  /// Whether it is clear without a search which point is the nearest within max_distance, or that
  /// there is none; `nearest` is then that, or `nobody`.
  bool knows(std::size_t number, const Eigen::Vector3d& query, double max_distance,
             Neighbour& nearest) const;

  /// Searches for the points nearest to those of `queries` with these numbers, of which there are 1
  /// to KdPacket::size, and puts them into `nearest`, which stays as it is where there is none.
  /// Several threads may search for different numbers.
  void find(std::span<const std::uint32_t> numbers, const std::vector<Eigen::Vector3d>& queries,
            double max_distance, std::vector<Neighbour>& nearest);

  /// Neighbour::index where there is none.
  static constexpr std::uint32_t nobody = std::numeric_limits<std::uint32_t>::max();

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

/// Finds the pairs of one iteration after the other. What it is given must outlive it.
class IcpMatching {
 public:
  /// used     the used source points, source frame; points close together should be close in the
  ///          list, too: searches for them share their way
  /// tree     of the target's points
  /// normals  of the target
  IcpMatching(const PointCloud& target, const PointCloud& used, const KdTree& tree,
              Normals& normals, const IcpOptions& options);

  /// The pairs at the pose T, rejected, weighed and chosen as the options say; those further apart
  /// than max_distance metres are none.
  void find(const Pose& T, double max_distance, IcpPairs& pairs);

  std::size_t outside() const { return outside_; }
  /// Pairs found, before a sample of them was taken.
  std::size_t matched() const { return matched_; }

 private:
  void keep_stable(IcpPairs& pairs) const;

  const PointCloud& target_;
  const PointCloud& used_;
  const KdTree& tree_;
  Normals& normals_;
  const IcpOptions& options_;
  TreePolicy policy_ = {.search = options_.search, .bound = options_.tree_error};
  TrackedNeighbours tracked_;
  // Of every used point, before the pairs are put together in their order.
  std::vector<Eigen::Vector3d> placed_;   // target frame
  std::vector<Neighbour> nearest_;        // or TrackedNeighbours::nobody
  std::vector<std::uint8_t> is_outside_;  // of the target's box
  std::vector<std::uint32_t> wanted_;     // whose normals are asked for
  std::size_t outside_ = 0;
  std::size_t matched_ = 0;
};

}  // namespace minescan
