// SPDX-License-Identifier: MIT
#include "sim/picture.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/parallel.h"
#include "test/sim/shapes.h"

namespace minescan {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Adds the box between two corners; `open` is the room inside it, else it is a thing in a room.
void add_box(TriangleMesh& mesh, const Vector3f& low, const Vector3f& high, bool open,
             std::uint8_t material) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        {(i & 1) ? high.x() : low.x(), (i & 2) ? high.y() : low.y(), (i & 4) ? high.z() : low.z()});
  // Counter-clockwise seen from outside: bottom, top, front, back, left, right.
  constexpr std::array<std::array<std::uint32_t, 4>, 6> faces = {
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& [a, b, c, d] : faces) {
    for (std::array<std::uint32_t, 3> t : {std::array{a, b, c}, std::array{a, c, d}}) {
      if (open) std::swap(t[1], t[2]);
      mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
      mesh.material.push_back(material);
    }
  }
}

TriangleMesh empty_mesh() {
  TriangleMesh mesh;
  mesh.materials = {{.name = "rock", .reflectance = 0.3}, {.name = "steel", .reflectance = 0.7}};
  return mesh;
}

// A room of 20 x 10 x 4 m, in which a box hangs 1 m below the ceiling.
TriangleMesh room_with_box() {
  TriangleMesh mesh = empty_mesh();
  add_box(mesh, {0, 0, 0}, {20, 10, 4}, true, 0);
  add_box(mesh, {5, 6, 2}, {7, 8, 3}, false, 1);
  return mesh;
}

using Pixel = std::array<int, 3>;
Pixel at(const Picture& p, int x, int y) {
  const auto i = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) +
                      static_cast<std::size_t>(x));
  return {p.rgb.at(i), p.rgb.at(i + 1), p.rgb.at(i + 2)};
}
int brightness(const Pixel& p) { return p[0] + p[1] + p[2]; }
constexpr Pixel ink = {255, 255, 255};

// Rock is darker than any lit surface of these tests, its outline darker still.
constexpr int dark = 3 * 50;

// The longest row of ink, the scale bar, in pixels.
int longest_bar(const Picture& p) {
  int longest = 0;
  for (int y = 0; y < p.height; ++y) {
    int length = 0;
    for (int x = 0; x < p.width; ++x) {
      length = at(p, x, y) == ink ? length + 1 : 0;
      longest = std::max(longest, length);
    }
  }
  return longest;
}

// Reads what is written in letters of 5 x 7 dots, 2 x 2 pixels each: lines of text from the top.
struct Letter {
  char letter = ' ';
  std::string_view dots = {};
};
// clang-format off
constexpr auto letters = std::to_array<Letter>({
    {'0', " ### " "#   #" "#  ##" "# # #" "##  #" "#   #" " ### "},
    {'1', "  #  " " ##  " "  #  " "  #  " "  #  " "  #  " " ### "},
    {'2', " ### " "#   #" "    #" "   # " "  #  " " #   " "#####"},
    {'4', "   # " "  ## " " # # " "#  # " "#####" "   # " "   # "},
    {'5', "#####" "#    " "#### " "    #" "    #" "#   #" " ### "},
    {'8', " ### " "#   #" "#   #" " ### " "#   #" "#   #" " ### "},
    {'.', "     " "     " "     " "     " "     " " ##  " " ##  "},
    {'a', "     " "     " " ### " "    #" " ####" "#   #" " ####"},
    {'m', "     " "     " "## # " "# # #" "# # #" "# # #" "# # #"},
    {'t', " #   " " #   " "###  " " #   " " #   " " #  #" "  ## "},
    {'x', "     " "     " "#   #" " # # " "  #  " " # # " "#   #"},
});
// clang-format on
std::string text_on(const Picture& p) {
  const int top = std::max(0, p.height - 60);  // that is where the text is
  std::vector<std::string> rows;
  for (int y = top; y < p.height; ++y) {
    std::string& row = rows.emplace_back();
    for (int x = 0; x < p.width; ++x) row += at(p, x, y) == ink ? '#' : ' ';
  }
  const auto is_letter = [&](std::size_t left, std::size_t y, std::string_view dots) {
    for (std::size_t i = 0; i < 140; ++i)
      if (rows[y + i / 10][left + i % 10] != dots[i / 20 * 5 + i % 10 / 2]) return false;
    return true;
  };
  std::string text;
  for (std::size_t y = 0; y + 14 <= rows.size(); ++y) {
    std::size_t expected = 0;
    for (std::size_t x = 0; x + 10 <= rows[y].size(); ++x) {
      for (const Letter& l : letters) {
        if (!is_letter(x, y, l.dots)) continue;
        if (expected > 0 && x > expected) text += x == expected + 12 ? " " : "|";
        text += l.letter;
        expected = x + 12;
      }
    }
    if (expected > 0) text += '\n';
  }
  return text;
}

// 1048 pixels without margins of 24 are 1000 for 20 m.
TEST(PlanPicture, ShowsFloorAndThingsWhereTheyAre) {
  const Picture p = plan_picture(RayCaster(room_with_box()), 1048);
  ASSERT_EQ(p.width, 1048);
  ASSERT_GE(p.height, 24 + 500);
  ASSERT_EQ(p.rgb.size(), 3u * 1048u * static_cast<unsigned>(p.height));
  // The room begins at column 24, row 24 and ends before column 1024, row 524.
  const Pixel floor = at(p, 30, 30);
  EXPECT_GT(brightness(floor), dark);
  EXPECT_EQ(at(p, 24, 24), floor);
  EXPECT_EQ(at(p, 1023, 523), floor);
  for (const auto& [x, y] : {std::pair{23, 200}, std::pair{1024, 200}, std::pair{500, 23},
                             std::pair{500, 524}, std::pair{2, 2}})
    EXPECT_LT(brightness(at(p, x, y)), dark) << x << ", " << y;
  // The box: x from 5 to 7 m are columns 274 to 373, y from 8 down to 6 m rows 124 to 223.
  const Pixel thing = at(p, 300, 150);
  EXPECT_GT(brightness(thing), brightness(floor) + 30);  // it reflects more
  for (const auto& [x, y] :
       {std::pair{274, 124}, std::pair{373, 124}, std::pair{274, 223}, std::pair{373, 223}})
    EXPECT_EQ(at(p, x, y), thing) << x << ", " << y;
  for (const auto& [x, y] :
       {std::pair{272, 124}, std::pair{375, 124}, std::pair{274, 122}, std::pair{373, 225}})
    EXPECT_EQ(at(p, x, y), floor) << x << ", " << y;
  // One pixel of shadow at its foot, so that flat faces of one material can be told apart.
  for (const auto& [x, y] :
       {std::pair{273, 124}, std::pair{374, 124}, std::pair{274, 123}, std::pair{373, 224}})
    EXPECT_NEAR(brightness(at(p, x, y)), 0.55 * brightness(floor), 2) << x << ", " << y;
}

TEST(PlanPicture, LeavesRockBetweenRoomsDarkWithADarkerOutline) {
  TriangleMesh mesh = empty_mesh();
  add_box(mesh, {0, 0, 0}, {10, 10, 4}, true, 0);
  add_box(mesh, {30, 0, 0}, {40, 5, 4}, true, 0);  // 25 pixels per metre
  const Picture p = plan_picture(RayCaster(mesh), 1048);
  EXPECT_GT(brightness(at(p, 24 + 249, 24 + 5)), dark);
  EXPECT_GT(brightness(at(p, 24 + 750, 24 + 125)), dark);
  const Pixel rock = at(p, 24 + 500, 24 + 125);
  EXPECT_LT(brightness(rock), dark);
  EXPECT_EQ(at(p, 24 + 900, 24 + 60), rock);
  for (const auto& [x, y] : {std::pair{250, 100}, std::pair{749, 200}, std::pair{850, 124}})
    EXPECT_LT(brightness(at(p, 24 + x, 24 + y)), brightness(rock)) << x << ", " << y;
}

TEST(PlanPicture, WritesScaleAndExtents) {
  const Picture p = plan_picture(RayCaster(room_with_box()), 1048);
  EXPECT_EQ(longest_bar(p), 250);  // 5 m at 50 pixels per metre
  const std::string text = text_on(p);
  EXPECT_NE(text.find("5 m|"), std::string::npos) << text;
  EXPECT_NE(text.find("20.0 x 10.0 m\n"), std::string::npos) << text;
}

TEST(PlanPicture, HasABarOfTheLabelledLengthAtEverySize) {
  for (const auto& [size, width, pixels, label] :
       {std::tuple{20.0f, 548, 125, "5 m"},    // 500 pixels for 20 m, a quarter is 5 m
        std::tuple{19.0f, 548, 53, "2 m"},     // a quarter is less than 5 m
        std::tuple{0.5f, 1048, 200, "0.1 m"},  // and 0.125 m
        std::tuple{250.0f, 1048, 200, "50 m"}}) {
    TriangleMesh mesh = empty_mesh();
    add_box(mesh, {0, 0, 0}, {size, size / 4, 1}, true, 0);
    const Picture p = plan_picture(RayCaster(mesh), width);
    EXPECT_EQ(longest_bar(p), pixels) << label;
    EXPECT_NE(text_on(p).find(label), std::string::npos) << text_on(p);
  }
}

// A room whose floor is a ridge, turned by a right angle: then the plan is turned back and must
// look the same, with the light from the same side of the picture.
TEST(PlanPicture, OfAHighPlanIsTurnedWithLightFromTheUpperLeft) {
  TriangleMesh wide = room_with_box();
  const auto n = static_cast<std::uint32_t>(wide.vertices.size());
  wide.vertices.insert(
      wide.vertices.end(),
      {{10, 1, 0.5}, {13, 1, 1.5}, {16, 1, 0.5}, {10, 4, 0.5}, {13, 4, 1.5}, {16, 4, 0.5}});
  for (const std::array<std::uint32_t, 3>& t :
       {std::array{n, n + 1, n + 3}, std::array{n + 1, n + 4, n + 3},
        std::array{n + 1, n + 2, n + 4}, std::array{n + 2, n + 5, n + 4}}) {
    wide.triangles.push_back(t);
    wide.material.push_back(0);
  }
  TriangleMesh high = wide;
  for (Vector3f& v : high.vertices) v = Vector3f(-v.y(), v.x(), v.z());
  const Picture a = plan_picture(RayCaster(wide), 648);
  const Picture b = plan_picture(RayCaster(high), 648);
  // 30 pixels per metre; the ridge is at x = 13 m.
  EXPECT_GT(brightness(at(a, 24 + 360, 24 + 225)), brightness(at(a, 24 + 420, 24 + 225)) + 60);
  ASSERT_EQ(a.height, b.height);
  int different = 0;
  for (int y = 0; y < 24 + 300; ++y)
    for (int x = 0; x < a.width; ++x) different += at(a, x, y) != at(b, x, y);
  EXPECT_EQ(different, 0);
  EXPECT_NE(text_on(a).find("20.0 x 10.0 m"), std::string::npos);
  EXPECT_NE(text_on(b).find("10.0 x 20.0 m"), std::string::npos);
}

TEST(PlanPicture, TellsMaterialsApart) {
  TriangleMesh mesh = empty_mesh();
  mesh.materials = {{.name = "a"}, {.name = "b"}, {.name = "c"}, {.name = "d", .wetness = 1}};
  std::vector<Pixel> seen;
  for (std::uint8_t i = 0; i < 4; ++i)
    add_box(mesh, {5.0f * i, 0, 0}, {5.0f * i + 4, 4, 3}, true, i);  // 19 m
  const Picture p = plan_picture(RayCaster(mesh), 238);              // 10 pixels per metre
  for (int i = 0; i < 4; ++i) seen.push_back(at(p, (p.width - 190) / 2 + 50 * i + 20, 40));
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      int difference = 0;
      for (std::size_t k = 0; k < 3; ++k) difference += std::abs(seen[i][k] - seen[j][k]);
      EXPECT_GT(difference, 20) << i << " and " << j;
    }
}

bool any_open(const Picture& p) {
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x)
      if (at(p, x, y) != ink && brightness(at(p, x, y)) > dark) return true;
  return false;
}

// Meshes that are not closed, as others may make them.
TEST(PlanPicture, OfAnOpenMeshIsOpenOnlyBelowACeiling) {
  TriangleMesh floor = empty_mesh();
  floor.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 8, 0}};
  floor.triangles = {{0, 1, 2}};
  floor.material = {0};
  EXPECT_FALSE(any_open(plan_picture(RayCaster(floor), 200)));

  TriangleMesh both = floor;
  for (const Vector3f& v : floor.vertices) both.vertices.push_back(v + Vector3f(0, 0, 3));
  both.triangles.push_back({3, 5, 4});  // seen from below
  both.material.push_back(0);
  EXPECT_TRUE(any_open(plan_picture(RayCaster(both), 200)));

  // Ceilings without end above each other, and walls without floor, seen edge-on.
  TriangleMesh stack = floor;
  stack.triangles.clear();
  stack.material.clear();
  for (std::uint32_t i = 0; i < 1000; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      stack.vertices.push_back(floor.vertices[k] + Vector3f(0, 0, 0.01f * static_cast<float>(i)));
    stack.triangles.push_back({3 + 3 * i, 5 + 3 * i, 4 + 3 * i});
    stack.material.push_back(0);
  }
  EXPECT_FALSE(any_open(plan_picture(RayCaster(stack), 20)));
  TriangleMesh wall = floor;
  wall.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 0, 8}};
  EXPECT_FALSE(any_open(plan_picture(RayCaster(wall), 200)));
  wall.vertices = {{1, 1, 0}, {1, 1, 4}, {1, 1, 8}};
  EXPECT_FALSE(any_open(plan_picture(RayCaster(wall), 200)));
}

// 800 pixels for 90 degrees: the focal length is 400 pixels, and at 4 m there are 100 per metre.
constexpr double right_angle = std::numbers::pi / 2;

TEST(InsidePicture, ShowsThingsWhereAPinholeCameraDoes) {
  TriangleMesh mesh = empty_mesh();
  add_box(mesh, {-8, -6, -4}, {8, 6, 4}, true, 0);
  add_box(mesh, {4, 1, 0.5}, {5, 2, 1.5}, false, 1);  // left of the middle and above it
  const Picture p = inside_picture(RayCaster(mesh), Pose::Identity(), right_angle, 800, 600);
  ASSERT_EQ(p.width, 800);
  ASSERT_EQ(p.height, 600);
  // Its front has the columns 200 to 299 and the rows 150 to 249; on its right and its lower side
  // its other faces would be seen, on the left and above the wall is.
  const auto steel = [&](int x, int y) {  // a tint that the wall has not
    const Pixel c = at(p, x, y);
    return std::abs(c[0] - c[2]) > 12;
  };
  EXPECT_TRUE(steel(201, 151));
  EXPECT_TRUE(steel(298, 248));
  EXPECT_FALSE(steel(198, 200));
  EXPECT_FALSE(steel(250, 148));
  EXPECT_FALSE(steel(500, 200));  // mirrored
  EXPECT_FALSE(steel(250, 400));
}

TEST(InsidePicture, WritesTheDistanceInTheMiddleAndABarOfOneMetreThere) {
  const RayCaster caster(box({8, 6, 4}));
  for (const auto& [x, bar, label] :
       {std::tuple{0.0, 50, "1 m at 8.00 m\n"}, std::tuple{4.0, 100, "1 m at 4.00 m\n"},
        std::tuple{7.5, 80, "0.1 m at 0.50 m\n"}}) {
    const Pose T(Eigen::Translation3d(x, 0.5, 0.25));
    const Picture p = inside_picture(caster, T, right_angle, 800, 600);
    EXPECT_EQ(longest_bar(p), bar) << label;
    EXPECT_EQ(text_on(p), label);
  }
  // Where one metre would be 5 pixels, which is too short to be seen, ten.
  const Picture far =
      inside_picture(RayCaster(box({80, 6, 4})), Pose::Identity(), right_angle, 800, 600);
  EXPECT_EQ(longest_bar(far), 50);
  EXPECT_EQ(text_on(far), "10 m at 80.00 m\n");
  // Turned to the wall at y = 6 m.
  const Pose T(Eigen::Translation3d(0, -2, 0) * Eigen::AngleAxisd(right_angle, Vector3d::UnitZ()));
  EXPECT_EQ(text_on(inside_picture(caster, T, right_angle, 800, 600)), "1 m at 8.00 m\n");
}

TEST(InsidePicture, ShowsNearAndFar) {
  TriangleMesh mesh = empty_mesh();
  add_box(mesh, {0, -2, -2}, {80, 2, 2}, true, 0);
  const Pose T(Eigen::Translation3d(1, 0, 0));
  const Picture p = inside_picture(RayCaster(mesh), T, right_angle, 800, 600);
  const int far = brightness(at(p, 403, 303));  // beside the cross's arms
  const int near = brightness(at(p, 10, 300));  // 2.8 m
  EXPECT_GT(far, dark);
  EXPECT_GT(near, far + 50);
  EXPECT_LT(near, 3 * 240);
}

TEST(InsidePicture, IsDarkWithoutScaleWhereNothingIs) {
  TriangleMesh mesh = empty_mesh();
  mesh.vertices = {{-1, 0, 0}, {-1, 1, 0}, {-1, 0, 1}};
  mesh.triangles = {{0, 1, 2}};
  mesh.material = {0};
  const Picture p = inside_picture(RayCaster(mesh), Pose::Identity(), right_angle, 101, 51);
  for (std::size_t i = 0; i < p.rgb.size(); ++i) ASSERT_LT(p.rgb[i], 50);
}

TEST(Pictures, HaveTheSameBytesForAnyNumberOfThreads) {
  const RayCaster caster(cave(12, 4, 0.05));
  const auto both = [&](int threads) {
    const ThreadLimit limit(threads);
    return std::pair{plan_picture(caster, 301).rgb,
                     inside_picture(caster, Pose::Identity(), 1.2, 301, 203).rgb};
  };
  EXPECT_EQ(both(1), both(4));
}

TEST(Pictures, AreMadeInAnySizeFromOnePixelOn) {
  const RayCaster caster(room_with_box());
  const Pose T(Eigen::Translation3d(1, 1, 1));
  for (const int size : {1, 2, 3, 7, 17, 33}) {
    EXPECT_EQ(plan_picture(caster, size).width, size);
    const Picture p = inside_picture(caster, T, 1, size, 34 - size);
    EXPECT_EQ(p.rgb.size(), static_cast<std::size_t>(3 * size * (34 - size)));
  }
}

TEST(Pictures, RefuseWhatCannotBe) {
  const RayCaster caster(room_with_box());
  const Pose I = Pose::Identity();
  for (const int size : {0, -1, 16385, std::numeric_limits<int>::max()}) {
    EXPECT_THROW(plan_picture(caster, size), std::invalid_argument) << size;
    EXPECT_THROW(inside_picture(caster, I, 1, size, 10), std::invalid_argument) << size;
    EXPECT_THROW(inside_picture(caster, I, 1, 10, size), std::invalid_argument) << size;
  }
  for (const double field : {0.0, -1.0, 3.2, std::nan("")})
    EXPECT_THROW(inside_picture(caster, I, field, 10, 10), std::invalid_argument) << field;
  Pose T = I;
  T.translation().x() = std::nan("");
  EXPECT_THROW(inside_picture(caster, T, 1, 10, 10), std::invalid_argument);
  T = I;
  T.linear() *= 2;
  EXPECT_THROW(inside_picture(caster, T, 1, 10, 10), std::invalid_argument);
}

TEST(Stacked, PutsOneAboveTheOtherCentred) {
  const Picture wide{.width = 4, .height = 1, .rgb = std::vector<std::uint8_t>(12, 200)};
  const Picture high{.width = 2, .height = 2, .rgb = std::vector<std::uint8_t>(12, 100)};
  const Picture p = stacked(wide, high);
  ASSERT_EQ(p.width, 4);
  ASSERT_EQ(p.height, 3);
  ASSERT_EQ(p.rgb.size(), 36u);
  for (int x = 0; x < 4; ++x) EXPECT_EQ(at(p, x, 0)[0], 200);
  for (int y = 1; y < 3; ++y) {
    EXPECT_LT(at(p, 0, y)[0], 50);
    EXPECT_EQ(at(p, 1, y)[2], 100);
    EXPECT_EQ(at(p, 2, y)[0], 100);
    EXPECT_LT(at(p, 3, y)[0], 50);
  }
  EXPECT_EQ(at(stacked(high, wide), 1, 1)[0], 100);
  EXPECT_THROW(stacked(wide, Picture{}), std::invalid_argument);
  EXPECT_THROW(stacked(Picture{.width = 2, .height = 2, .rgb = {1, 2, 3}}, wide),
               std::invalid_argument);
}

}  // namespace
}  // namespace minescan
