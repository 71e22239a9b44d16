// SPDX-License-Identifier: MIT
#include "registration/sampling.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "core/random.h"
#include "registration/lattice.h"

namespace minescan {
namespace {

/// Moves `count` random entries of `list` to its front (the beginning of a Fisher-Yates shuffle).
void draw_to_front(std::span<std::uint32_t> list, std::size_t count, Random& random) {
  for (std::size_t i = 0; i < count; ++i)
    std::swap(list[i], list[i + random.below(list.size() - i)]);
}

std::vector<std::uint32_t> sample_uniform(std::size_t count, std::size_t wanted,
                                          std::uint64_t seed) {
  std::vector<std::uint32_t> index(count);
  std::iota(index.begin(), index.end(), 0u);
  Random random(seed, 0);
  draw_to_front(index, wanted, random);
  index.resize(wanted);
  return index;
}

/// Point indices ordered by cell; cell c owns entries begin[c] ... begin[c + 1] - 1.
struct PointsByCell {
  std::vector<std::uint32_t> index = {};
  std::vector<std::uint32_t> begin = {};

  std::span<std::uint32_t> cell(std::size_t c) {
    return std::span(index).subspan(begin[c], begin[c + 1] - begin[c]);
  }
  std::size_t cells() const { return begin.size() - 1; }
  std::uint32_t count(std::size_t c) const { return begin[c + 1] - begin[c]; }
};

PointsByCell by_cell(const std::vector<Eigen::Vector3d>& points, double side) {
  const NumberedCells numbered = number_cells(points, Lattice(side), "sample-cell");
  const std::vector<std::uint32_t>& cell_of = numbered.cell_of;
  PointsByCell sorted{.index = std::vector<std::uint32_t>(points.size()),
                      .begin = std::vector<std::uint32_t>(numbered.keys.size() + 1, 0)};
  for (const std::uint32_t c : cell_of) ++sorted.begin[c + 1];
  std::partial_sum(sorted.begin.begin(), sorted.begin.end(), sorted.begin.begin());
  std::vector<std::uint32_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (std::uint32_t i = 0; i < cell_of.size(); ++i) sorted.index[next[cell_of[i]]++] = i;
  return sorted;
}

/// What `rounds` complete rounds draw.
std::size_t drawn_in(const PointsByCell& cells, std::uint32_t rounds) {
  std::size_t total = 0;
  for (std::size_t c = 0; c < cells.cells(); ++c) total += std::min(cells.count(c), rounds);
  return total;
}

std::vector<std::uint32_t> sample_spatial(const std::vector<Eigen::Vector3d>& points,
                                          std::size_t wanted, double side, std::uint64_t seed) {
  PointsByCell cells = by_cell(points, side);

  // The most complete rounds that do not draw more than wanted.
  std::uint32_t rounds = 0;
  for (std::uint32_t high = static_cast<std::uint32_t>(wanted) + 1; high - rounds > 1;) {
    const std::uint32_t middle = rounds + (high - rounds) / 2;
    (drawn_in(cells, middle) <= wanted ? rounds : high) = middle;
  }
  std::vector<std::uint32_t> last_round;  // cells with a point left for the incomplete round
  for (std::uint32_t c = 0; c < cells.cells(); ++c)
    if (cells.count(c) > rounds) last_round.push_back(c);
  const std::size_t missing = wanted - drawn_in(cells, rounds);

  Random random(seed, 0);
  draw_to_front(last_round, missing, random);
  std::vector<std::uint8_t> draws_more(cells.cells(), 0);
  for (std::size_t i = 0; i < missing; ++i) draws_more[last_round[i]] = 1;

  std::vector<std::uint32_t> chosen;
  chosen.reserve(wanted);
  for (std::size_t c = 0; c < cells.cells(); ++c) {
    const std::span<std::uint32_t> cell = cells.cell(c);
    const std::size_t draws = std::min(cells.count(c), rounds) + draws_more[c];
    draw_to_front(cell, draws, random);
    chosen.insert(chosen.end(), cell.begin(), cell.begin() + static_cast<std::ptrdiff_t>(draws));
  }
  return chosen;
}

}  // namespace

std::size_t sample_size(std::size_t count, double part) {
  const auto wanted = static_cast<std::size_t>(std::llround(part * static_cast<double>(count)));
  return std::min(count, std::max<std::size_t>(6, wanted));  // 6: as many as a pose has freedoms
}

std::vector<std::uint32_t> sample(const std::vector<Eigen::Vector3d>& points,
                                  const SamplingOptions& options) {
  const std::size_t wanted = sample_size(points.size(), options.ratio);
  std::vector<std::uint32_t> chosen;
  if (wanted == points.size()) {
    chosen.resize(wanted);
    std::iota(chosen.begin(), chosen.end(), 0u);
    return chosen;
  }
  switch (options.sampling) {
    case Sampling::uniform:
      chosen = sample_uniform(points.size(), wanted, options.seed);
      break;
    case Sampling::spatial:
      chosen = sample_spatial(points, wanted, options.cell_size, options.seed);
      break;
  }
  // In the order of the scan neighbours stay together, which the processor's caches like.
  std::vector<std::uint8_t> is_chosen(points.size(), 0);
  for (const std::uint32_t i : chosen) is_chosen[i] = 1;
  chosen.clear();
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (is_chosen[i]) chosen.push_back(i);
  return chosen;
}

std::vector<Eigen::Vector3d> sampled_points(const std::vector<Eigen::Vector3d>& points,
                                            const SamplingOptions& options) {
  std::vector<Eigen::Vector3d> list;
  const std::vector<std::uint32_t> chosen = sample(points, options);
  list.reserve(chosen.size());
  for (const std::uint32_t i : chosen) list.push_back(points[i]);
  return list;
}

}  // namespace minescan
