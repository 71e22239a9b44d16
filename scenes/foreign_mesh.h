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

/// Reads .ply, .stl (both text and binary) or .obj, whatever the case of the ending.
///
/// Polygons are cut into triangles from their first corner. The groups of .obj files, in the order
/// in which they get their first face, are named by the last `usemtl` before it, else by the last
/// `g` or `o`; no other file is looked at. Vertices of .stl files with equal coordinates become
/// one, the first; its triangles with two corners in one place are left out.
///
/// throws  std::invalid_argument for another ending, std::runtime_error naming the file for one
///         that cannot be read, ends early, is not what its ending says, holds no triangles, an
///         index that leads nowhere or a coordinate that is not a finite float
/// cost    about twice the file's size in memory beside the result; what a file claims to hold is
///         not believed. Calls from several threads wait for each other
ForeignMesh read_foreign_mesh(const std::filesystem::path& path);

}  // namespace minescan
