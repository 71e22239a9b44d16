// SPDX-License-Identifier: MIT
#include "sim/scan_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>

#include "sim/scan.h"
#include "test/sim/shapes.h"

namespace minescan {
namespace {

using Rgb = std::array<int, 3>;

Rgb at(const Picture& p, int x, int y) {
  const auto i = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) +
                      static_cast<std::size_t>(x));
  return {p.rgb[i], p.rgb[i + 1], p.rgb[i + 2]};
}

int count(const Picture& p, const Rgb& colour) {
  int n = 0;
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) n += at(p, x, y) == colour;
  return n;
}

const Rgb ground = {33, 33, 38};
const Rgb brightest = {252, 232, 38};
const Rgb orange = {255, 89, 26};    // a wrong period
const Rgb magenta = {255, 77, 217};  // a mixed pixel

void add(Scan& scan, const Eigen::Vector3d& point, float intensity, std::uint8_t flags = 0) {
  scan.cloud.points.push_back(point);
  scan.range.push_back(point.norm());
  scan.intensity.push_back(intensity);
  scan.flags.push_back(flags);
  scan.echo.push_back(1);
  scan.true_normal.emplace_back(0, 0, 1);
}

// 3 rings by 4 columns, the beam of ring 0 and column 1 without return; the one of ring 2 and
// column 3 is the strongest and the nearest.
Scan grid() {
  Scan scan;
  scan.rings = 3;
  scan.columns = 4;
  scan.beams = 12;
  for (std::uint32_t column = 0; column < 4; ++column)
    for (std::uint32_t ring = 0; ring < 3; ++ring) {
      if (ring == 0 && column == 1) continue;
      const bool best = ring == 2 && column == 3;
      add(scan, {best ? 1.0 : 5.0 + column, 0, 0}, best ? 1 : 0.1f);
      scan.ring.push_back(ring);
      scan.column.push_back(column);
    }
  return scan;
}

// 284 pixels within margins of 8, so 71 by 71 for each beam.
TEST(GridPicture, ShowsBeamsWhereTheyAre) {
  const Picture p = grid_picture(grid(), false, 300);
  EXPECT_EQ(p.width, 300);
  const int panel = 213 + 16 + 8;  // beams, legend, margin
  ASSERT_EQ(p.height, 8 + 2 * panel);
  const auto beam = [&](int ring, int column, int of) {
    return at(p, 8 + 71 * column + 35, 8 + of * panel + 71 * ring + 35);
  };
  for (const int of : {0, 1}) {
    EXPECT_EQ(beam(0, 1, of), (Rgb{0, 0, 0}));
    EXPECT_EQ(beam(2, 3, of), brightest) << of;
    EXPECT_NE(beam(0, 0, of), (Rgb{0, 0, 0}));
    EXPECT_NE(beam(0, 0, of), brightest);
  }
}

// 284 pixels for 3 rings, and 3/4 of that for 4 planes.
TEST(GridPicture, TurnsPlanesThatTiltUpwards) {
  const Picture p = grid_picture(grid(), true, 300);
  const auto beam = [&](int ring, int column) {
    return at(p, 8 + (2 - ring) * 284 / 3 + 47, 8 + (3 - column) * 213 / 4 + 26);
  };
  EXPECT_EQ(beam(0, 1), (Rgb{0, 0, 0}));
  EXPECT_EQ(beam(2, 3), brightest);
}

// A floor, a point above it that is wrong and a mixed one.
Scan floor_scan() {
  Scan scan;
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j) add(scan, {0.2 * i, 0.2 * j, -1.0}, i < 0 ? 0.1f : 0.3f);
  add(scan, {0, 0, 1}, 0.2f, flag_outlier);
  add(scan, {1, 0, 0}, 0.2f, flag_mixed_pixel);
  return scan;
}

TEST(PointsPicture, ShowsWhatIsWrongInColoursOfItsOwn) {
  const Picture p = points_picture(floor_scan(), 600);
  // Squares in the legend of 7 dots of 2 pixels, and the points themselves, of up to 5 pixels.
  for (const Rgb& colour : {orange, magenta}) {
    EXPECT_GT(count(p, colour), 14 * 14);
    EXPECT_LE(count(p, colour), 14 * 14 + 25);
  }
  EXPECT_GT(count(p, brightest), 0) << "the floor's brighter half";
  // The higher of two places is further up in the picture.
  const auto first_row = [&](const Rgb& colour) {
    for (int y = 0; y < p.height; ++y)
      for (int x = 0; x < p.width; ++x)
        if (at(p, x, y) == colour) return y;
    return p.height;
  };
  EXPECT_LT(first_row(orange), first_row(magenta));
}

TEST(PointsPicture, DarkensSurfacesSeenFromBehind) {
  Scan scan = floor_scan();
  for (Eigen::Vector3f& n : scan.true_normal) n = -n;
  const Picture p = points_picture(scan, 600);
  // The scale in the legend ends with the brightest colour.
  EXPECT_LE(count(p, brightest), 2 * 14);
  EXPECT_GT(count(p, orange), 14 * 14) << "what is wrong is not";
}

TEST(PointsPicture, CountsWhatIsBeyondItsFrame) {
  Scan scan = floor_scan();
  const Picture inside = points_picture(scan, 600);
  add(scan, {1000, 0, 0}, 0.2f, flag_outlier);
  const Picture beyond = points_picture(scan, 600);
  // The same frame, more text.
  EXPECT_EQ(beyond.height, inside.height);
  EXPECT_GT(count(beyond, {255, 255, 255}), count(inside, {255, 255, 255}) + 100);
}

// Text that ran out of a picture would touch its border.
TEST(ScanPictures, HaveABorder) {
  const RayCaster caster(box({8, 6, 4}, 3));
  for (const Scanner& scanner : scanners()) {
    Scanner small = scanner;
    small.plane_beams = std::min(small.plane_beams, 60);
    small.planes = std::min(small.planes, 60);
    const Scan seen = scan(caster, small, Pose::Identity(), 1, "box");
    const Picture points = points_picture(seen, 1200);
    for (int y = points.height - 40; y < points.height; ++y) {
      EXPECT_EQ(at(points, 0, y), ground) << scanner.name;
      EXPECT_EQ(at(points, points.width - 1, y), ground) << scanner.name;
    }
    if (seen.rings == 0) {
      EXPECT_THROW(grid_picture(seen, false, 1200), std::invalid_argument);
      continue;
    }
    const Picture beams = grid_picture(seen, scanner.motion == Motion::pitch, 1200);
    for (int y = 0; y < beams.height; ++y) {
      EXPECT_EQ(at(beams, 0, y), ground) << scanner.name;
      EXPECT_EQ(at(beams, beams.width - 1, y), ground) << scanner.name;
    }
    for (int x = 0; x < beams.width; ++x) EXPECT_EQ(at(beams, x, beams.height - 1), ground);
  }
}

TEST(ScanPictures, RefuseWhatCannotBeDrawn) {
  EXPECT_THROW(points_picture({}, 600), std::invalid_argument);
  EXPECT_THROW(grid_picture({}, false, 600), std::invalid_argument);
  EXPECT_THROW(points_picture(floor_scan(), 299), std::invalid_argument);
  EXPECT_THROW(points_picture(floor_scan(), 20000), std::invalid_argument);
  EXPECT_THROW(grid_picture(grid(), false, 0), std::invalid_argument);
  EXPECT_THROW(grid_picture(floor_scan(), false, 600), std::invalid_argument);
  // One point is a picture too.
  Scan one;
  add(one, {1, 2, 3}, 0);
  EXPECT_EQ(points_picture(one, 300).width, 300);
}

}  // namespace
}  // namespace minescan
