// SPDX-License-Identifier: MIT
// The rock of mines measured on their meshes, as a surveyor would: by rays, one kind of relief on a
// surface at a time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "scenes/materials.h"
#include "scenes/mine.h"
#include "scenes/spectra.h"
#include "sim/raycaster.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;

RangeFinder range_finder(TriangleMesh mesh) {
  return [caster = RayCaster(std::move(mesh))](const Eigen::Vector3d& from,
                                               const Eigen::Vector3d& direction) {
    const std::optional<Hit> hit = caster.cast(from, direction, 0, 1000);
    EXPECT_TRUE(hit.has_value());
    return hit ? hit->range : 0;
  };
}

DriftSurvey survey_of(const RockOptions& rock, const StraightDrift& drift, double edge,
                      std::uint64_t seed) {
  return {drift, range_finder(drift_mesh(rock, drift, edge, seed))};
}

/// Along 60 m of drift for each of some seeds.
DriftSpectra spectra_of(const RockOptions& rock, double edge, std::uint64_t seeds) {
  return drift_spectra(rock, edge, 1, seeds, range_finder);
}

// From 4 edges to a third of the longest wave. The longest waves that are fitted are the worst
// known: of 3 m there are about 3 independent lines on a wall, 100 amplitudes in all, 10 %. The
// fit runs over a factor of 8: 0.05 for the slope, and the steps between octaves and the mesh at
// the short end about as much.
TEST(Surfaces, WallsAndCeilingsHaveTheirHurstExponents) {
  const double edge = 0.1, shortest = 4 * edge, longest = 10.0 / 3;
  const RockOptions defaults;
  RockOptions rock = flat_rock();
  rock.wall = defaults.wall;  // H 0.75, for these edges show nothing below 0.3 m
  rock.ceiling = {.rms = 0.015, .hurst = 0.5};
  const DriftSpectra one = spectra_of(rock, edge, 4);
  EXPECT_NEAR(one.wall.slope(shortest, longest, edge), -(1 + 2 * 0.75), 0.1);
  EXPECT_NEAR(one.ceiling.slope(shortest, longest, edge), -(1 + 2 * 0.5), 0.1);
  rock.wall = {.rms = 0.07, .hurst = 0.5};
  rock.ceiling = defaults.ceiling;
  const DriftSpectra other = spectra_of(rock, edge, 4);
  EXPECT_NEAR(other.wall.slope(shortest, longest, edge), -(1 + 2 * 0.5), 0.1);
  EXPECT_NEAR(other.ceiling.slope(shortest, longest, edge), -(1 + 2 * 0.75), 0.1);
}

// The default walls below 0.3 m. There are two octaves only down to the shortest wave of 5 cm, and
// the knee is as wide as an octave's own spectrum: summed up, these make -2.16 in this band in
// place of -2 (and -2.5 if there were no knee). Some 1000 independent amplitudes at each frequency:
// the rest of the tolerance is the mesh's, at 8 edges.
TEST(Surfaces, DefaultWallsAreRougherBelowTheirKnee) {
  const double edge = 0.01, step = edge / 2;
  RockOptions rock = flat_rock();
  rock.wall = RockOptions{}.wall;
  const StraightDrift plan{.from = 0, .to = 4, .width = 1.2, .height = 1.2};
  const DriftSurvey survey = survey_of(rock, plan, edge, 1);
  ProfileDensity density(600, step);
  for (double z = 0.25; z < 1; z += 0.1) {
    density.add([&](double x) { return survey.left(0.5 + x, vertex_row(z, edge)); });
    density.add([&](double x) { return survey.right(0.5 + x, vertex_row(z, edge)); });
  }
  const double slope = density.slope(0.08, 0.3, edge);
  EXPECT_NEAR(slope, -2, 0.25);
}

// Along lines without stones. In bands of half an octave 60
// m of floor hold few of the longest waves, so these scatter by a third; the borders are a factor 2
// to either side. Loose rocks are not the road's: the default ones add half of class D's density at
// 2 cycles per metre and nothing below 0.4 (measured so). Ruts run along the lines and add nothing;
// across the drift they are two grooves of 0.25 m.
TEST(Surfaces, FloorsAreWithinTheirRoadClass) {
  const double edge = 0.1, n0 = 0.1;
  for (const RoadClass road : {RoadClass::C, RoadClass::D, RoadClass::E}) {
    const int k = static_cast<int>(road) - static_cast<int>(RoadClass::A);
    const double middle = 16e-6 * std::pow(4, k);  // G_d(n0), ISO 8608
    RockOptions rock = flat_rock();
    rock.floor_class = road;
    const DriftSpectra s = spectra_of(rock, edge, 3);
    for (double n = 0.1; n < 3.3; n *= std::sqrt(2.0)) {
      const double density = s.floor.smoothed(n, edge, 2) / (n0 * n0);  // as at n0
      EXPECT_GT(density, middle / 2) << n << " cycles per metre, class " << k;
      EXPECT_LT(density, middle * 2) << n << " cycles per metre, class " << k;
    }
    // The fit as above.
    const double waviness = -s.floor.slope(4 * edge, 10.0 / 3, edge);
    EXPECT_NEAR(waviness, 2, 0.15) << "class " << k;
  }
}

/// RMS of what is left of a relief of one exponent whose octaves outer, outer / 2, ... >= inner
/// below `finest` are left out.
double kept_rms(double rms, double hurst, double inner, double outer, double finest) {
  double all = 0, kept = 0;
  for (double wavelength = outer; wavelength >= inner; wavelength /= 2) {
    const double variance = std::pow(wavelength, 2 * hurst);
    all += variance;
    if (wavelength >= finest) kept += variance;
  }
  return rms * std::sqrt(kept / all);
}

// The 10 m waves have most of the variance and lattices of 4.2 m: per seed some 25 independent
// places on the walls and as many on ceiling and floor; sqrt(1 / (2 * 25 * 24)) = 3 % for 24 seeds,
// three of these.
TEST(Surfaces, HaveTheStatedRms) {
  const double edge = 0.3;
  RockOptions rock = flat_rock();
  rock.wall = {.rms = 0.07, .hurst = 0.75};
  rock.ceiling = {.rms = 0.03, .hurst = 0.5};
  rock.floor_class = RoadClass::E;
  const StraightDrift plan{.from = 0, .to = 40};
  std::array<double, 3> squares = {}, sums = {};
  double count = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const DriftSurvey survey = survey_of(rock, plan, edge, seed);
    for (double x = 2; x < 38; x += 0.37)
      for (double t = 0.1; t < 0.91; t += 0.1) {
        const double y = (t - 0.5) * plan.width, z = t * plan.height;
        const double wall = std::lround(10 * t) % 2 == 0 ? survey.left(x, z) : survey.right(x, z);
        const std::array<double, 3> heights = {wall, survey.ceiling(x, y), survey.floor(x, y)};
        for (std::size_t i = 0; i < 3; ++i) {
          sums[i] += heights[i];
          squares[i] += heights[i] * heights[i];
        }
        ++count;
      }
  }
  const double finest = 2 * edge;
  const std::array<double, 3> expected = {
      kept_rms(0.07, 0.75, 0.05, 10, finest), kept_rms(0.03, 0.5, 0.05, 10, finest),
      kept_rms(road_relief(RoadClass::E, 0.05, 10).rms, 0.5, 0.05, 10, finest)};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(squares[i] / count) / expected[i], 1, 0.1) << "surface " << i;
    // The mean of 600 independent places, three times.
    EXPECT_NEAR(sums[i] / count / expected[i], 0, 3 / std::sqrt(600.0)) << "surface " << i;
  }
}

TEST(Surfaces, AreTheSameBytesForASeedAndAnyNumberOfThreads) {
  RockOptions rock;  // all there is
  rock.wet_share = 0.2;
  rock.puddle_share = 0.1;
  const StraightDrift plan{.from = 0, .to = 25};
  TriangleMesh one;
  {
    const ThreadLimit limit(1);
    one = drift_mesh(rock, plan, 0.2, 7);
  }
  const ThreadLimit limit(4);
  EXPECT_TRUE(same_bytes(one, drift_mesh(rock, plan, 0.2, 7)));
  EXPECT_FALSE(same_bytes(one, drift_mesh(rock, plan, 0.2, 8)));
}

// The same place of a wall in two mines, one of them 10 m longer at its far end, so that its rounds
// are the same. With equal edges the triangles are the same too.
TEST(Surfaces, BelongToTheWorldNotToTheMine) {
  RockOptions rock;
  rock.half_cast_spacing = 0;
  const StraightDrift shorter{.from = 0, .to = 20}, longer{.from = 0, .to = 30};
  const DriftSurvey a = survey_of(rock, shorter, 0.1, 3);
  const DriftSurvey same_edges = survey_of(rock, longer, 0.1, 3);
  const DriftSurvey other_edges = survey_of(rock, longer, 0.13, 3);
  double squares = 0, differences = 0;
  int n = 0;
  for (double x = 2; x < 17; x += 0.11)
    for (double z = 0.6; z < 5.5; z += 0.21) {
      const double here = a.left(x, z);
      // Single precision of coordinates, and which of two triangles at their common side is hit.
      EXPECT_NEAR(same_edges.left(x, z), here, 1e-5) << x << ", " << z;
      EXPECT_NEAR(same_edges.ceiling(x, z - 3), a.ceiling(x, z - 3), 1e-5) << x << ", " << z - 3;
      EXPECT_NEAR(same_edges.floor(x, z - 3), a.floor(x, z - 3), 1e-5) << x << ", " << z - 3;
      squares += here * here;
      differences += std::pow(other_edges.left(x, z) - here, 2);
      ++n;
    }
  // Both meshes show waves of 0.31 m and more. Triangles cut these: a wave of RMS a and length L is
  // cut by a (2 pi / L)^2 h^2 / 8 in each of three directions, 3 mm in all for edges of 0.1 m, 5 mm
  // for 0.13 m; breaks between rounds, with slopes of 1 in 2, more in few places. The relief, with
  // overbreak, is 0.1 m.
  EXPECT_GT(std::sqrt(squares / n), 0.07);
  EXPECT_LT(std::sqrt(differences / n), 0.012);
}

// From two places in two meshes of different edges.
TEST(Surfaces, ShowTheSameStonesFromAnyPlace) {
  RockOptions rock = flat_rock();
  rock.rock_density = 0.2;
  rock.rock_size = 0.8;
  const DriftSurvey fine = survey_of(rock, {.from = 0, .to = 20}, 0.05, 4);
  const DriftSurvey coarse = survey_of(rock, {.from = 0, .to = 30}, 0.08, 4);
  int stones = 0, seen = 0;
  for (int i = 2; i < 18; ++i)
    for (int j = -4; j < 4; ++j) {
      // The highest place in a square metre, which holds one stone at most.
      Eigen::Vector3d top(0, 0, 0);
      for (double x = i + 0.025; x < i + 1; x += 0.05)
        for (double y = j + 0.025; y < j + 1; y += 0.05)
          if (const double z = fine.floor(x, y); z > top.z()) top = {x, y, z};
      if (top.z() < 0.15) continue;
      ++stones;
      for (const Eigen::Vector3d& eye : {Eigen::Vector3d(1, 1, 4), Eigen::Vector3d(19, -2, 4)}) {
        const Eigen::Vector3d line = top - eye;
        const double range = coarse.range(eye, line.normalized());
        if (std::abs(range - line.norm()) < 0.16) ++seen;
      }
    }
  // 128 square metres with 0.2 stones each, of which 0.37 to 0.75 of the width is high enough:
  // about 12.
  EXPECT_GE(stones, 5);
  // Within two coarse edges. Another stone is in the way now and then.
  EXPECT_GE(seen, 2 * stones * 9 / 10);
}

// Grooves of half a drill hole, 2.5 cm deep; in each round (4 m) at each multiple of 0.7 m at half
// of the places, over 0.8 of the round.
TEST(Surfaces, WallsKeepHalvesOfDrillHoles) {
  RockOptions rock = flat_rock();
  rock.half_cast_spacing = 0.7;
  const double edge = 0.02;
  const StraightDrift plan{
      .from = 0, .to = 20, .width = 1.4, .height = 2.9};  // 5 rounds, 4 holes high
  const DriftSurvey survey = survey_of(rock, plan, edge, 5);
  const int rounds = 5, holes = 4;
  int grooves = 0;
  for (int round = 0; round < rounds; ++round)
    for (const bool left : {false, true}) {
      const auto profile = [&](double within) {
        std::vector<double> p;
        for (double z = edge; z < plan.height - edge; z += edge / 4) {
          const double x = 4 * round + within;
          p.push_back(left ? survey.left(x, z) : survey.right(x, z));
        }
        return p;
      };
      const std::vector<double> early = profile(0.5), late = profile(2.9), end = profile(3.6);
      // Straight from the start of the round to four fifths of it, and not beyond.
      for (std::size_t i = 0; i < early.size(); ++i) EXPECT_NEAR(early[i], late[i], 1e-4);
      EXPECT_LT(*std::max_element(end.begin(), end.end()), 1e-4);
      EXPECT_GT(*std::min_element(early.begin(), early.end()), -1e-4);
      for (int hole = 0; hole < holes; ++hole) {
        double deepest = 0, at = 0, width = 0;
        for (std::size_t i = 0; i < early.size(); ++i) {
          const double z = edge + edge / 4 * static_cast<double>(i);
          if (z < 0.7 * hole || z >= 0.7 * (hole + 1)) continue;
          if (early[i] > deepest) {
            deepest = early[i];
            at = z;
          }
          if (early[i] > 1e-3) width += edge / 4;
        }
        if (deepest < 1e-3) continue;
        ++grooves;
        // A vertex is within 1 cm of the middle, where a circle of 2.5 cm is 2.3 cm deep.
        EXPECT_GT(deepest, 0.022);
        EXPECT_LT(deepest, 0.02501);
        // Holes stray by a tenth of the spacing.
        EXPECT_NEAR(at / 0.7 - hole, 0.5, 0.1 + edge / 0.7);
        // 5 cm, with triangles that end up to an edge beyond.
        EXPECT_NEAR(width, 0.05 + edge / 2, edge);
      }
    }
  // Binomial of 40 with p = 0.5: 20, sigma 3.2; three of these.
  EXPECT_NEAR(grooves, 20, 10);
}

// At edges above 2.5 cm a groove would have no vertex in it now and then, and is left out.
TEST(Surfaces, CoarseEdgesShowNoDrillHoles) {
  RockOptions rock = flat_rock();
  rock.half_cast_spacing = 0.7;
  const DriftSurvey survey =
      survey_of(rock, {.from = 0, .to = 8, .width = 2, .height = 3}, 0.05, 5);
  for (double x = 0.5; x < 7.5; x += 0.25)
    for (double z = 0.1; z < 2.9; z += 0.01) EXPECT_NEAR(survey.left(x, z), 0, 1e-4);
}

// The planned saw-tooth rises by 0.2 m over 3.6 m and falls back over 0.4 m. Where rounds break
// strays by 0.3 m RMS, so the mean over rounds is that smoothed with a normal distribution. Breaks
// stray over some 2 m: 15 rounds x 2 walls x 2 heights x 4 seeds are about 240 independent ones,
// which leaves 0.3 m / sqrt(240) = 2 cm of the place and, at a slope of 1 in 2, 1 cm of the fall.
TEST(Surfaces, WallsWidenOverARoundAndFallBack) {
  RockOptions rock = flat_rock();
  rock.look_out = 0.2;
  const StraightDrift plan{.from = 0, .to = 60};
  const double round = rock.round_length, fall = 0.4, stray = 0.3;
  const int bins = 40;
  std::array<double, bins> mean = {};
  double count = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const DriftSurvey survey = survey_of(rock, plan, 0.2, seed);
    for (int r = 1; r < 14; ++r) {
      for (double z = 0.5; z < 5.6; z += 0.5) {
        for (int bin = 0; bin < bins; ++bin) {
          const double x = round * (r + (bin + 0.5) / bins);
          mean[static_cast<std::size_t>(bin)] += survey.left(x, z) + survey.right(x, z);
        }
        count += 2;
      }
    }
  }
  for (double& m : mean) m /= count;
  const auto planned = [&](double x) {
    const double within = x - round * std::floor(x / round), tip = round - fall;
    return 0.2 * ((within < tip ? within / tip : (round - within) / fall) - 0.5);
  };
  for (int bin = 0; bin < bins; ++bin) {
    double smoothed = 0, weights = 0;
    for (double t = -4; t <= 4.001; t += 0.05) {
      const double weight = std::exp(-t * t / 2);
      smoothed += weight * planned(round * (bin + 0.5) / bins + stray * t);
      weights += weight;
    }
    EXPECT_NEAR(mean[static_cast<std::size_t>(bin)], smoothed / weights, 0.02) << "bin " << bin;
  }
  // From the middle of the lower third to that of the upper: 10 bins of 0.1 m apart by 2 m.
  EXPECT_NEAR(mean[28] - mean[8], 0.2 * 2 / (round - fall), 0.01);
  // And back within 0.4 m and what breaks stray, so not quite as far.
  const auto [low, high] = std::minmax_element(mean.begin(), mean.end());
  EXPECT_GT(*high - *low, 0.12);
  EXPECT_LE(*high - *low, 0.2);
}

// Where a weakness of unit variance exceeds one: 15.9 % if it were normal; gradient noise has less
// in its tails and 17.1 % there (2 million places). Triangles carry a little of it over the border,
// so what is deeper than 1 cm is counted: 16.1 % by the noise. Weak places of about 2 m: some 100
// on two walls of 60 m and for 6 seeds sqrt(0.16 * 0.84 / 600) = 1.5 %; three of these.
TEST(Surfaces, OverbreakIsOutwardsOnASixthOfTheWalls) {
  RockOptions rock = flat_rock();
  rock.overbreak = 0.1;
  double covered = 0, depth = 0, count = 0, deepest = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const DriftSurvey survey = survey_of(rock, {}, 0.2, seed);
    for (double x = 1; x < 59; x += 0.25)
      for (double z = 0.25; z < 5.9; z += 0.25)
        for (const double height : {survey.left(x, z), survey.right(x, z)}) {
          // Vertices keep 1e-3 of an edge away from lattice points.
          EXPECT_GT(height, -2.1e-4);
          if (height > 0.01) {
            ++covered;
            depth += height;
          }
          deepest = std::max(deepest, height);
          ++count;
        }
    EXPECT_NEAR(survey.ceiling(30, 0), 0, 2.1e-4);  // walls only
    EXPECT_NEAR(survey.floor(30, 0), 0, 2.1e-4);
  }
  EXPECT_NEAR(covered / count, 0.161, 0.045);
  EXPECT_LE(deepest, 0.2 + 2.1e-4);  // twice the typical one at most
  // What is less deep than 1 cm does not count here: a little more than the mean of all.
  EXPECT_NEAR(depth / covered, 0.1, 0.012);
}

// A square metre holds one stone or none, wholly. Its middle is at least a tenth of a metre, half
// the smallest stone, from the border, and beyond that triangles of 0.1 m at a neighbour's stone
// have come down.
TEST(Surfaces, LooseRocksHaveTheStatedNumber) {
  const double density = 0.3, edge = 0.1;
  RockOptions rock = flat_rock();
  rock.rock_density = density;
  rock.rock_size = 0.6;
  int stones = 0, cells = 0;
  double covered = 0, count = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const DriftSurvey survey = survey_of(rock, {.from = 0, .to = 42}, edge, seed);
    for (int i = 1; i < 41; ++i)
      for (int j = -4; j < 4; ++j) {
        double highest = 0;
        for (double u = 0.1; u < 0.91; u += 0.05)
          for (double v = 0.1; v < 0.91; v += 0.05)
            highest = std::max(highest, survey.floor(i + u, j + v));
        // The flattest stone is 5 cm high, and a vertex within 7 cm of its middle 3.5 cm.
        if (highest > 0.02) ++stones;
        ++cells;
        for (double u = 0.05; u < 1; u += 0.1)
          for (double v = 0.05; v < 1; v += 0.1) {
            if (survey.floor(i + u, j + v) > 0.01) ++covered;
            ++count;
          }
      }
  }
  const double n = cells;
  EXPECT_NEAR(stones / n, density, 3 * std::sqrt(density * (1 - density) / n));
  // E[across^2] = size^2 (1 - 1 / 9) / (2 ln 3), as roughness_test; triangles widen a stone by up
  // to an edge in all, a third of the typical one: 0.7 more area.
  const double share = density * pi / 4 * 0.36 * (8.0 / 9) / (2 * std::log(3));
  EXPECT_GT(covered / count, 0.85 * share);
  EXPECT_LT(covered / count, 1.7 * share);
}

TEST(Surfaces, WheelsLeaveTwoRuts) {
  const double edge = 0.05, depth = 0.1, track = 2, width = 0.25;
  RockOptions rock = flat_rock();
  rock.rut_depth = depth;
  const DriftSurvey survey = survey_of(rock, {.from = 0, .to = 6}, edge, 1);
  double deepest_left = 0, at_left = 0, deepest_right = 0, at_right = 0;
  for (double y = -4; y < 4; y += edge / 4) {
    const double height = survey.floor(3.01, y);
    const double t = (std::abs(y) - track / 2) / width;
    // Triangles cut a bend of 2 depth / width^2 by edge^2 / 8: 1 mm; the margin is less.
    EXPECT_NEAR(height, -depth * std::exp(-t * t), 1.2e-3) << "y " << y;
    double& deepest = y > 0 ? deepest_left : deepest_right;
    if (height < deepest) {
      deepest = height;
      (y > 0 ? at_left : at_right) = y;
    }
  }
  EXPECT_NEAR(deepest_left, -depth, 1.2e-3);
  EXPECT_NEAR(deepest_right, -depth, 1.2e-3);
  EXPECT_NEAR(at_left - at_right, track, edge);
}

/// Area of the triangles of a material.
double area_of(const TriangleMesh& mesh, std::uint8_t material) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.material[t] != material) continue;
    const auto [a, b, c] = corners(mesh, mesh.triangles[t]);
    area += (b - a).cross(c - a).norm() / 2;
  }
  return area;
}

// Some 35 independent places on 60 m of floor, and 10 seeds: sqrt(0.1 * 0.9 / 350) = 1.6 %; three
// of these.
TEST(Surfaces, PuddlesAreFlatOnTheStatedShareOfTheFloor) {
  RockOptions rock = flat_rock();
  rock.floor_class = RoadClass::D;
  rock.puddle_share = 0.1;
  // The level that a normal floor of this RMS is below with probability 0.1.
  const double level = -1.281552 * road_relief(RoadClass::D, 0.05, 10).rms;
  double wet = 0, all = 0;
  std::size_t flat = 0, shore = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const TriangleMesh mesh = drift_mesh(rock, {}, 0.2, seed);
    wet += area_of(mesh, water);
    all += area_of(mesh, water) + area_of(mesh, gravel);
    // Vertices whose triangles are all water.
    std::vector<std::uint8_t> inside(mesh.vertices.size(), 1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (mesh.material[t] != water)
        for (const std::uint32_t v : mesh.triangles[t]) inside[v] = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      if (inside[v] == 0) continue;
      const double above = mesh.vertices[v].z() - level;
      ++(std::abs(above) < 1e-6 ? flat : shore);
      EXPECT_LT(above, 0.01);
    }
    for (const Eigen::Vector3f& v : mesh.vertices) ASSERT_GT(v.z(), level - 1e-6);
  }
  EXPECT_NEAR(wet / all, 0.1, 0.048);
  // A vertex on a level edge of the lattice lies on the shore, higher than the water.
  EXPECT_GT(flat, 1000U);
  EXPECT_LT(static_cast<double>(shore), 0.02 * static_cast<double>(flat));
}

// Patches of about 3 m, on lattices of 1.2 m: 500 independent places on walls and ceiling of 60 m
// and for 3 seeds sqrt(0.3 * 0.7 / 1500) = 1.2 %; three of these.
TEST(Surfaces, WetRockHasTheStatedShare) {
  RockOptions rock = flat_rock();
  rock.wet_share = 0.3;
  double wet = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const TriangleMesh mesh = drift_mesh(rock, {}, 0.2, seed);
    const double here = area_of(mesh, wet_sandstone);
    wet += here;
    all += here + area_of(mesh, sandstone) + area_of(mesh, bedded_sandstone);
    EXPECT_EQ(area_of(mesh, water), 0);
  }
  EXPECT_NEAR(wet / all, 0.3, 0.036);
}

}  // namespace
}  // namespace minescan
