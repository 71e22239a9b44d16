// SPDX-License-Identifier: MIT
#include "registration/kdtree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "clouds.h"
#include "nanoflann_tree.h"

namespace minescan {
namespace {

constexpr double everywhere = 1e9;

std::vector<Eigen::Vector3d> queries() {
  std::vector<Eigen::Vector3d> list;
  Random random(9, 0);
  for (int i = 0; i < 2000; ++i) list.push_back(6 * random_vector(random));  // many far outside
  for (const Eigen::Vector3d& p : bumpy_tunnel(2000, 3).points)
    list.push_back(p + 0.1 * random_vector(random));
  return list;
}

double brute_force(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& q) {
  double best = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& p : points) best = std::min(best, (p - q).norm());
  return best;
}

TEST(KdTree, FindsTheNearestPoint) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  for (const int leaf_size : {1, 10, 5000}) {
    const KdTree tree(points, leaf_size);
    for (const Eigen::Vector3d& q : queries()) {
      const auto found = tree.nearest(q, everywhere);
      ASSERT_TRUE(found);
      const double distance = (points[found->index] - q).norm();
      // Two ways to write one sum of squares: the last bits may differ.
      EXPECT_NEAR(distance, brute_force(points, q), 1e-14 * distance);
      EXPECT_NEAR(std::sqrt(found->squared_distance), distance, 1e-14 * distance);
    }
  }
}

// As many points as a scan has, for which looking at all would take too long.
TEST(KdTree, AgreesWithNanoflann) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(70000, 1).points;
  const NanoflannTree peer(points);
  for (const int leaf_size : {1, 10, 100}) {
    const KdTree tree(points, leaf_size);
    std::vector<Neighbour> found;
    for (const Eigen::Vector3d& q : queries()) {
      const std::vector<Neighbour> expected = peer.nearest(q, 10);
      ASSERT_EQ(expected.size(), 10u);
      tree.nearest(q, 10, everywhere, found);
      ASSERT_EQ(found.size(), 10u);
      // No two points are equally far. The sums of squares may differ by rounding.
      for (std::size_t i = 0; i < 10; ++i) {
        EXPECT_EQ(found[i].index, expected[i].index);
        EXPECT_NEAR(found[i].squared_distance, expected[i].squared_distance,
                    1e-14 * expected[i].squared_distance);
      }
      EXPECT_EQ(tree.nearest(q, everywhere)->index, expected[0].index);
      const KdTree::NearestAndRest two = tree.nearest_and_rest(q, everywhere);
      EXPECT_EQ(two.nearest->index, expected[0].index);
      EXPECT_NEAR(two.rest * two.rest, expected[1].squared_distance,
                  1e-14 * expected[1].squared_distance);
    }
  }
}

TEST(KdTree, FindsTheNearestPoints) {
  std::vector<Eigen::Vector3d> points = bumpy_tunnel(1000, 1).points;
  for (int i = 0; i < 5; ++i) points.push_back(points[7]);  // equally far: the index decides
  for (const int leaf_size : {1, 10}) {
    const KdTree tree(points, leaf_size);
    std::vector<Neighbour> found;
    for (const Eigen::Vector3d& q : queries()) {
      std::vector<std::pair<double, std::uint32_t>> all;
      for (std::uint32_t i = 0; i < points.size(); ++i)
        all.emplace_back((points[i] - q).squaredNorm(), i);
      std::partial_sort(all.begin(), all.begin() + 12, all.end());
      tree.nearest(q, 12, everywhere, found);
      ASSERT_EQ(found.size(), 12u);
      for (std::size_t i = 0; i < 12; ++i)
        EXPECT_NEAR(found[i].squared_distance, all[i].first, 1e-14 * all[i].first);
      tree.nearest(q, 5, std::sqrt(all[5].first), found);
      for (const Neighbour& n : found) EXPECT_LE(n.squared_distance, (1 + 1e-14) * all[5].first);
    }
    tree.nearest(points[7], 6, everywhere, found);
    EXPECT_EQ(found[0].index, 7u);
    for (std::size_t i = 1; i < 6; ++i) EXPECT_EQ(found[i].index, 999 + i);
    tree.nearest(points[7], 5000, everywhere, found);
    EXPECT_EQ(found.size(), points.size());
  }
}

// The promise of the paper's "no more than 1 cm from the true nearest neighbour".
TEST(KdTree, IsNeverWorseThanTheErrorAllowed) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  const KdTree tree(points, 10);
  for (const double error : {0.01, 0.2}) {
    int inexact = 0;
    for (const Eigen::Vector3d& q : queries()) {
      const auto found = tree.nearest(q, everywhere, {TreeSearch::additive, error});
      ASSERT_TRUE(found);
      const double excess = std::sqrt(found->squared_distance) - brute_force(points, q);
      EXPECT_LE(excess, error);
      inexact += excess > 1e-12;
    }
    EXPECT_GT(inexact, 0);  // else the option does nothing
  }
}

TEST(KdTree, FindsAPointIfThereIsOneWithinTheLimit) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  const KdTree tree(points, 10);
  int found = 0, missed = 0;
  for (const Eigen::Vector3d& q : queries()) {
    for (const double error : {0.0, 0.3}) {
      const double limit = 0.4;
      const bool expected = brute_force(points, q) < limit;
      const auto neighbour = tree.nearest(q, limit, {TreeSearch::additive, error});
      ASSERT_EQ(neighbour.has_value(), expected);
      if (neighbour) {
        EXPECT_LT(neighbour->squared_distance, limit * limit);
      }
      (expected ? found : missed)++;
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(missed, 100);
}

TEST(KdTree, TakesEqualPointsAndSinglePoints) {
  const KdTree same(std::vector(1000, Eigen::Vector3d(1, 2, 3)), 3);
  EXPECT_EQ(same.nearest({1, 2, 3}, 1)->squared_distance, 0);
  EXPECT_FALSE(same.nearest({1, 2, 5}, 1));
  const KdTree one({{1, 2, 3}}, 10);
  EXPECT_EQ(one.nearest({1, 2, 5}, 3)->index, 0u);
}

TEST(KdTree, KeepsToTheRelativeBound) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  const KdTree tree(points, 10);
  int inexact = 0;
  for (const Eigen::Vector3d& q : queries()) {
    const auto found = tree.nearest(q, everywhere, {TreeSearch::relative, 0.5});
    const double nearest = brute_force(points, q);
    EXPECT_LE(std::sqrt(found->squared_distance), 1.5 * nearest * (1 + 1e-12));
    inexact += std::sqrt(found->squared_distance) > nearest * (1 + 1e-12);
  }
  EXPECT_GT(inexact, 0);
}

TEST(KdTree, OfALeafItFindsTheBestPoint) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  const KdTree whole(points, 5000), tree(points, 10);
  int inexact = 0;
  for (const Eigen::Vector3d& q : queries()) {
    const double nearest = brute_force(points, q);
    const auto found = tree.nearest(q, everywhere, {TreeSearch::leaf});
    ASSERT_TRUE(found);
    EXPECT_GE(std::sqrt(found->squared_distance), nearest * (1 - 1e-12));
    inexact += std::sqrt(found->squared_distance) > nearest * (1 + 1e-12);
    // One leaf with all points.
    EXPECT_NEAR(std::sqrt(whole.nearest(q, everywhere, {TreeSearch::leaf})->squared_distance),
                nearest, 1e-12 * nearest);
  }
  EXPECT_GT(inexact, 100);
}

TEST(KdTree, TellsHowFarTheOthersAre) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  const KdTree tree(points, 10);
  for (const Eigen::Vector3d& q : queries()) {
    std::vector<double> all;
    for (const Eigen::Vector3d& p : points) all.push_back((p - q).norm());
    std::partial_sort(all.begin(), all.begin() + 2, all.end());
    const KdTree::NearestAndRest found = tree.nearest_and_rest(q, 1);
    EXPECT_EQ(found.nearest.has_value(), all[0] < 1);
    if (found.nearest) {
      EXPECT_NEAR(std::sqrt(found.nearest->squared_distance), all[0], 1e-12);
    }
    EXPECT_NEAR(found.rest, std::min(1.0, all[1]), 1e-12);
  }
}

// The distances are those of one query after the other to the last bit, and so are the points: no
// two are equally far.
TEST(KdTree, FindsTheSameForSeveralQueriesAtOnce) {
  // The boxes' corners are rounded: by up to 30 micrometres for clouds at 400 m.
  for (const Eigen::Vector3d& far : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-400, 300, 0.1)}) {
    std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
    std::vector<Eigen::Vector3d> wanted = queries();
    for (auto* list : {&points, &wanted})
      for (Eigen::Vector3d& p : *list) p += far;
    for (const int leaf_size : {1, 3, 10, 5000}) {
      const KdTree tree(points, leaf_size);
      for (const double limit : {0.05, 1.0, everywhere}) {
        // Packets of all sizes, of queries that have nothing to do with each other.
        for (std::size_t begin = 0, size = 1; begin < wanted.size(); begin += size, size %= 8) {
          ++size;
          const std::span<const Eigen::Vector3d> packet =
              std::span(wanted).subspan(begin, std::min(size, wanted.size() - begin));
          const KdTree::NearestAndRestOfEach found = tree.nearest_and_rest(packet, limit);
          for (std::size_t i = 0; i < packet.size(); ++i) {
            const KdTree::NearestAndRest alone = tree.nearest_and_rest(packet[i], limit);
            ASSERT_EQ(found[i].rest, alone.rest);
            ASSERT_EQ(found[i].nearest.has_value(), alone.nearest.has_value());
            if (!alone.nearest) continue;
            ASSERT_EQ(found[i].nearest->index, alone.nearest->index);
            ASSERT_EQ(found[i].nearest->squared_distance, alone.nearest->squared_distance);
          }
        }
      }
    }
  }
}

TEST(KdTree, FindsEqualPointsForSeveralQueriesAtOnce) {
  const KdTree same(std::vector(1000, Eigen::Vector3d(1, 2, 3)), 3);
  const std::vector<Eigen::Vector3d> wanted = {{1, 2, 3}, {1, 2, 3.5}, {1, 2, 5}};
  const KdTree::NearestAndRestOfEach found = same.nearest_and_rest(wanted, 1);
  EXPECT_EQ(found[0].nearest->squared_distance, 0);
  EXPECT_EQ(found[0].rest, 0);  // the others are there, too
  EXPECT_EQ(found[1].nearest->squared_distance, 0.25);
  EXPECT_EQ(found[1].rest, 0.5);
  EXPECT_FALSE(found[2].nearest);
  EXPECT_EQ(found[2].rest, 1);
}

TEST(KdTree, OrderHoldsEveryPointOnceAndCloseOnesTogether) {
  const std::vector<Eigen::Vector3d> points = bumpy_tunnel(3000, 1).points;
  std::vector<std::uint32_t> order = KdTree(points).order();
  const auto length = [&] {
    double sum = 0;
    for (std::size_t i = 1; i < order.size(); ++i)
      sum += (points[order[i]] - points[order[i - 1]]).norm();
    return sum;
  };
  ASSERT_EQ(order.size(), points.size());
  const double by_tree = length();
  std::sort(order.begin(), order.end());
  for (std::uint32_t i = 0; i < order.size(); ++i) ASSERT_EQ(order[i], i);
  EXPECT_LT(by_tree, length() / 5);
}

// As deep a tree as there can be: every level takes one point off.
TEST(KdTree, TakesPointsThatCrowdEverCloserTogether) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 1000; ++i) points.push_back({std::pow(0.5, i), 0, 0});
  const KdTree tree(points, 1);
  for (int i = 0; i < 40; ++i) {
    const std::vector<Eigen::Vector3d> query = {{std::pow(0.5, i), 0, 0}};
    const auto found = tree.nearest(query[0], 1);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->squared_distance, 0);
    EXPECT_EQ(tree.nearest_and_rest(query, 1)[0].nearest->squared_distance, 0);
  }
}

}  // namespace
}  // namespace minescan
