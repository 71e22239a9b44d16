// SPDX-License-Identifier: MIT
#include "registration/lattice.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <stdexcept>

#include "clouds.h"

namespace minescan {
namespace {

/// The definition, point by point.
NumberedCells numbered_plainly(const std::vector<Eigen::Vector3d>& points, const Lattice& lattice) {
  NumberedCells cells;
  std::map<std::uint64_t, std::uint32_t> numbers;
  for (const Eigen::Vector3d& p : points) {
    const std::uint64_t key = lattice.key(p);
    const auto [at, is_new] = numbers.try_emplace(key, static_cast<std::uint32_t>(numbers.size()));
    if (is_new) cells.keys.push_back(key);
    cells.cell_of.push_back(at->second);
  }
  return cells;
}

TEST(NumberCells, NumbersThemAsThePointsTouchThem) {
  for (const std::size_t count : {1u, 3u, 4u, 5u, 255u, 256u, 257u, 5000u}) {
    std::vector<Eigen::Vector3d> points = bumpy_tunnel(count, 1).points;
    // On faces, to the last bit, and on both sides of zero.
    for (std::size_t i = 0; i < points.size(); i += 3)
      points[i] = Eigen::Vector3d((2 * points[i]).array().round() / 2);
    for (const double side : {0.5, 0.37, 2.0}) {
      const Lattice lattice(side, {0.1, -0.2, 0});
      const NumberedCells expected = numbered_plainly(points, lattice);
      const NumberedCells found = number_cells(points, lattice, "cell-size");
      EXPECT_EQ(found.cell_of, expected.cell_of);
      EXPECT_EQ(found.keys, expected.keys);
    }
  }
}

// So far apart that a table of the box between them would not do.
TEST(NumberCells, TakesPointsFarFromTheOthers) {
  std::vector<Eigen::Vector3d> points = bumpy_tunnel(2000, 1).points;
  points.insert(points.begin() + 1000, Eigen::Vector3d(1e5, -2e5, 3e5));
  const Lattice lattice(0.5);
  EXPECT_EQ(number_cells(points, lattice, "cell-size").cell_of,
            numbered_plainly(points, lattice).cell_of);
  points.push_back({0, 0, 1e6});
  EXPECT_THROW(number_cells(points, lattice, "cell-size"), std::invalid_argument);
  EXPECT_TRUE(number_cells({}, lattice, "cell-size").keys.empty());
  for (const double nonsense :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    points = bumpy_tunnel(300, 1).points;
    points[123].y() = nonsense;
    EXPECT_THROW(number_cells(points, lattice, "cell-size"), std::invalid_argument);
  }
}

TEST(Lattice, KeysAndIndicesAreInverse) {
  for (const std::array<int, 3>& cell :
       {std::array<int, 3>{0, 0, 0}, {-1, 5, -7}, {-(1 << 20), (1 << 20) - 1, 3}})
    EXPECT_EQ(Lattice::indices(Lattice::key(cell)), cell);
}

}  // namespace
}  // namespace minescan
