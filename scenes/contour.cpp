// SPDX-License-Identifier: MIT
#include "scenes/contour.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"
#include "scenes/block_marcher.h"

namespace minescan {
namespace {

// Side of a tile, about; assumed: a scanner's near field.
constexpr double tile_side = 25.6;

// Blocks that one thread marches through before it takes the next ones.
constexpr std::size_t blocks_at_once = 4;

/// Corners low <= i < high of a box of blocks.
struct BlockBox {
  Cell low = Cell::Zero();
  Cell high = Cell::Zero();
};

/// floor(a / b) for b > 0.
std::int64_t floor_ratio(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }

bool in_order(const Cell& a, const Cell& b) {
  if (a.z() != b.z()) return a.z() < b.z();
  if (a.y() != b.y()) return a.y() < b.y();
  return a.x() < b.x();
}

/// The blocks that hold the bounds and one cell more to each side, so that the surface does not
/// touch the border.
BlockBox blocks_of(const Eigen::AlignedBox3d& bounds, double edge) {
  BlockBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = static_cast<std::int64_t>(std::floor(bounds.min()[axis] / edge)) - 2;
    const auto last = static_cast<std::int64_t>(std::ceil(bounds.max()[axis] / edge)) + 1;
    const std::int64_t origin = low_of(Cell::Zero())[axis];
    box.low[axis] = floor_ratio(first - origin, block_size);
    box.high[axis] = floor_ratio(last - 1 - origin, block_size) + 1;
  }
  return box;
}

/// Blocks that may hold surface, sorted. Halves cubes of many blocks until they cannot hold any or
/// are single blocks, so that empty space costs little.
std::vector<Cell> active_blocks(const ImplicitSurface& surface, double edge, const BlockBox& box) {
  // From cubes so large that few are needed: a mine is flat, and one cube would be mostly empty.
  std::int64_t size = 1;
  while (size < (box.high - box.low).maxCoeff()) size *= 2;
  std::vector<Cell> cubes;
  for (std::int64_t z = floor_ratio(box.low.z(), size) * size; z < box.high.z(); z += size)
    for (std::int64_t y = floor_ratio(box.low.y(), size) * size; y < box.high.y(); y += size)
      for (std::int64_t x = floor_ratio(box.low.x(), size) * size; x < box.high.x(); x += size)
        cubes.emplace_back(x, y, z);

  std::vector<std::uint8_t> active;
  while (true) {
    const double half = edge * static_cast<double>(size * block_size) / 2;
    active.assign(cubes.size(), 0);
    parallel_for(cubes.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3d low = lattice_point(low_of(cubes[i]), edge);
        const Interval range =
            surface.range(low + Eigen::Vector3d::Constant(half), half * std::sqrt(3.0));
        active[i] = range.low <= 0 && range.high >= 0;
      }
    });
    std::vector<Cell> next;
    const std::int64_t step = size / 2;
    for (std::size_t i = 0; i < cubes.size(); ++i) {
      if (active[i] == 0) continue;
      if (size == 1) {
        next.push_back(cubes[i]);
        continue;
      }
      for (int part = 0; part < 8; ++part) {
        const Cell low = cubes[i] + step * Cell(part & 1, part >> 1 & 1, part >> 2 & 1);
        const bool in_box =
            (low.array() < box.high.array()).all() && (low.array() + step > box.low.array()).all();
        if (in_box) next.push_back(low);
      }
    }
    cubes = std::move(next);
    if (size == 1) break;
    size = step;
  }
  std::sort(cubes.begin(), cubes.end(), in_order);
  return cubes;
}

std::vector<Patch> patches_of(const ImplicitSurface& surface, double edge,
                              const std::vector<Cell>& blocks) {
  std::vector<Patch> patches(blocks.size());
  parallel_for(blocks.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    BlockMarcher marcher(surface, edge);
    for (std::size_t i = begin; i < end; ++i) patches[i] = marcher.march(blocks[i]);
  });
  return patches;
}

/// Vertices of blocks that are not there: each becomes a vertex of its own.
struct Missing {
  Cell block = Cell::Zero();
  std::uint32_t code = 0;
  Eigen::Vector3f place = Eigen::Vector3f::Zero();
};

bool missing_in_order(const Missing& a, const Missing& b) {
  if (a.block != b.block) return in_order(a.block, b.block);
  return a.code < b.code;
}

constexpr std::size_t nowhere = std::numeric_limits<std::size_t>::max();

/// Index of a block in a sorted list, or nowhere.
std::size_t index_in(const std::vector<Cell>& blocks, const Cell& block) {
  const auto found = std::lower_bound(blocks.begin(), blocks.end(), block, in_order);
  if (found == blocks.end() || *found != block) return nowhere;
  return static_cast<std::size_t>(found - blocks.begin());
}

/// Puts the patches of sorted blocks into one mesh, in their order.
TriangleMesh joined(const std::vector<const Patch*>& patches, const std::vector<Cell>& blocks) {
  std::vector<std::size_t> first_vertex(patches.size() + 1, 0);
  std::vector<std::size_t> first_triangle(patches.size() + 1, 0);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    first_vertex[i + 1] = first_vertex[i] + patches[i]->vertices.size();
    first_triangle[i + 1] = first_triangle[i] + patches[i]->triangles.size();
  }
  const auto owner_of = [&](std::size_t i, const Patch::Foreign& f) -> Cell {
    return blocks[i] + Cell(f.step[0], f.step[1], f.step[2]);
  };
  std::vector<Missing> missing;
  for (std::size_t i = 0; i < patches.size(); ++i)
    for (const Patch::Foreign& f : patches[i]->foreign)
      if (const Cell owner = owner_of(i, f); index_in(blocks, owner) == nowhere)
        missing.push_back({owner, f.code, f.place});
  std::sort(missing.begin(), missing.end(), missing_in_order);
  missing.erase(std::unique(missing.begin(), missing.end(),
                            [](const Missing& a, const Missing& b) {
                              return a.block == b.block && a.code == b.code;
                            }),
                missing.end());

  const auto global_index = [&](std::size_t i, const Patch::Foreign& f) {
    const Cell block = owner_of(i, f);
    const std::size_t owner = index_in(blocks, block);
    if (owner == nowhere) {
      const auto found = std::lower_bound(missing.begin(), missing.end(),
                                          Missing{block, f.code, f.place}, missing_in_order);
      return static_cast<std::uint32_t>(first_vertex.back() + (found - missing.begin()));
    }
    const std::vector<Patch::Rim>& rim = patches[owner]->rim;
    const auto found =
        std::lower_bound(rim.begin(), rim.end(), f.code,
                         [](const Patch::Rim& r, std::uint32_t code) { return r.code < code; });
    assert(found != rim.end() && found->code == f.code);
    return static_cast<std::uint32_t>(first_vertex[owner] + found->vertex);
  };

  TriangleMesh mesh;
  mesh.vertices.resize(first_vertex.back() + missing.size());
  mesh.triangles.resize(first_triangle.back());
  mesh.material.resize(first_triangle.back());
  for (std::size_t i = 0; i < missing.size(); ++i)
    mesh.vertices[first_vertex.back() + i] = missing[i].place;
  parallel_for(patches.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Patch& patch = *patches[i];
      std::vector<std::uint32_t> foreign;
      for (const Patch::Foreign& f : patch.foreign) foreign.push_back(global_index(i, f));
      std::copy(patch.vertices.begin(), patch.vertices.end(),
                mesh.vertices.begin() + first_vertex[i]);
      std::copy(patch.material.begin(), patch.material.end(),
                mesh.material.begin() + first_triangle[i]);
      for (std::size_t t = 0; t < patch.triangles.size(); ++t)
        for (std::size_t c = 0; c < 3; ++c) {
          const std::uint32_t corner = patch.triangles[t][c];
          mesh.triangles[first_triangle[i] + t][c] =
              (corner & Patch::foreign_bit) != 0
                  ? foreign[corner & ~Patch::foreign_bit]
                  : static_cast<std::uint32_t>(first_vertex[i] + corner);
        }
    }
  });
  return mesh;
}

void check_edge_length(double edge_length) {
  if (!(edge_length > 0 && std::isfinite(edge_length)))
    throw std::invalid_argument("edge-length: expected a number > 0 (m), found " +
                                number_text(edge_length));
}

void check_memory(double bytes, double edge_length, const std::string& remedy) {
  if (!(bytes <= contour_bytes_limit))
    throw std::invalid_argument(
        "edge-length = " + number_text(edge_length) + " m needs about " +
        number_text(std::ceil(bytes / (1 << 30))) + " GiB of memory; expected at most " +
        number_text(contour_bytes_limit / (1 << 30)) + " GiB: use longer edges or " + remedy);
}

/// For a surface of so many squares of the lattice: the patches and the mesh.
double bytes_of(double squares) {
  // A flat face along the lattice has one vertex and two triangles per square; a slanted or rough
  // one up to 1.7 times as many, 1.25 for a mine (measured).
  const double vertices = 1.25 * squares;
  const double mesh = vertices * (sizeof(Eigen::Vector3f) + 2 * (3 * sizeof(std::uint32_t) + 1));
  // A block holds about a block's face of surface. Its rims: four sides of that square, two of them
  // with vertices of others.
  const double blocks = squares / (block_size * block_size);
  const double rims = 1.25 * 2 * block_size * (sizeof(Patch::Foreign) + sizeof(Patch::Rim));
  return 2 * mesh + blocks * (sizeof(Patch) + sizeof(Cell) + rims);
}

}  // namespace

double contour_bytes(const ImplicitSurface& surface, double edge_length) {
  return bytes_of(surface.area / (edge_length * edge_length));
}

TriangleMesh contour(const ImplicitSurface& surface, double edge_length) {
  check_edge_length(edge_length);
  check_memory(contour_bytes(surface, edge_length), edge_length, "a smaller mine");
  const std::vector<Cell> blocks =
      active_blocks(surface, edge_length, blocks_of(surface.bounds, edge_length));
  const std::vector<Patch> patches = patches_of(surface, edge_length, blocks);
  std::vector<const Patch*> pointers;
  for (const Patch& patch : patches) pointers.push_back(&patch);
  TriangleMesh mesh = joined(pointers, blocks);
  mesh.materials = surface.materials;
  return mesh;
}

struct SurfaceTiles::Impl {
  struct Kept {
    std::vector<Cell> blocks = {};
    std::vector<Patch> patches = {};
    double bytes = 0;
    std::uint64_t last_call = 0;
  };

  ImplicitSurface surface = {};
  double edge = 1;
  double limit = 0;
  std::int64_t side = 1;  // of a tile, blocks
  std::map<Tile, Kept> kept = {};
  std::uint64_t calls = 0;
  std::size_t made = 0;
  double bytes = 0;

  double tile_size() const { return edge * static_cast<double>(side * block_size); }

  BlockBox blocks_of_tile(const Tile& tile) const {
    BlockBox box = blocks_of(surface.bounds, edge);
    const Eigen::Matrix<std::int64_t, 2, 1> low(tile.x * side, tile.y * side);
    for (int axis = 0; axis < 2; ++axis) {
      box.low[axis] = std::max(box.low[axis], low[axis]);
      box.high[axis] = std::min(box.high[axis], low[axis] + side);
    }
    return box;
  }

  /// Contours those of `tiles` that are not kept.
  void make(const std::vector<Tile>& tiles) {
    std::map<Tile, Kept> added;
    std::vector<Cell> blocks;
    for (const Tile& tile : tiles) {
      if (kept.contains(tile)) continue;
      Kept& entry = added[tile];
      const BlockBox box = blocks_of_tile(tile);
      if ((box.low.array() < box.high.array()).all())
        entry.blocks = active_blocks(surface, edge, box);
      blocks.insert(blocks.end(), entry.blocks.begin(), entry.blocks.end());
    }
    const double squares = static_cast<double>(blocks.size()) * block_size * block_size;
    check_memory(bytes_of(squares), edge, "fewer tiles");
    std::vector<Patch> patches = patches_of(surface, edge, blocks);
    auto next = patches.begin();
    for (auto& [tile, entry] : added) {
      const auto end = next + static_cast<std::ptrdiff_t>(entry.blocks.size());
      entry.patches.assign(std::make_move_iterator(next), std::make_move_iterator(end));
      next = end;
      entry.bytes = static_cast<double>(sizeof(Kept) + entry.blocks.size() * sizeof(Cell));
      for (const Patch& patch : entry.patches) entry.bytes += patch.bytes();
      bytes += entry.bytes;
      ++made;
    }
    kept.merge(added);
  }

  /// Drops what was not asked for longest; of one call, the first in order.
  void shrink() {
    while (bytes > limit && !kept.empty()) {
      const auto oldest = std::min_element(
          kept.begin(), kept.end(),
          [](const auto& a, const auto& b) { return a.second.last_call < b.second.last_call; });
      bytes -= oldest->second.bytes;
      kept.erase(oldest);
    }
    if (kept.empty()) bytes = 0;
  }
};

SurfaceTiles::SurfaceTiles(ImplicitSurface surface, double edge_length, double cache_bytes)
    : impl_(std::make_shared<Impl>()) {
  check_edge_length(edge_length);
  if (!(cache_bytes >= 0))
    throw std::invalid_argument("tiles: expected a cache of 0 bytes or more, found " +
                                number_text(cache_bytes));
  impl_->surface = std::move(surface);
  impl_->edge = edge_length;
  impl_->limit = cache_bytes;
  impl_->side =
      std::max<std::int64_t>(1, std::llround(std::min(1e9, tile_side / block_size / edge_length)));
}

double SurfaceTiles::tile_size() const { return impl_->tile_size(); }

Tile SurfaceTiles::tile_of(const Eigen::Vector3d& place) const {
  // Blocks begin at lattice points, half an edge off round places.
  const auto index = [&](double x) {
    return static_cast<std::int64_t>(std::floor((x - impl_->edge / 2) / impl_->tile_size()));
  };
  return {index(place.x()), index(place.y())};
}

Eigen::AlignedBox3d SurfaceTiles::box_of(const Tile& tile) const {
  const std::int64_t cells = impl_->side * block_size;
  Eigen::AlignedBox3d box(
      lattice_point({tile.x * cells, tile.y * cells, 0}, impl_->edge),
      lattice_point({(tile.x + 1) * cells, (tile.y + 1) * cells, 0}, impl_->edge));
  box.min().z() = impl_->surface.bounds.min().z();
  box.max().z() = impl_->surface.bounds.max().z();
  return box;
}

std::vector<Tile> SurfaceTiles::within(const Tile& tile, double range) const {
  if (!(range >= 0 && std::isfinite(range)))
    throw std::invalid_argument("tiles: expected a range >= 0 (m), found " + number_text(range));
  const Tile low = tile_of(impl_->surface.bounds.min());
  const Tile high = tile_of(impl_->surface.bounds.max());
  const auto reach = static_cast<std::int64_t>(std::min(1e9, std::ceil(range / tile_size()))) + 1;
  std::vector<Tile> tiles;
  for (std::int64_t x = std::max(low.x, tile.x - reach); x <= std::min(high.x, tile.x + reach); ++x)
    for (std::int64_t y = std::max(low.y, tile.y - reach); y <= std::min(high.y, tile.y + reach);
         ++y) {
      // Between the squares.
      const double dx = static_cast<double>(std::max<std::int64_t>(0, std::abs(x - tile.x) - 1));
      const double dy = static_cast<double>(std::max<std::int64_t>(0, std::abs(y - tile.y) - 1));
      if (std::hypot(dx, dy) * tile_size() <= range) tiles.push_back({x, y});
    }
  return tiles;
}

TriangleMesh SurfaceTiles::mesh(std::span<const Tile> tiles) {
  std::vector<Tile> sorted(tiles.begin(), tiles.end());
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  impl_->make(sorted);
  ++impl_->calls;

  std::vector<std::pair<Cell, const Patch*>> parts;
  for (const Tile& tile : sorted) {
    Impl::Kept& entry = impl_->kept.at(tile);
    entry.last_call = impl_->calls;
    for (std::size_t i = 0; i < entry.blocks.size(); ++i)
      parts.emplace_back(entry.blocks[i], &entry.patches[i]);
  }
  std::sort(parts.begin(), parts.end(),
            [](const auto& a, const auto& b) { return in_order(a.first, b.first); });
  std::vector<Cell> blocks;
  std::vector<const Patch*> patches;
  for (const auto& [block, patch] : parts) {
    blocks.push_back(block);
    patches.push_back(patch);
  }
  TriangleMesh mesh = joined(patches, blocks);
  mesh.materials = impl_->surface.materials;
  impl_->shrink();
  return mesh;
}

std::size_t SurfaceTiles::tiles_made() const { return impl_->made; }

double SurfaceTiles::bytes_kept() const { return impl_->bytes; }

}  // namespace minescan
