// SPDX-License-Identifier: MIT
// Meshes that others made: any .ply, .stl or .obj file is a scene to scan.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/cloud.h"

namespace minescan {

/// Triangles of a file as they stand there, holes, crossings and all (OpenMesh drops what is not a
/// 2-manifold; here nothing is dropped).
struct ForeignMesh {
  std::vector<Eigen::Vector3f> vertices = {};
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
  std::vector<std::string> groups = {};   // names; at least one, "" where the file has none
  std::vector<std::uint32_t> group = {};  // of each triangle
};

/// Reads .ply, .stl (both text and binary) or .obj, of whose lines `usemtl` (else `g` or `o`) name
/// the groups. Vertices of .stl files with equal coordinates become one. Polygons are cut into
/// triangles.
///
/// throws  std::invalid_argument for another ending, std::runtime_error naming the file for one
///         that cannot be read, is truncated, holds no triangles, an index that leads nowhere or a
///         coordinate that is not finite
ForeignMesh read_foreign_mesh(const std::filesystem::path& path);

}  // namespace minescan
