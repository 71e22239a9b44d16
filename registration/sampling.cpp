// SPDX-License-Identifier: MIT
#include "registration/sampling.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "core/random.h"
#include "registration/lattice.h"
#include "registration/normals.h"

namespace minescan {
namespace {

std::vector<Eigen::Vector3d> those(const std::vector<std::uint32_t>& chosen,
                                   const std::vector<Eigen::Vector3d>& all) {
  std::vector<Eigen::Vector3d> list;
  list.reserve(chosen.size());
  for (const std::uint32_t i : chosen) list.push_back(all[i]);
  return list;
}

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

PointsByCell by_cell(const std::vector<std::uint32_t>& cell_of, std::size_t cells) {
  PointsByCell sorted{.index = std::vector<std::uint32_t>(cell_of.size()),
                      .begin = std::vector<std::uint32_t>(cells + 1, 0)};
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

/// Random points, the cells taking turns.
std::vector<std::uint32_t> sample_in_turn(PointsByCell cells, std::size_t wanted,
                                          std::uint64_t seed) {
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

PointsByCell by_space(const std::vector<Eigen::Vector3d>& points, double side) {
  const NumberedCells numbered = number_cells(points, Lattice(side), "sample-cell");
  return by_cell(numbered.cell_of, numbered.keys.size());
}

PointsByCell by_direction(const std::vector<Eigen::Vector3d>& normals) {
  std::vector<std::uint32_t> bucket_of;
  bucket_of.reserve(normals.size());
  for (const Eigen::Vector3d& n : normals)
    bucket_of.push_back(static_cast<std::uint32_t>(direction_bucket(n)));
  return by_cell(bucket_of, direction_buckets() + 1);
}

std::vector<DirectionBand> make_direction_bands() {
  constexpr double pi = std::numbers::pi;
  constexpr int bands = 12;  // of 15 degrees (assumed: enough for the normals of 10 neighbours)
  std::vector<DirectionBand> list;
  std::size_t count = 0;
  for (int i = 0; i < bands; ++i) {
    const double middle = std::sin(pi * (i + 0.5) / bands);  // radius of the band's middle
    list.push_back(
        {.sectors = static_cast<std::size_t>(std::llround(2 * bands * middle)), .first = count});
    count += list.back().sectors;
  }
  // z is in proportion to area (Archimedes).
  const auto z = [&](std::size_t buckets) {
    return 2 * static_cast<double>(buckets) / static_cast<double>(count) - 1;
  };
  for (DirectionBand& band : list) {
    band.low = z(band.first);
    band.high = z(band.first + band.sectors);
  }
  return list;
}

}  // namespace

const std::vector<DirectionBand>& direction_bands() {
  static const std::vector<DirectionBand> bands = make_direction_bands();
  return bands;
}

std::size_t direction_buckets() {
  const DirectionBand& last = direction_bands().back();
  return last.first + last.sectors;
}

std::size_t direction_bucket(const Eigen::Vector3d& direction) {
  const double norm = direction.norm();
  if (!(norm > 0 && std::isfinite(norm))) return direction_buckets();
  const double z = direction.z() / norm;
  const auto& bands = direction_bands();
  auto band = bands.begin();
  while (band + 1 != bands.end() && z >= band->high) ++band;
  const double turn = std::atan2(direction.y(), direction.x()) / (2 * std::numbers::pi);
  const double part = turn < 0 ? turn + 1 : turn;
  const auto sector = static_cast<std::size_t>(part * static_cast<double>(band->sectors));
  return band->first + std::min(sector, band->sectors - 1);  // 1 - 1e-17 is 1
}

Stability stability_of(const std::vector<Eigen::Vector3d>& points,
                       const std::vector<Eigen::Vector3d>& normals) {
  const auto count = static_cast<double>(points.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / count;
  double distance = 0;
  for (const Eigen::Vector3d& p : points) distance += (p - mean).norm() / count;
  const double scale = distance > 0 ? 1 / distance : 1;

  Stability found;
  found.holds.reserve(points.size());
  Matrix6d C = Matrix6d::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    Vector6d f = Vector6d::Zero();
    if (normals[k].allFinite()) f << scale * (points[k] - mean).cross(normals[k]), normals[k];
    found.holds.push_back(f);
    C.noalias() += f * f.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(C);
  found.eigenvalues = solver.eigenvalues();
  found.motions = solver.eigenvectors();
  return found;
}

std::vector<std::uint32_t> sample_stable(const std::vector<Eigen::Vector3d>& points,
                                         const std::vector<Eigen::Vector3d>& normals,
                                         std::size_t wanted) {
  Stability stability = stability_of(points, normals);
  for (Vector6d& f : stability.holds)  // seen along the motions, squared
    f = (stability.motions.transpose() * f).cwiseAbs2().eval();
  const std::vector<Vector6d>& holds = stability.holds;

  std::array<std::vector<std::uint32_t>, 6> best = {};  // first those that hold motion j best
  std::array<std::size_t, 6> next = {};
  std::vector<std::size_t> motions;
  for (std::size_t j = 0; j < 6; ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    if (!(stability.eigenvalues[row] >= 1e-12 * stability.eigenvalues[5])) continue;
    motions.push_back(j);
    best[j].resize(points.size());
    std::iota(best[j].begin(), best[j].end(), 0u);
    std::stable_sort(best[j].begin(), best[j].end(), [&](std::uint32_t a, std::uint32_t b) {
      return holds[a][row] > holds[b][row];
    });
  }
  std::vector<std::uint8_t> used(points.size(), 0);
  Vector6d totals = Vector6d::Zero();
  std::vector<std::uint32_t> chosen;
  chosen.reserve(wanted);
  while (chosen.size() < wanted) {
    std::size_t least = motions.front();
    for (const std::size_t j : motions)
      if (totals[static_cast<Eigen::Index>(j)] < totals[static_cast<Eigen::Index>(least)])
        least = j;
    while (used[best[least][next[least]]]) ++next[least];
    const std::uint32_t k = best[least][next[least]];
    used[k] = 1;
    totals += holds[k];
    chosen.push_back(k);
  }
  return chosen;
}

std::size_t sample_size(std::size_t count, double part) {
  const auto wanted = static_cast<std::size_t>(std::llround(part * static_cast<double>(count)));
  return std::min(count, std::max<std::size_t>(6, wanted));  // 6: as many as a pose has freedoms
}

std::vector<std::uint32_t> sample(const std::vector<Eigen::Vector3d>& points,
                                  const SamplingOptions& options,
                                  const std::vector<Eigen::Vector3d>& normals) {
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
      chosen = sample_in_turn(by_space(points, options.cell_size), wanted, options.seed);
      break;
    case Sampling::normals:
    case Sampling::stable: {
      const std::vector<Eigen::Vector3d> found =
          normals.empty() ? found_normals(points, options.neighbours) : normals;
      chosen = options.sampling == Sampling::stable
                   ? sample_stable(points, found, wanted)
                   : sample_in_turn(by_direction(found), wanted, options.seed);
      break;
    }
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
  return those(sample(points, options), points);
}

UsedCloud::UsedCloud(const PointCloud& cloud, const SamplingOptions& options, bool sampled)
    : cloud_(cloud) {
  if (!sampled) return;
  const std::vector<std::uint32_t> chosen = sample(cloud.points, options, cloud.normals);
  sample_.emplace().points = those(chosen, cloud.points);
  if (!cloud.normals.empty()) sample_->normals = those(chosen, cloud.normals);
}

UsedCloud used_target(const PointCloud& target, const SamplingOptions& options) {
  return {target, options, options.of != SampleOf::source};
}

UsedCloud used_source(const PointCloud& source, const SamplingOptions& options) {
  return {source, options, options.of != SampleOf::target};
}

}  // namespace minescan
