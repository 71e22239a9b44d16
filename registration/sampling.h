// SPDX-License-Identifier: MIT
// Subsets of a cloud, always the same for the same seed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"

namespace minescan {

enum class Sampling {
  uniform,  // every point is as likely as any other
  spatial,  // equal cells are drawn from in turn, so that dense places do not outweigh sparse ones
  normals,  // the same with equal buckets of normals (Rusinkiewicz and Levoy 2001)
  stable,   // points that hold the pose equally well in all directions (Gelfand et al. 2003)
};
constexpr auto names_of(Sampling) {
  return std::to_array<std::string_view>({"uniform", "spatial", "normals", "stable"});
}

/// Which of the two clouds is sampled; of the other one all points are used.
enum class SampleOf { source, target, both };
constexpr auto names_of(SampleOf) {
  return std::to_array<std::string_view>({"source", "target", "both"});
}

struct SamplingOptions {
  double ratio = 0.1;                     // paper, section 5
  Sampling sampling = Sampling::spatial;  // paper, section 5
  SampleOf of = SampleOf::source;         // paper, section 5; section 4.1 tries the others
  double cell_size = 0.5;                 // metres; assumed, the paper does not give it
  int neighbours = 10;                    // from which normals are found; assumed
  std::uint64_t seed = 1;
};

template <class Visitor>
void fields(SamplingOptions& o, Visitor&& field) {
  field("sample-ratio", o.ratio, ratio, "", "part of the points of a sampled cloud that is used");
  field("sampling", o.sampling,
        "how they are drawn: each alike, evenly over space, evenly over the directions of normals, "
        "or those that hold the pose best");
  field("sample-of", o.of, "which clouds are sampled");
  field("sample-cell", o.cell_size, between(0.001, 1000), "m", "spatial sampling: side of a cell");
  field("sample-neighbours", o.neighbours, between(3, 1000), "",
        "sampling normals and stable: points from which a normal is found, where the cloud has "
        "none");
  field("sample-seed", o.seed, not_negative, "", "names the random choice");
}

/// How many of `count` points are drawn: round(part * count), at least 6 (or all, if fewer).
std::size_t sample_size(std::size_t count, double part);

/// Indices of sample_size(points.size(), ratio) distinct points, ascending.
///
/// normals  one unit vector per point, or none: they are then found (class Normals), which is done
///          only where the sampling asks for them
///
/// Spatial sampling draws in rounds of one random unused point from every cell that has any left;
/// the last, incomplete round takes a random part of the cells. Normals: the same with
/// direction_bands for cells; points without a normal have a cell of their own. Stable: see
/// sample_stable.
/// throws  std::invalid_argument for a point more than 2^20 sampling cells away from the origin
/// cost    O(N) time and memory; O(N log N) time if normals are found, or for stable sampling
/// source  Magnusson et al. 2007, section 4.1
std::vector<std::uint32_t> sample(const std::vector<Eigen::Vector3d>& points,
                                  const SamplingOptions& options,
                                  const std::vector<Eigen::Vector3d>& normals = {});

/// The sampled points themselves.
std::vector<Eigen::Vector3d> sampled_points(const std::vector<Eigen::Vector3d>& points,
                                            const SamplingOptions& options);

/// The part of a cloud that a registration uses: a sample of it, with the normals of the cloud if
/// it has any, or the cloud itself, to which it then refers.
class UsedCloud {
 public:
  UsedCloud(const PointCloud& cloud, const SamplingOptions& options, bool sampled);
  const PointCloud& operator*() const { return sample_ ? *sample_ : cloud_; }
  const PointCloud* operator->() const { return &**this; }

 private:
  const PointCloud& cloud_;
  std::optional<PointCloud> sample_ = {};
};

/// What SamplingOptions::of says of the two clouds of a registration. Structures of the target are
/// built from its used points alone.
UsedCloud used_target(const PointCloud& target, const SamplingOptions& options);
UsedCloud used_source(const PointCloud& source, const SamplingOptions& options);

/// Directions with low <= z < high (the last band with z = 1, too), cut into sectors of equal
/// angles about z, the first of which begins at the x axis.
struct DirectionBand {
  double low = -1, high = 1;
  std::size_t sectors = 1;
  std::size_t first = 0;  // number of the first sector among all buckets
};

/// The sphere of directions in 184 buckets of equal area, about 15 degrees wide. Their sectors get
/// fewer towards the poles, where equal steps of z and angle would leave splinters.
const std::vector<DirectionBand>& direction_bands();

/// The bucket of a direction of any length, or direction_buckets() if it is zero or not finite.
std::size_t direction_bucket(const Eigen::Vector3d& direction);
std::size_t direction_buckets();

/// `wanted` points that hold all six freedoms of a pose equally well, as far as the cloud allows.
///
/// Points p_k are taken about their mean, their mean distance from it being 1. Point k with normal
/// n_k holds the motion x (a unit eigenvector of the sum of f f^T) by (f_k . x)^2, f_k being
/// (p_k x n_k, n_k). The motion that is held least by the points chosen so far gets the unused
/// point that holds it best, of equal ones the first, until all are chosen. Motions that nothing
/// holds (eigenvalue below 1e-12 of the largest: rounding) are left out, since for them any point
/// is as bad as another. Nothing is random.
///
/// normals  as many as points; of any sign, zero or not finite where not known: such a point holds
///          nothing
/// returns  indices in the order of choice; wanted <= points.size()
/// cost     O(N log N)
/// source   Gelfand, Ikemoto, Rusinkiewicz, Levoy 2003
std::vector<std::uint32_t> sample_stable(const std::vector<Eigen::Vector3d>& points,
                                         const std::vector<Eigen::Vector3d>& normals,
                                         std::size_t wanted);

/// What normals hold: f_k of sample_stable, and the eigenvalues (ascending) and eigenvectors (the
/// columns) of the sum of f f^T. The ratio of the last to the first eigenvalue tells how far the
/// surface lets itself slide.
struct Stability {
  std::vector<Vector6d> holds = {};
  Vector6d eigenvalues = Vector6d::Zero();
  Matrix6d motions = Matrix6d::Zero();
};
Stability stability_of(const std::vector<Eigen::Vector3d>& points,
                       const std::vector<Eigen::Vector3d>& normals);

}  // namespace minescan
