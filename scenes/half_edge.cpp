// SPDX-License-Identifier: MIT
#include "scenes/half_edge.h"

// OpenMesh pushes vectors without values before it sets them; GCC 12 remarks on it with sanitizers.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#pragma GCC diagnostic pop

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
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

namespace decimater = OpenMesh::Decimater;

/// Vertices between triangles of several materials stay where they are.
void lock_borders(HalfEdgeMesh& half_edges, const std::vector<std::uint8_t>& material) {
  for (const HalfEdgeMesh::VertexHandle v : half_edges.vertices()) {
    std::optional<std::uint8_t> first;
    for (const HalfEdgeMesh::FaceHandle f : half_edges.vf_range(v)) {
      if (!first) first = material[f.idx()];
      if (material[f.idx()] != *first) half_edges.status(v).set_locked(true);
    }
  }
}

/// The triangles that are left, in the order of `mesh`, whose triangles the faces are.
TriangleMesh remaining(const HalfEdgeMesh& half_edges, const TriangleMesh& mesh) {
  TriangleMesh result;
  result.materials = mesh.materials;
  std::vector<std::uint32_t> new_index(half_edges.n_vertices(), 0);
  for (const HalfEdgeMesh::FaceHandle f : half_edges.faces()) {  // all but the deleted ones
    std::array<std::uint32_t, 3> triangle = {};
    std::size_t k = 0;
    for (const HalfEdgeMesh::VertexHandle v : half_edges.fv_range(f)) {
      triangle[k++] = static_cast<std::uint32_t>(v.idx());
      new_index[v.idx()] = 1;
    }
    result.triangles.push_back(triangle);
    if (!mesh.material.empty()) result.material.push_back(mesh.material[f.idx()]);
  }
  for (std::size_t v = 0; v < new_index.size(); ++v) {
    if (new_index[v] == 0) continue;
    new_index[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[v]);
  }
  for (auto& triangle : result.triangles)
    for (std::uint32_t& corner : triangle) corner = new_index[corner];
  return result;
}

}  // namespace

MeshCheck check_mesh(const TriangleMesh& mesh) {
  MeshCheck check = check_structure(mesh);
  for (const auto& triangle : mesh.triangles)
    if (!has_area(mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                  mesh.vertices[triangle[2]]))
      ++check.degenerate_triangles;
  check.self_intersections = count_self_intersections(mesh);
  return check;
}

TriangleMesh decimated(const TriangleMesh& mesh, double ratio) {
  if (!(ratio > 0 && ratio <= 1))
    throw std::invalid_argument("decimation: expected a ratio above 0 and up to 1, found " +
                                number_text(ratio));
  if (!mesh.material.empty() && mesh.material.size() != mesh.triangles.size())
    throw std::invalid_argument("decimation: expected a material for each of " +
                                std::to_string(mesh.triangles.size()) + " triangles, found " +
                                std::to_string(mesh.material.size()));
  Built structure = built(mesh);
  HalfEdgeMesh& half_edges = structure.mesh;
  const std::size_t odd_vertices = count_non_manifold_vertices(half_edges);
  if (structure.refused > 0 || odd_vertices > 0)
    throw std::invalid_argument("decimation: expected a 2-manifold, found " +
                                std::to_string(structure.refused) +
                                " triangles that do not fit their neighbours and " +
                                std::to_string(odd_vertices) + " vertices where surfaces touch");
  if (ratio == 1) return mesh;

  // What is deleted must be known after the decimater is gone.
  half_edges.request_vertex_status();
  half_edges.request_edge_status();
  half_edges.request_face_status();
  if (!mesh.material.empty()) lock_borders(half_edges, mesh.material);
  {
    decimater::DecimaterT<HalfEdgeMesh> decimation(half_edges);
    decimater::ModQuadricT<HalfEdgeMesh>::Handle quadrics;
    decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle no_flips;
    decimation.add(quadrics);
    decimation.add(no_flips);
    // At OpenMesh's 90 degrees some triangles of a rough mine end up crossing each other; at 60,
    // measured at a half and a tenth of the triangles, none.
    decimation.module(no_flips).set_max_normal_deviation(60);
    decimation.initialize();
    decimation.decimate_to_faces(
        0,
        static_cast<std::size_t>(std::llround(ratio * static_cast<double>(half_edges.n_faces()))));
  }
  return remaining(half_edges, mesh);
}

void check_mesh_name(const std::filesystem::path& path) {
  const std::string end = path.extension().string();
  if (end != ".ply" && end != ".stl" && end != ".obj")
    throw std::invalid_argument(path.string() + ": expected a name ending in .ply, .stl or .obj");
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path) {
  check_mesh_name(path);
  const std::string end = path.extension().string();
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
