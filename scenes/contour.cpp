// SPDX-License-Identifier: MIT
#include "scenes/contour.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/parallel.h"
#include "core/text.h"

namespace minescan {
namespace {

// Cells along the side of a block. Points on faces are evaluated by both blocks there, so smaller
// ones cost more time (8 and 16 measured).
constexpr int block_size = 32;
constexpr int block_points = block_size + 1;
// Cells along the side of the smallest cube whose range is asked for; a power of two. 1 and 4 are
// slower.
constexpr int leaf_size = 2;

// Vertices keep this part of an edge away from its ends, so that no triangle is degenerate. It
// moves them by at most 0.5 mm for an edge of 5 cm.
constexpr double end_margin = 0.01;

constexpr std::uint32_t foreign_bit = 1U << 31;
constexpr std::uint32_t no_vertex = ~0U;

using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

/// Lattice points lie at (i + 1/2) edge_length for all integers i: fixed in the world, and off the
/// round coordinates of flat faces.
struct Lattice {
  double edge = 1;
  Cell first = Cell::Zero();   // lattice point at the low corner of the first block
  Cell blocks = Cell::Zero();  // number of blocks along each axis

  Lattice(const Eigen::AlignedBox3d& bounds, double edge_length) : edge(edge_length) {
    for (int axis = 0; axis < 3; ++axis) {
      // One cell more to each side, so that the surface does not touch the border.
      first[axis] = static_cast<std::int64_t>(std::floor(bounds.min()[axis] / edge)) - 2;
      const auto last = static_cast<std::int64_t>(std::ceil(bounds.max()[axis] / edge)) + 1;
      blocks[axis] = (last - first[axis] + block_size - 1) / block_size;
    }
  }
  std::size_t block_count() const { return static_cast<std::size_t>(blocks.prod()); }
  Cell block_at(std::size_t index) const {
    const auto i = static_cast<std::int64_t>(index);
    return {i % blocks.x(), i / blocks.x() % blocks.y(), i / blocks.x() / blocks.y()};
  }
  std::size_t index_of(const Cell& block) const {
    return static_cast<std::size_t>((block.z() * blocks.y() + block.y()) * blocks.x() + block.x());
  }
  Eigen::Vector3d point(const Cell& p) const {
    return edge * (p.cast<double>() + Eigen::Vector3d::Constant(0.5));
  }
};

/// The part of the mesh within one block. A triangle's corner is an index into `vertices`, or with
/// foreign_bit an index into `foreign`: edges on the upper faces belong to the next block.
struct Patch {
  struct Foreign {
    Cell block;
    std::uint32_t edge = 0;  // code within that block
  };
  struct Rim {
    std::uint32_t edge = 0;
    std::uint32_t vertex = 0;
  };
  std::vector<Eigen::Vector3f> vertices = {};
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
  std::vector<std::uint8_t> material = {};
  std::vector<Foreign> foreign = {};
  std::vector<Rim> rim = {};  // own vertices on the lower faces, by edge code: others ask for them
};

std::uint32_t edge_code(const Cell& point, int axis) {
  return static_cast<std::uint32_t>(
      ((point.z() * block_points + point.y()) * block_points + point.x()) * 3 + axis);
}

class BlockMarcher {
 public:
  BlockMarcher(const ImplicitSurface& surface, const Lattice& lattice, const Cell& block)
      : surface_(surface),
        lattice_(lattice),
        block_(block),
        origin_(lattice.first + block * block_size) {
    constexpr std::size_t points = block_points * block_points * block_points;
    samples_.resize(points);
    sampled_.resize(points, false);
    vertex_of_edge_.resize(3 * points, no_vertex);
  }

  Patch march() {
    refine(Cell::Zero(), block_size);
    std::sort(patch_.rim.begin(), patch_.rim.end(),
              [](const Patch::Rim& a, const Patch::Rim& b) { return a.edge < b.edge; });
    return std::move(patch_);
  }

 private:
  /// Halves cubes until they cannot hold surface or are leaves.
  void refine(const Cell& low, int size) {
    const Eigen::Vector3d corner = lattice_.point(origin_ + low);
    const double half = lattice_.edge * size / 2;
    const Interval range =
        surface_.range(corner + Eigen::Vector3d::Constant(half), half * std::sqrt(3.0));
    if (range.low > 0 || range.high < 0) return;
    const int step = size > leaf_size ? size / 2 : 1;
    for (int z = 0; z < size; z += step)
      for (int y = 0; y < size; y += step)
        for (int x = 0; x < size; x += step) {
          const Cell child = low + Cell(x, y, z);
          if (size > leaf_size) {
            refine(child, step);
          } else {
            march_cell(child);
          }
        }
  }

  const ImplicitSurface::Sample& sample(const Cell& p) {
    const auto i = static_cast<std::size_t>((p.z() * block_points + p.y()) * block_points + p.x());
    if (!sampled_[i]) samples_[i] = surface_.at(lattice_.point(origin_ + p));
    sampled_[i] = true;
    return samples_[i];
  }

  static Cell corner_of(const Cell& cell, int corner) {
    return cell + Cell(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
  }

  void march_cell(const Cell& cell) {
    int open_corners = 0;
    for (int corner = 0; corner < cube_corners; ++corner)
      if (sample(corner_of(cell, corner)).value < 0) open_corners |= 1 << corner;
    for (const auto& triangle : marching_cases()[open_corners]) {
      std::array<std::uint32_t, 3> corners = {};
      std::array<std::uint8_t, 3> materials = {};
      for (std::size_t i = 0; i < 3; ++i) {
        corners[i] = vertex(cell, triangle[i]);
        materials[i] = material(cell, triangle[i]);
      }
      patch_.triangles.push_back(corners);
      // The material of most corners.
      patch_.material.push_back(materials[1] == materials[2] ? materials[1] : materials[0]);
    }
  }

  /// That of the end nearer to the surface.
  std::uint8_t material(const Cell& cell, int edge) {
    const CubeEdge ends = cube_edge_ends()[edge];
    const ImplicitSurface::Sample& a = sample(corner_of(cell, ends.from));
    const ImplicitSurface::Sample& b = sample(corner_of(cell, ends.to));
    return std::abs(a.value) <= std::abs(b.value) ? a.material : b.material;
  }

  std::uint32_t vertex(const Cell& cell, int edge) {
    const CubeEdge ends = cube_edge_ends()[edge];
    const int axis = edge / 4;
    const Cell from = corner_of(cell, ends.from);
    std::uint32_t& known = vertex_of_edge_[edge_code(from, axis)];
    if (known != no_vertex) return known;

    const Cell up = from / block_size;  // 1 on an upper face, else 0
    if (up != Cell::Zero()) {
      known = foreign_bit | static_cast<std::uint32_t>(patch_.foreign.size());
      patch_.foreign.push_back({block_ + up, edge_code(from - up * block_size, axis)});
      return known;
    }
    const double a = sample(from).value;
    const double b = sample(corner_of(cell, ends.to)).value;
    const double t = std::clamp(a / (a - b), end_margin, 1 - end_margin);
    Eigen::Vector3d place = lattice_.point(origin_ + from);
    place[axis] += t * lattice_.edge;
    known = static_cast<std::uint32_t>(patch_.vertices.size());
    patch_.vertices.push_back(place.cast<float>());
    if (from.minCoeff() == 0) patch_.rim.push_back({edge_code(from, axis), known});
    return known;
  }

  const ImplicitSurface& surface_;
  const Lattice& lattice_;
  Cell block_;
  Cell origin_;
  std::vector<ImplicitSurface::Sample> samples_;
  std::vector<bool> sampled_;
  std::vector<std::uint32_t> vertex_of_edge_;
  Patch patch_;
};

/// Puts the patches into one mesh, in the order of their blocks.
TriangleMesh joined(std::vector<Patch>& patches, const std::vector<std::uint32_t>& patch_of_block,
                    const Lattice& lattice) {
  std::vector<std::size_t> first_vertex(patches.size() + 1, 0);
  std::vector<std::size_t> first_triangle(patches.size() + 1, 0);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    first_vertex[i + 1] = first_vertex[i] + patches[i].vertices.size();
    first_triangle[i + 1] = first_triangle[i] + patches[i].triangles.size();
  }
  TriangleMesh mesh;
  mesh.vertices.resize(first_vertex.back());
  mesh.triangles.resize(first_triangle.back());
  mesh.material.resize(first_triangle.back());

  const auto global_index = [&](const Patch::Foreign& f) {
    const std::size_t owner = patch_of_block[lattice.index_of(f.block)];
    const std::vector<Patch::Rim>& rim = patches[owner].rim;
    const auto found =
        std::lower_bound(rim.begin(), rim.end(), f.edge,
                         [](const Patch::Rim& r, std::uint32_t edge) { return r.edge < edge; });
    assert(found != rim.end() && found->edge == f.edge);
    return static_cast<std::uint32_t>(first_vertex[owner] + found->vertex);
  };
  parallel_for(patches.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Patch& patch = patches[i];
      std::vector<std::uint32_t> foreign;
      for (const Patch::Foreign& f : patch.foreign) foreign.push_back(global_index(f));
      std::copy(patch.vertices.begin(), patch.vertices.end(),
                mesh.vertices.begin() + first_vertex[i]);
      std::copy(patch.material.begin(), patch.material.end(),
                mesh.material.begin() + first_triangle[i]);
      for (std::size_t t = 0; t < patch.triangles.size(); ++t)
        for (std::size_t c = 0; c < 3; ++c) {
          const std::uint32_t corner = patch.triangles[t][c];
          mesh.triangles[first_triangle[i] + t][c] =
              (corner & foreign_bit) != 0 ? foreign[corner & ~foreign_bit]
                                          : static_cast<std::uint32_t>(first_vertex[i] + corner);
        }
    }
  });
  return mesh;
}

void check(const ImplicitSurface& surface, double edge_length) {
  if (!(edge_length > 0 && std::isfinite(edge_length)))
    throw std::invalid_argument("edge-length: expected a number > 0 (m), found " +
                                number_text(edge_length));
  const double bytes = contour_bytes(surface, edge_length);
  if (!(bytes <= contour_bytes_limit))
    throw std::invalid_argument(
        "edge-length = " + number_text(edge_length) + " m needs about " +
        number_text(std::ceil(bytes / (1 << 30))) + " GiB of memory; expected at most " +
        number_text(contour_bytes_limit / (1 << 30)) + " GiB: use longer edges or a smaller mine");
}

}  // namespace

double contour_bytes(const ImplicitSurface& surface, double edge_length) {
  // A flat face along the lattice has one vertex and two triangles per square; a slanted or rough
  // one up to 1.7 times as many, 1.25 for a mine (measured).
  const double vertices = 1.25 * surface.area / (edge_length * edge_length);
  const double mesh = vertices * (sizeof(Eigen::Vector3f) + 2 * (3 * sizeof(std::uint32_t) + 1));
  // Each block of the box has a flag and an index, the rest is empty space.
  const double blocks = surface.bounds.volume() / std::pow(block_size * edge_length, 3);
  return 2 * mesh + 8 * blocks;
}

TriangleMesh contour(const ImplicitSurface& surface, double edge_length) {
  check(surface, edge_length);
  const Lattice lattice(surface.bounds, edge_length);

  const double half = block_size * edge_length / 2;
  std::vector<std::uint8_t> active(lattice.block_count());
  parallel_for(active.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Cell low = lattice.first + lattice.block_at(i) * block_size;
      const Interval range = surface.range(lattice.point(low) + Eigen::Vector3d::Constant(half),
                                           half * std::sqrt(3.0));
      active[i] = range.low <= 0 && range.high >= 0;
    }
  });
  std::vector<std::size_t> blocks;
  std::vector<std::uint32_t> patch_of_block(active.size(), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (active[i] == 0) continue;
    patch_of_block[i] = static_cast<std::uint32_t>(blocks.size());
    blocks.push_back(i);
  }

  std::vector<Patch> patches(blocks.size());
  parallel_for(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      patches[i] = BlockMarcher(surface, lattice, lattice.block_at(blocks[i])).march();
  });
  TriangleMesh mesh = joined(patches, patch_of_block, lattice);
  mesh.materials = surface.materials;
  return mesh;
}

}  // namespace minescan
