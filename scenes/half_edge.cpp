// SPDX-License-Identifier: MIT
#include "scenes/half_edge.h"

// OpenMesh pushes vectors without values before it sets them; GCC 12 remarks on it with sanitizers.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#pragma GCC diagnostic pop

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/output_file.h"
#include "core/text.h"
#include "scenes/self_intersection.h"

namespace minescan {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;

/// OpenMesh reports on standard error what it also returns.
void silence_openmesh() {
  static const bool done = [] {
    omlog().disable();
    omout().disable();
    omerr().disable();
    return true;
  }();
  static_cast<void>(done);
}

struct Built {
  HalfEdgeMesh mesh = {};
  std::size_t refused = 0;
};

Built built(const TriangleMesh& mesh) {
  silence_openmesh();
  Built result;
  result.mesh.reserve(mesh.vertices.size(), 3 * mesh.triangles.size() / 2, mesh.triangles.size());
  std::vector<OpenMesh::VertexHandle> handles;
  handles.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& v : mesh.vertices)
    handles.push_back(result.mesh.add_vertex({v.x(), v.y(), v.z()}));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    for (const std::uint32_t corner : {a, b, c})
      if (corner >= handles.size())
        throw std::invalid_argument("triangle " + std::to_string(t) + ": expected vertices below " +
                                    std::to_string(handles.size()) + ", found " +
                                    std::to_string(corner));
    const bool corners_differ = a != b && b != c && c != a;
    if (!corners_differ || !result.mesh.add_face(handles[a], handles[b], handles[c]).is_valid())
      ++result.refused;
  }
  return result;
}

/// Pieces that share no vertex; vertices without triangles are no pieces.
std::size_t count_components(const HalfEdgeMesh& mesh) {
  std::vector<bool> seen(mesh.n_vertices(), false);
  std::vector<OpenMesh::VertexHandle> open;
  std::size_t components = 0;
  for (const OpenMesh::VertexHandle start : mesh.vertices()) {
    if (seen[start.idx()] || mesh.is_isolated(start)) continue;
    ++components;
    seen[start.idx()] = true;
    open.push_back(start);
    while (!open.empty()) {
      const OpenMesh::VertexHandle v = open.back();
      open.pop_back();
      for (const OpenMesh::VertexHandle neighbour : mesh.vv_range(v)) {
        if (seen[neighbour.idx()]) continue;
        seen[neighbour.idx()] = true;
        open.push_back(neighbour);
      }
    }
  }
  return components;
}

/// Vertices where going round meets only some of the triangles: where surfaces touch, it meets
/// those of one.
std::size_t count_non_manifold_vertices(const HalfEdgeMesh& mesh) {
  std::vector<std::uint32_t> triangles_at(mesh.n_vertices(), 0);
  for (const OpenMesh::FaceHandle f : mesh.faces())
    for (const OpenMesh::VertexHandle v : mesh.fv_range(f)) ++triangles_at[v.idx()];
  std::size_t count = 0;
  for (const OpenMesh::VertexHandle v : mesh.vertices()) {
    if (mesh.is_isolated(v)) continue;
    std::uint32_t met = 0;
    for (const OpenMesh::FaceHandle f : mesh.vf_range(v)) met += f.is_valid() ? 1 : 0;
    if (met != triangles_at[v.idx()] || !mesh.is_manifold(v)) ++count;
  }
  return count;
}

/// What the half-edges tell; they are gone before the rest needs memory.
MeshCheck check_structure(const TriangleMesh& mesh) {
  const Built structure = built(mesh);
  const HalfEdgeMesh& half_edges = structure.mesh;
  MeshCheck check;
  check.vertices = half_edges.n_vertices();
  check.triangles = half_edges.n_faces();
  check.components = count_components(half_edges);
  check.euler_characteristic = static_cast<std::ptrdiff_t>(check.vertices + check.triangles) -
                               static_cast<std::ptrdiff_t>(half_edges.n_edges());
  check.refused_triangles = structure.refused;
  for (const OpenMesh::EdgeHandle e : half_edges.edges())
    if (half_edges.is_boundary(e)) ++check.boundary_edges;
  check.non_manifold_vertices = count_non_manifold_vertices(half_edges);
  for (const OpenMesh::VertexHandle v : half_edges.vertices())
    if (half_edges.is_isolated(v)) ++check.unused_vertices;
  return check;
}

}  // namespace

MeshCheck check_mesh(const TriangleMesh& mesh) {
  MeshCheck check = check_structure(mesh);
  for (const auto& triangle : mesh.triangles)
    if (!has_area(mesh, triangle)) ++check.degenerate_triangles;
  check.self_intersections = count_self_intersections(mesh);
  return check;
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path) {
  const std::string end = path.extension().string();
  if (end != ".ply" && end != ".stl" && end != ".obj")
    throw std::invalid_argument(path.string() + ": expected a name ending in .ply, .stl or .obj");
  const Built structure = built(mesh);
  if (structure.refused > 0)
    throw std::invalid_argument(path.string() + ": expected a 2-manifold, found " +
                                std::to_string(structure.refused) +
                                " triangles that do not fit their neighbours");
  OutputFile file(path);
  OpenMesh::IO::Options options = OpenMesh::IO::Options::Default;
  if (end != ".obj") options += OpenMesh::IO::Options::Binary;
  // Enough digits to read back the same floats.
  constexpr std::streamsize digits = std::numeric_limits<float>::max_digits10;
  if (!OpenMesh::IO::write_mesh(structure.mesh, file.stream(), end, options, digits))
    throw std::runtime_error(path.string() + ": cannot be written");
  file.commit();
}

}  // namespace minescan
