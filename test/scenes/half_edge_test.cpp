// SPDX-License-Identifier: MIT
#include "scenes/half_edge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <fstream>
#include <sstream>
#include <string>

#include "test/scenes/measure.h"

namespace minescan {
namespace {

TriangleMesh tetrahedron() {
  return {.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1.1F}},
          .triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
}

/// Two tetrahedra of which the second uses the first's vertices for its first `shared` ones.
TriangleMesh two_tetrahedra(std::uint32_t shared) {
  TriangleMesh mesh = tetrahedron();
  const TriangleMesh second = tetrahedron();
  for (std::uint32_t v = shared; v < 4; ++v)
    mesh.vertices.push_back(second.vertices[v] - Eigen::Vector3f(0.2F, 2, 3));
  for (std::array<std::uint32_t, 3> t : second.triangles) {
    for (std::uint32_t& corner : t)
      if (corner >= shared) corner += 4 - shared;
    mesh.triangles.push_back(t);
  }
  return mesh;
}

std::filesystem::path scratch(const std::string& name) {
  return std::filesystem::path(::testing::TempDir()) /
         ("minescan-" + std::to_string(getpid()) + "-" + name);
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

template <class T>
T number_at(const std::string& bytes, std::size_t place) {
  T value{};
  std::memcpy(&value, bytes.data() + place, sizeof(T));
  return value;
}

TEST(CheckMesh, FindsNothingWrongWithATetrahedron) {
  const MeshCheck check = check_mesh(tetrahedron());
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.vertices, 4U);
  EXPECT_EQ(check.triangles, 4U);
  EXPECT_EQ(check.components, 1U);
  EXPECT_EQ(check.euler_characteristic, 2);
}

TEST(CheckMesh, CountsComponents) {
  const MeshCheck check = check_mesh(two_tetrahedra(0));
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 2U);
  EXPECT_EQ(check.euler_characteristic, 4);
}

TEST(CheckMesh, FindsAHole) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.pop_back();
  const MeshCheck check = check_mesh(mesh);
  EXPECT_FALSE(check.valid());
  EXPECT_EQ(check.boundary_edges, 3U);
}

TEST(CheckMesh, FindsATriangleThatFacesTheOtherWay) {
  TriangleMesh mesh = tetrahedron();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  const MeshCheck check = check_mesh(mesh);
  EXPECT_FALSE(check.valid());
  EXPECT_EQ(check.refused_triangles, 1U);
}

TEST(CheckMesh, FindsAnEdgeWithManyTriangles) {
  const MeshCheck check = check_mesh(two_tetrahedra(2));
  EXPECT_FALSE(check.valid());
  EXPECT_GT(check.refused_triangles, 0U);
}

TEST(CheckMesh, FindsSurfacesThatTouchInAPoint) {
  TriangleMesh mesh = two_tetrahedra(1);
  EXPECT_FALSE(check_mesh(mesh).valid());
  // However the triangles are ordered.
  std::swap(mesh.triangles[1], mesh.triangles[4]);
  std::swap(mesh.triangles[3], mesh.triangles[6]);
  EXPECT_FALSE(check_mesh(mesh).valid());
}

TEST(CheckMesh, FindsTrianglesWithoutAreaAndVerticesWithoutTriangles) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.push_back({9, 9, 9});
  EXPECT_EQ(check_mesh(mesh).unused_vertices, 1U);
  EXPECT_FALSE(check_mesh(mesh).valid());

  mesh = tetrahedron();
  mesh.vertices[3] = mesh.vertices[0];
  EXPECT_EQ(check_mesh(mesh).degenerate_triangles, 2U);

  mesh = tetrahedron();
  mesh.triangles.push_back({1, 1, 2});
  EXPECT_EQ(check_mesh(mesh).refused_triangles, 1U);
  EXPECT_EQ(check_mesh(mesh).degenerate_triangles, 1U);
}

TEST(CheckMesh, FindsSurfacesThatCross) {
  TriangleMesh mesh = two_tetrahedra(0);
  EXPECT_EQ(check_mesh(mesh).self_intersections, 0U);
  // The second one's tip through the first one's floor: three of its sides.
  mesh.vertices[7] = {0.2F, 0.2F, 0.1F};
  const MeshCheck check = check_mesh(mesh);
  EXPECT_EQ(check.self_intersections, 3U);
  EXPECT_TRUE(check.closed());
  EXPECT_FALSE(check.valid());
}

TEST(CheckMesh, FindsAnEmptyMeshInvalid) { EXPECT_FALSE(check_mesh({}).valid()); }

TEST(CheckMesh, RefusesATriangleOfVerticesThatAreNotThere) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles[2][1] = 4;
  EXPECT_THROW(check_mesh(mesh), std::invalid_argument);
}

// The expected bytes are those of the formats' descriptions, not of OpenMesh.
TEST(WriteMesh, WritesBinaryPly) {
  const auto path = scratch("a.ply");
  write_mesh(tetrahedron(), path);
  const std::string bytes = content(path);
  const std::string end = "end_header\n";
  const std::size_t header = bytes.find(end) + end.size();
  const std::string text = bytes.substr(0, header);
  EXPECT_EQ(text.substr(0, 4), "ply\n");
  EXPECT_NE(text.find("format binary_little_endian 1.0\n"), std::string::npos);
  EXPECT_NE(text.find("element vertex 4\n"), std::string::npos);
  EXPECT_NE(text.find("element face 4\n"), std::string::npos);
  ASSERT_EQ(bytes.size(), header + 4 * 12 + 4 * 13);
  EXPECT_EQ(number_at<float>(bytes, header + 3 * 12 + 8), 1.1F);
  const std::size_t face = header + 4 * 12 + 13;
  EXPECT_EQ(number_at<std::uint8_t>(bytes, face), 3);
  // {0, 3, 1}, perhaps begun at another corner.
  std::array<std::uint32_t, 3> corners_read = {};
  for (std::size_t i = 0; i < 3; ++i)
    corners_read[i] = number_at<std::uint32_t>(bytes, face + 1 + 4 * i);
  std::rotate(corners_read.begin(), std::min_element(corners_read.begin(), corners_read.end()),
              corners_read.end());
  EXPECT_EQ(corners_read, (std::array<std::uint32_t, 3>{0, 3, 1}));
  std::filesystem::remove(path);
}

TEST(WriteMesh, WritesBinaryStl) {
  const auto path = scratch("a.stl");
  write_mesh(tetrahedron(), path);
  const std::string bytes = content(path);
  ASSERT_EQ(bytes.size(), 84U + 4 * 50);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 80), 4U);
  std::filesystem::remove(path);
}

TEST(WriteMesh, WritesObjThatReadsBackExactly) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices[1] = {1.0F / 3, -12.3456789F, 1e-7F};
  const auto path = scratch("a.obj");
  write_mesh(mesh, path);
  TriangleMesh read;
  std::istringstream lines(content(path));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Eigen::Vector3f v;
      words >> v.x() >> v.y() >> v.z();
      read.vertices.push_back(v);
    } else if (kind == "f") {
      std::array<std::uint32_t, 3> t = {};
      words >> t[0] >> t[1] >> t[2];
      for (std::uint32_t& corner : t) --corner;
      read.triangles.push_back(t);
    }
  }
  EXPECT_TRUE(same_bytes(read.vertices, mesh.vertices));
  ASSERT_EQ(read.triangles.size(), mesh.triangles.size());
  EXPECT_NEAR(measures(read).volume, measures(mesh).volume, 1e-12);
  std::filesystem::remove(path);
}

TEST(WriteMesh, RefusesUnknownEndsAndNamesTheKnownOnes) {
  for (const std::string name : {"a.vtk", "a", "a.PLY2", "a.ply.gz"}) {
    const auto path = scratch(name);
    try {
      write_mesh(tetrahedron(), path);
      FAIL() << name;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(".ply, .stl or .obj"), std::string::npos) << e.what();
    }
    EXPECT_FALSE(std::filesystem::exists(path));
  }
}

TEST(WriteMesh, LeavesNothingBehindWhenItFails) {
  const auto path = scratch("b.ply");
  EXPECT_THROW(write_mesh(two_tetrahedra(2), path), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(write_mesh(tetrahedron(), scratch("no-such-folder") / "a.ply"), std::runtime_error);
}

}  // namespace
}  // namespace minescan
