// SPDX-License-Identifier: MIT
#include "scenes/shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "scenes/half_edge.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;

using Profile = std::vector<Eigen::Vector2d>;
using Line = std::vector<Eigen::Vector3d>;

/// Vertices are floats; those of shapes within 16 m are wrong by 5e-7 m at most. Times the areas of
/// these tests (below 40 m^2) and, for areas, their outlines, that is what the measures err by.
constexpr double rounding = 2e-5;

Frame somewhere() {
  Frame frame = Frame::Identity();
  frame.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -0.5).normalized()).matrix();
  frame.translation() = Eigen::Vector3d(3, -4, 2);
  return frame;
}

/// Of the solid: positive if normals point outwards.
double volume(const TriangleMesh& mesh) { return -measures(mesh).volume; }

double area(const TriangleMesh& mesh) { return measures(mesh).area; }

double polygon_area(double radius, int sides) {
  return sides * radius * radius * std::sin(2 * pi / sides) / 2;
}

double polygon_outline(double radius, int sides) {
  return 2 * sides * radius * std::sin(pi / sides);
}

void expect_one_closed_piece(const TriangleMesh& mesh) {
  const MeshCheck check = check_mesh(mesh);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 1U);
  EXPECT_EQ(check.euler_characteristic, 2);
  EXPECT_EQ(mesh.material.size(), mesh.triangles.size());
}

double length(const Line& line) {
  double sum = 0;
  for (std::size_t i = 1; i < line.size(); ++i) sum += (line[i] - line[i - 1]).norm();
  return sum;
}

TEST(AddBox, HasTheVolumeAndAreaOfItsSize) {
  TriangleMesh mesh;
  add_box(mesh, somewhere(), {1.5, 0.3, 2}, 3);
  expect_one_closed_piece(mesh);
  EXPECT_NEAR(volume(mesh), 1.5 * 0.3 * 2, rounding);
  EXPECT_NEAR(area(mesh), 2 * (1.5 * 0.3 + 1.5 * 2 + 0.3 * 2), rounding);
  for (const std::uint8_t material : mesh.material) EXPECT_EQ(material, 3);
}

TEST(AddBox, LiesAboutTheOriginOfItsFrame) {
  TriangleMesh mesh;
  add_box(mesh, Frame(Eigen::Translation3d(1, 2, 3)), {2, 4, 8}, 0);
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v);
  EXPECT_EQ(box.min(), Eigen::Vector3f(0, 0, -1));
  EXPECT_EQ(box.max(), Eigen::Vector3f(2, 4, 7));
}

TEST(AddRevolved, IsAPrismOrAFrustum) {
  for (const int sides : {3, 4, 7, 24}) {
    for (const double end : {0.5, 0.2, 0.9}) {
      const double start = 0.5, height = 1.25;
      TriangleMesh mesh;
      add_revolved(mesh, somewhere(), Profile{{1, start}, {1 + height, end}}, sides, 0);
      expect_one_closed_piece(mesh);
      const double a = polygon_area(start, sides), b = polygon_area(end, sides);
      EXPECT_NEAR(volume(mesh), height / 3 * (a + b + std::sqrt(a * b)), rounding);
      // Trapezoids whose height is the slant one over the middle of a side.
      const double slant = std::hypot(height, (start - end) * std::cos(pi / sides));
      const double outlines = polygon_outline(start, sides) + polygon_outline(end, sides);
      EXPECT_NEAR(area(mesh), a + b + outlines / 2 * slant, rounding);
    }
  }
}

TEST(AddRevolved, MayHaveSteps) {
  TriangleMesh mesh;
  const int sides = 8;
  add_revolved(mesh, somewhere(),
               Profile{{0, 0.4}, {0, 0.5}, {0.2, 0.5}, {0.2, 0.1}, {1, 0.1}, {1, 0.05}}, sides, 0);
  expect_one_closed_piece(mesh);
  const double wide = polygon_area(0.5, sides), thin = polygon_area(0.1, sides);
  EXPECT_NEAR(volume(mesh), 0.2 * wide + 0.8 * thin, rounding);
  const double sides_area = 0.2 * polygon_outline(0.5, sides) + 0.8 * polygon_outline(0.1, sides);
  EXPECT_NEAR(area(mesh), 2 * wide + sides_area, rounding);
}

TEST(AddTube, IsAPrismIfStraight) {
  for (const int sides : {3, 6, 16}) {
    TriangleMesh mesh;
    const Line line = {{1, 2, 3}, {2, 4, 1}, {3, 6, -1}};
    add_tube(mesh, line, 0.3, sides, 0);
    expect_one_closed_piece(mesh);
    const double section = polygon_area(0.3, sides);
    EXPECT_NEAR(volume(mesh), section * length(line), rounding);
    EXPECT_NEAR(area(mesh), 2 * section + polygon_outline(0.3, sides) * length(line), rounding);
  }
}

// A prism cut askew has the volume of its section times the length between the middles of its ends,
// so mitred bends change nothing.
TEST(AddTube, HasTheVolumeOfItsSectionTimesItsLengthHoweverItBends) {
  const Line line = {{0, 0, 0}, {2, 0, 0}, {3, 1, 0.5}, {3, 3, 1}, {1, 3, 3}, {1, 1, 3}};
  for (const int sides : {3, 5, 12}) {
    TriangleMesh mesh;
    add_tube(mesh, line, 0.25, sides, 0);
    expect_one_closed_piece(mesh);
    EXPECT_NEAR(volume(mesh), polygon_area(0.25, sides) * length(line), rounding);
  }
}

TEST(AddTube, HasItsCornersOneRadiusAwayFromItsLine) {
  const Line line = {{0, 0, 0}, {2, 0, 0}, {2.5, 1, 0.5}, {3, 3, 1}};
  TriangleMesh mesh;
  add_tube(mesh, line, 0.25, 8, 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    // A mitre's corners are on both legs' surfaces.
    const std::size_t ring = v / 8;
    for (std::size_t leg = 0; leg + 1 < line.size(); ++leg) {
      if (leg != ring && leg + 1 != ring) continue;
      const Eigen::Vector3d along = (line[leg + 1] - line[leg]).normalized();
      const Eigen::Vector3d from = mesh.vertices[v].cast<double>() - line[leg];
      EXPECT_NEAR(from.cross(along).norm(), 0.25, 1e-6) << "vertex " << v;
    }
  }
}

// Around a closed walk in one plane a section that does not turn comes back as it was; its corners
// keep their distance from the plane.
TEST(AddTube, DoesNotTurnAboutItsLine) {
  Line line;
  for (int i = 0; i <= 40; ++i) {
    const double angle = 2 * pi * i / 41;
    line.emplace_back(5 * std::cos(angle), 5 * std::sin(angle), 0);
  }
  TriangleMesh mesh;
  add_tube(mesh, line, 0.2, 8, 0);
  ASSERT_EQ(mesh.vertices.size(), line.size() * 8);
  for (std::size_t v = 8; v < mesh.vertices.size(); ++v)
    EXPECT_NEAR(mesh.vertices[v].z(), mesh.vertices[v % 8].z(), 1e-6);
}

TEST(Append, PutsOneMeshBehindTheOther) {
  TriangleMesh a, b;
  add_box(a, Frame::Identity(), {1, 1, 1}, 2);
  add_box(b, somewhere(), {1, 2, 1}, 5);
  append(a, b);
  const MeshCheck check = check_mesh(a);
  EXPECT_TRUE(check.valid());
  EXPECT_EQ(check.components, 2U);
  EXPECT_EQ(check.euler_characteristic, 4);
  EXPECT_NEAR(volume(a), 3, rounding);
  EXPECT_EQ(a.material.front(), 2);
  EXPECT_EQ(a.material.back(), 5);
}

TEST(Shapes, RefuseWhatIsNone) {
  const double nan = std::nan("");
  const double inf = std::numeric_limits<double>::infinity();
  const Frame frame = Frame::Identity();
  Frame bad_frame = frame;
  bad_frame.translation().y() = nan;
  const Profile profile = {{0, 1}, {1, 1}};
  const Line line = {{0, 0, 0}, {1, 0, 0}};
  TriangleMesh mesh;

  for (const double bad : {0.0, -1.0, nan, inf}) {
    EXPECT_THROW(add_box(mesh, frame, {1, bad, 1}, 0), std::invalid_argument) << bad;
    EXPECT_THROW(add_revolved(mesh, frame, Profile{{0, 1}, {1, bad}}, 3, 0), std::invalid_argument);
    EXPECT_THROW(add_tube(mesh, line, bad, 3, 0), std::invalid_argument) << bad;
  }
  EXPECT_THROW(add_box(mesh, bad_frame, {1, 1, 1}, 0), std::invalid_argument);
  EXPECT_THROW(add_revolved(mesh, bad_frame, profile, 3, 0), std::invalid_argument);

  EXPECT_THROW(add_revolved(mesh, frame, profile, 2, 0), std::invalid_argument);
  EXPECT_THROW(add_revolved(mesh, frame, Profile{{0, 1}}, 3, 0), std::invalid_argument);
  for (const Profile& bad : {Profile{{0, 1}, {nan, 1}}, Profile{{0, 1}, {inf, 1}},
                             // falling, without length, a point twice
                             Profile{{0, 1}, {2, 1}, {1, 1}}, Profile{{0, 1}, {0, 2}},
                             Profile{{0, 1}, {1, 1}, {1, 1}, {2, 1}},
                             // faces upon each other: at the start, the end and between
                             Profile{{0, 2}, {0, 1}, {1, 1}}, Profile{{0, 1}, {1, 1}, {1, 2}},
                             Profile{{0, 1}, {1, 1}, {1, 2}, {1, 1.5}, {2, 1}}})
    EXPECT_THROW(add_revolved(mesh, frame, bad, 6, 0), std::invalid_argument);

  EXPECT_THROW(add_tube(mesh, line, 1, 2, 0), std::invalid_argument);
  for (const Line& bad :
       {Line{}, Line{{0, 0, 0}}, Line{{0, 0, 0}, {0, 0, 0}}, Line{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}},
        Line{{0, 0, 0}, {1, nan, 0}},
        // back where it came from, and a bend sharper than the legs are long
        Line{{0, 0, 0}, {9, 0, 0}, {2, 0, 0}}, Line{{0, 0, 0}, {0.4, 0, 0}, {0.4, 3, 0}}})
    EXPECT_THROW(add_tube(mesh, bad, 0.5, 6, 0), std::invalid_argument);

  EXPECT_TRUE(mesh.vertices.empty());
  EXPECT_TRUE(mesh.triangles.empty());
}

TEST(TubeFits, IfTheMitresLeaveSomethingOfEachLeg) {
  // Two right angles take a radius each of the leg between them.
  const Line line = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {4, 1, 0}};
  EXPECT_TRUE(tube_fits(line, 0.49));
  EXPECT_FALSE(tube_fits(line, 0.51));
  EXPECT_FALSE(tube_fits(line, std::nan("")));
}

}  // namespace
}  // namespace minescan
