// SPDX-License-Identifier: MIT
// Subsets of a cloud, drawn at random but always the same for the same seed.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"

namespace minescan {

enum class Sampling {
  uniform,  // every point is as likely as any other
  spatial,  // equal cells are drawn from in turn, so that dense places do not outweigh sparse ones
};
constexpr auto names_of(Sampling) {
  return std::to_array<std::string_view>({"uniform", "spatial"});
}

struct SamplingOptions {
  double ratio = 0.1;                     // paper, section 5
  Sampling sampling = Sampling::spatial;  // paper, section 5
  double cell_size = 0.5;                 // metres; assumed, the paper does not give it
  std::uint64_t seed = 1;
};

template <class Visitor>
void fields(SamplingOptions& o, Visitor&& field) {
  field("sample-ratio", o.ratio, ratio, "", "part of the source points that is used");
  field("sampling", o.sampling, "how they are drawn: each alike, or evenly over space");
  field("sample-cell", o.cell_size, between(0.001, 1000), "m", "spatial sampling: side of a cell");
  field("sample-seed", o.seed, not_negative, "", "names the random choice");
}

/// How many of `count` points are drawn: round(part * count), at least 6 (or all, if fewer).
std::size_t sample_size(std::size_t count, double part);

/// Indices of sample_size(points.size(), ratio) distinct points, ascending.
///
/// Spatial sampling draws in rounds of one random unused point from every cell that has any left;
/// the last, incomplete round takes a random part of the cells.
/// throws  std::invalid_argument for a point more than 2^20 sampling cells away from the origin
/// cost    O(N) time and memory
/// source  Magnusson et al. 2007, section 4.1
std::vector<std::uint32_t> sample(const std::vector<Eigen::Vector3d>& points,
                                  const SamplingOptions& options);

/// The sampled points themselves.
std::vector<Eigen::Vector3d> sampled_points(const std::vector<Eigen::Vector3d>& points,
                                            const SamplingOptions& options);

}  // namespace minescan
