// SPDX-License-Identifier: MIT
#include "scenes/half_edge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
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

/// A box of `size` whose sides are grids of n by n squares of two triangles. Seen from outside
/// the triangles run counter-clockwise. Its top is of material 1.
TriangleMesh fine_box(const Eigen::Vector3f& size, std::uint32_t n) {
  TriangleMesh mesh{.materials = {{.name = "rock"}, {.name = "top"}}};
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<std::uint32_t, 3>& at) {
    const auto [place, is_new] =
        known.try_emplace(at, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      mesh.vertices.emplace_back();
      for (int i = 0; i < 3; ++i)
        mesh.vertices.back()[i] = size[i] * static_cast<float>(at[i]) / static_cast<float>(n);
    }
    return place->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const bool high : {false, true})
      for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
          const auto corner = [&](std::uint32_t u, std::uint32_t v) {
            std::array<std::uint32_t, 3> at = {};
            at[axis] = high ? n : 0;
            at[(axis + (high ? 1 : 2)) % 3] = i + u;
            at[(axis + (high ? 2 : 1)) % 3] = j + v;
            return vertex(at);
          };
          mesh.triangles.push_back({corner(0, 0), corner(1, 0), corner(1, 1)});
          mesh.triangles.push_back({corner(0, 0), corner(1, 1), corner(0, 1)});
          mesh.material.insert(mesh.material.end(), 2, axis == 2 && high ? 1 : 0);
        }
  return mesh;
}

/// The area of each of two materials.
std::array<double, 2> areas(const TriangleMesh& mesh) {
  std::array<double, 2> sums = {};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sums.at(mesh.material[t]) += measures({.vertices = mesh.vertices,
                                           .triangles = {mesh.triangles[t]},
                                           .material = {},
                                           .materials = {}})
                                     .area;
  return sums;
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

TEST(Decimated, LeavesFlatFacesAndMaterialsAsTheyAre) {
  // 4800 triangles; the border of the top keeps its 80 vertices and so 78 triangles within and 80
  // around.
  const TriangleMesh mesh = fine_box({4, 3, 2}, 20);
  const TriangleMesh coarse = decimated(mesh, 0.1);
  EXPECT_NEAR(static_cast<double>(coarse.triangles.size()), 480, 1);
  const MeshCheck check = check_mesh(coarse);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.euler_characteristic, 2);
  // Coordinates are vertices' of before, whose products are rounded to double precision.
  EXPECT_NEAR(measures(coarse).volume, -24, 1e-12);
  EXPECT_NEAR(areas(coarse)[0], 52 - 12, 1e-12);
  EXPECT_NEAR(areas(coarse)[1], 12, 1e-12);
  ASSERT_EQ(coarse.materials.size(), 2U);
  EXPECT_EQ(coarse.materials[1].name, "top");
}

TEST(Decimated, KeepsTheBorderBetweenMaterials) {
  // Materials that change within the flat faces, in the middle.
  TriangleMesh mesh = fine_box({4, 3, 2}, 20);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = corners(mesh, mesh.triangles[t]);
    mesh.material[t] = a.x() + b.x() + c.x() > 3 * 2 ? 1 : 0;
  }
  const TriangleMesh coarse = decimated(mesh, 0.1);
  EXPECT_TRUE(check_mesh(coarse).valid());
  EXPECT_NEAR(areas(coarse)[0], 26, 1e-12);
  EXPECT_NEAR(areas(coarse)[1], 26, 1e-12);
}

// Far from the origin and askew, quadrics of flat faces are rounded to less than zero.
TEST(Decimated, ReachesItsAimWhereFacesLieAskew) {
  TriangleMesh mesh = fine_box({4, 3, 2}, 20);
  mesh.material.clear();
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(0.7F, Eigen::Vector3f(1, 2, 3).normalized()).toRotationMatrix();
  for (Eigen::Vector3f& v : mesh.vertices) v = turn * v + Eigen::Vector3f(200, -300, 50);
  const TriangleMesh coarse = decimated(mesh, 12.0 / 4800);
  EXPECT_NEAR(static_cast<double>(coarse.triangles.size()), 12, 1);
  EXPECT_TRUE(coarse.material.empty());
  EXPECT_TRUE(check_mesh(coarse).valid());
  // Vertices are rounded to 1.5e-5 m, half of that at most, on 52 m^2 of faces.
  EXPECT_NEAR(measures(coarse).volume, -24, 52 * 1.5e-5);
}

TEST(Decimated, StaysNearASphere) {
  TriangleMesh mesh = fine_box({2, 2, 2}, 20);
  for (Eigen::Vector3f& v : mesh.vertices) v = (v - Eigen::Vector3f(1, 1, 1)).normalized() * 3;
  std::fill(mesh.material.begin(), mesh.material.end(), 0);
  const double volume = measures(mesh).volume;
  double least_change = 0;
  for (const double ratio : {0.5, 0.1, 0.02}) {
    const TriangleMesh coarse = decimated(mesh, ratio);
    const double n = static_cast<double>(coarse.triangles.size());
    EXPECT_NEAR(n, ratio * 4800, 1);
    EXPECT_TRUE(check_mesh(coarse).valid());
    // n equal triangles with their corners on a sphere miss 9/8 r^2 of its volume, where
    // r^2 = 16 pi / (3 sqrt(3) n) is that of their circumcircle. These are not equal: three times.
    const double change = 1 - measures(coarse).volume / volume;
    EXPECT_GT(change, least_change);
    EXPECT_LT(change, 3 * 9 / 8.0 * 16 * 3.14159 / (3 * std::sqrt(3) * n)) << ratio;
    least_change = change;
  }
}

TEST(Decimated, ToAllOfItIsTheSameMeshAndTwiceTheSameBytes) {
  const TriangleMesh mesh = fine_box({4, 3, 2}, 10);
  EXPECT_TRUE(same_bytes(decimated(mesh, 1), mesh));
  EXPECT_TRUE(same_bytes(decimated(mesh, 0.3), decimated(mesh, 0.3)));
}

TEST(Decimated, TakesAMeshWithAHole) {
  TriangleMesh mesh = fine_box({4, 3, 2}, 10);
  mesh.triangles.pop_back();
  mesh.material.pop_back();
  const TriangleMesh coarse = decimated(mesh, 0.5);
  EXPECT_LT(coarse.triangles.size(), 610U);
  EXPECT_EQ(check_mesh(coarse).refused_triangles, 0U);
  EXPECT_EQ(check_mesh(coarse).boundary_edges, 3U);
}

TEST(Decimated, RefusesWhatMakesNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double ratio : {0.0, -0.5, 1.01, nan})
    EXPECT_THROW(decimated(tetrahedron(), ratio), std::invalid_argument) << ratio;
  for (const double ratio : {0.5, 1.0}) {
    EXPECT_THROW(decimated(two_tetrahedra(1), ratio), std::invalid_argument);
    EXPECT_THROW(decimated(two_tetrahedra(2), ratio), std::invalid_argument);
    // Open surfaces that touch in a point.
    TriangleMesh mesh = two_tetrahedra(1);
    mesh.triangles = {mesh.triangles[0], mesh.triangles[4]};
    EXPECT_THROW(decimated(mesh, ratio), std::invalid_argument);
    mesh = tetrahedron();
    mesh.material = {0, 0};
    EXPECT_THROW(decimated(mesh, ratio), std::invalid_argument);
    mesh = tetrahedron();
    mesh.triangles[0][0] = 4;
    EXPECT_THROW(decimated(mesh, ratio), std::invalid_argument);
  }
  EXPECT_EQ(decimated(tetrahedron(), 0.1).triangles.size(), 4U);
  EXPECT_TRUE(decimated({}, 0.5).triangles.empty());
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

TEST(WriteMesh, LooksAtTheNameBeforeAnythingElse) {
  for (const std::string name : {"a.ply", "a.stl", "b/c.obj"})
    EXPECT_NO_THROW(check_mesh_name(name));
  for (const std::string name : {"", "ply", ".ply", "a.vtk", "a.ply/b", "a.ply.gz"}) {
    EXPECT_THROW(check_mesh_name(name), std::invalid_argument) << name;
    // Neither the mesh nor the folder is right either.
    try {
      write_mesh(two_tetrahedra(2), scratch("no-such-folder") / name);
      FAIL() << name;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(".ply, .stl or .obj"), std::string::npos) << e.what();
    }
  }
}

TEST(HalfEdges, PrintNothing) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  const auto path = scratch("c.ply");
  check_mesh(two_tetrahedra(1));
  check_mesh(two_tetrahedra(2));
  decimated(fine_box({1, 1, 1}, 3), 0.5);
  EXPECT_THROW(write_mesh(two_tetrahedra(2), path), std::invalid_argument);
  write_mesh(tetrahedron(), path);
  std::filesystem::remove(path);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(WriteMesh, LeavesNothingBehindWhenItFails) {
  const auto path = scratch("b.ply");
  EXPECT_THROW(write_mesh(two_tetrahedra(2), path), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(write_mesh(tetrahedron(), scratch("no-such-folder") / "a.ply"), std::runtime_error);
}

}  // namespace
}  // namespace minescan
