// SPDX-License-Identifier: MIT
#include "scenes/self_intersection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "core/parallel.h"

namespace minescan {
namespace {

using Point = Eigen::Vector3f;

// Exact arithmetic: a number is a sum of doubles. Products of three differences of floats are whole
// multiples of 2^-447 and below 2^390, so nothing overflows or underflows.

/// A rounded result and what rounding left off.
struct Split {
  double rounded = 0;
  double rest = 0;
};

/// Knuth 1969.
Split exact_sum(double a, double b) {
  const double sum = a + b;
  const double b_taken = sum - a;
  return {sum, (a - (sum - b_taken)) + (b - b_taken)};
}

Split exact_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

/// A sum without rounding. Its parts do not overlap and grow, so the last one has its sign (grow-
/// expansion with zeros left out, Shewchuk 1997, section 2.4).
class ExactSum {
 public:
  void add(double term) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const Split sum = exact_sum(term, parts_[i]);
      if (sum.rest != 0) parts_[kept++] = sum.rest;
      term = sum.rounded;
    }
    if (term != 0) parts_[kept++] = term;
    size_ = kept;
  }
  int sign() const { return size_ == 0 ? 0 : parts_[size_ - 1] > 0 ? 1 : -1; }

 private:
  // A determinant has 6 products of 3 differences of 2 parts; each product is 4 terms.
  std::array<double, 6 * 8 * 4> parts_ = {};
  std::size_t size_ = 0;
};

/// The vector between two points, before its rounding.
struct Between {
  Point from = Point::Zero();
  Point to = Point::Zero();

  Eigen::Vector3d rounded() const { return to.cast<double>() - from.cast<double>(); }
  Split exact(int axis) const { return exact_sum(to[axis], -static_cast<double>(from[axis])); }
};

int exact_determinant_sign(const Between& a, const Between& b, const Between& c) {
  ExactSum determinant;
  const auto add_products = [&](const Split& x, const Split& y, const Split& z, double sign) {
    for (const double p : {x.rounded, x.rest})
      for (const double q : {y.rounded, y.rest})
        for (const double r : {z.rounded, z.rest}) {
          if (p == 0 || q == 0 || r == 0) continue;
          const Split pq = exact_product(p, q);
          for (const double part : {pq.rounded, pq.rest}) {
            const Split product = exact_product(part, sign * r);
            determinant.add(product.rest);
            determinant.add(product.rounded);
          }
        }
  };
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    add_products(a.exact(i), b.exact(j), c.exact(k), 1);
    add_products(a.exact(i), b.exact(k), c.exact(j), -1);
  }
  return determinant.sign();
}

/// Of the determinant with rows a, b and c; -1, 0 or 1.
int determinant_sign(const Between& a, const Between& b, const Between& c) {
  const Eigen::Vector3d u = a.rounded(), v = b.rounded(), w = c.rounded();
  double determinant = 0, size = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double plus = v[j] * w[k], minus = v[k] * w[j];
    determinant += u[i] * (plus - minus);
    size += std::abs(u[i]) * (std::abs(plus) + std::abs(minus));
  }
  // Rounding changes it by less than (7 + 56 e) e size with e = 2^-53 (Shewchuk 1997, section 4.4).
  const double error = 0x1p-50 * size;
  if (determinant > error) return 1;
  if (determinant < -error) return -1;
  // Each product has a factor 0, and a difference is rounded to 0 only if it is.
  if (size == 0) return 0;
  return exact_determinant_sign(a, b, c);
}

struct Triangle {
  std::array<std::uint32_t, 3> index = {};
  std::array<Point, 3> corner = {};
};

/// On which side of the triangle's plane the point lies.
int side(const Triangle& t, const Point& p) {
  return determinant_sign({t.corner[0], t.corner[1]}, {t.corner[0], t.corner[2]}, {t.corner[0], p});
}

/// Whether a, b, c turn left, right or not when seen along an axis.
int turn(const Point& a, const Point& b, const Point& c, int axis) {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  const Eigen::Vector3d u = Between{a, b}.rounded(), v = Between{a, c}.rounded();
  const double plus = u[j] * v[k], minus = u[k] * v[j];
  const double determinant = plus - minus;
  // As in determinant_sign; here rounding changes less than (3 + 16 e) e times the sum.
  const double error = 0x1p-51 * (std::abs(plus) + std::abs(minus));
  if (determinant > error) return 1;
  if (determinant < -error) return -1;
  if (plus == 0 && minus == 0) return 0;
  return exact_determinant_sign({a, b}, {a, c}, {Point::Zero(), Point::Unit(axis)});
}

/// An axis along which the corners do not seem to be in one line, or -1 if they are in one.
int axis_that_shows_area(const Triangle& t) {
  for (int axis = 0; axis < 3; ++axis)
    if (turn(t.corner[0], t.corner[1], t.corner[2], axis) != 0) return axis;
  return -1;
}

/// Whether a side of `s` has all of `t` strictly beyond it; both are in one plane.
bool side_parts(const Triangle& s, const Triangle& t, int axis) {
  const int inside = turn(s.corner[0], s.corner[1], s.corner[2], axis);
  for (int k = 0; k < 3; ++k) {
    const Point &from = s.corner[k], &to = s.corner[(k + 1) % 3];
    const auto beyond = [&](const Point& p) { return turn(from, to, p, axis) == -inside; };
    if (beyond(t.corner[0]) && beyond(t.corner[1]) && beyond(t.corner[2])) return true;
  }
  return false;
}

/// Whether the line from p to q, not in the plane of `t`, has a point of it; `side_p` and `side_q`
/// say where they lie.
bool pierces(const Point& p, const Point& q, int side_p, int side_q, const Triangle& t) {
  if (side_p * side_q > 0) return false;
  // The line goes through the plane in one point; it is inside if the line passes all sides of the
  // triangle on the same hand.
  bool left = false, right = false;
  for (int k = 0; k < 3; ++k) {
    const int hand = determinant_sign({p, q}, {p, t.corner[k]}, {p, t.corner[(k + 1) % 3]});
    left |= hand > 0;
    right |= hand < 0;
    if (left && right) return false;
  }
  return true;
}

/// Two triangles without a common corner.
bool strangers_meet(const Triangle& s, const Triangle& t) {
  std::array<int, 3> of_s = {}, of_t = {};
  for (int k = 0; k < 3; ++k) of_t[k] = side(s, t.corner[k]);
  if (of_t == std::array{0, 0, 0}) {
    const int axis = axis_that_shows_area(s);
    return !side_parts(s, t, axis) && !side_parts(t, s, axis);
  }
  if (std::abs(of_t[0] + of_t[1] + of_t[2]) == 3) return false;
  for (int k = 0; k < 3; ++k) of_s[k] = side(t, s.corner[k]);
  if (std::abs(of_s[0] + of_s[1] + of_s[2]) == 3) return false;
  // What they have in common ends where a side of one leaves the other. A side in the other's plane
  // may be left out: there one of the other's sides ends it too.
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    if ((of_t[k] != 0 || of_t[l] != 0) && pierces(t.corner[k], t.corner[l], of_t[k], of_t[l], s))
      return true;
    if ((of_s[k] != 0 || of_s[l] != 0) && pierces(s.corner[k], s.corner[l], of_s[k], of_s[l], t))
      return true;
  }
  return false;
}

/// Two triangles in one plane with a common corner c; s1, s2, t1, t2 are the others. Where the
/// angles at c overlap, one of their ends lies in the other.
bool angles_meet(const Point& c, const Point& s1, const Point& s2, const Point& t1, const Point& t2,
                 int axis) {
  const int s_hand = turn(c, s1, s2, axis), t_hand = turn(c, t1, t2, axis);
  const int s1_t1 = turn(c, s1, t1, axis), s1_t2 = turn(c, s1, t2, axis);
  const int s2_t1 = turn(c, s2, t1, axis), s2_t2 = turn(c, s2, t2, axis);
  const bool t1_in_s = s_hand * s1_t1 >= 0 && s_hand * s2_t1 <= 0;
  const bool t2_in_s = s_hand * s1_t2 >= 0 && s_hand * s2_t2 <= 0;
  const bool s1_in_t = t_hand * s1_t1 <= 0 && t_hand * s1_t2 >= 0;
  return t1_in_s || t2_in_s || s1_in_t;
}

/// Two triangles that share s.corner[i] = t.corner[j]. A ray from there in both triangles leaves
/// one of them through the side opposite.
bool meet_beyond_corner(const Triangle& s, int i, const Triangle& t, int j) {
  const Point &s1 = s.corner[(i + 1) % 3], &s2 = s.corner[(i + 2) % 3];
  const Point &t1 = t.corner[(j + 1) % 3], &t2 = t.corner[(j + 2) % 3];
  const int side_t1 = side(s, t1), side_t2 = side(s, t2);
  if (side_t1 * side_t2 > 0) return false;
  if (side_t1 == 0 && side_t2 == 0)
    return angles_meet(s.corner[i], s1, s2, t1, t2, axis_that_shows_area(s));
  const int side_s1 = side(t, s1), side_s2 = side(t, s2);
  return pierces(t1, t2, side_t1, side_t2, s) || pierces(s1, s2, side_s1, side_s2, t);
}

/// Two triangles that share a side; s.corner[i] and `of_t` are their other corners. They meet
/// beyond it if one is folded onto the other.
bool meet_beyond_side(const Triangle& s, int i, const Point& of_t) {
  if (side(s, of_t) != 0) return false;
  const int axis = axis_that_shows_area(s);
  Triangle other = s;
  other.corner[i] = of_t;
  return turn(s.corner[0], s.corner[1], s.corner[2], axis) ==
         turn(other.corner[0], other.corner[1], other.corner[2], axis);
}

bool intersect(const Triangle& s, const Triangle& t) {
  int shared = 0, i = 0, j = 0, sum_i = 0, sum_j = 0;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) {
      if (s.index[k] != t.index[l]) continue;
      ++shared;
      i = k;
      j = l;
      sum_i += k;
      sum_j += l;
    }
  switch (shared) {
    case 0:
      return strangers_meet(s, t);
    case 1:
      return meet_beyond_corner(s, i, t, j);
    case 2:
      return meet_beyond_side(s, 3 - sum_i, t.corner[3 - sum_j]);
    default:
      return true;
  }
}

Triangle triangle_of(const TriangleMesh& mesh, std::uint32_t t) {
  Triangle result{.index = mesh.triangles[t]};
  for (int k = 0; k < 3; ++k) result.corner[k] = mesh.vertices[result.index[k]];
  return result;
}

using Box = Eigen::AlignedBox3f;

Box box_of(const Triangle& t) {
  Box box(t.corner[0]);
  box.extend(t.corner[1]);
  box.extend(t.corner[2]);
  return box;
}

/// Each third bit of the result is one of the lowest 21 of `bits`.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 32) & 0x001f00000000ffffU;
  bits = (bits | bits << 16) & 0x001f0000ff0000ffU;
  bits = (bits | bits << 8) & 0x100f00f00f00f00fU;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3U;
  return (bits | bits << 2) & 0x1249249249249249U;
}

/// The triangles that have an area, neighbours in space near each other: along Morton's curve.
std::vector<std::uint32_t> spatial_order(const TriangleMesh& mesh) {
  struct Place {
    std::uint64_t on_curve = 0;
    std::uint32_t triangle = 0;
    bool has_area = false;
  };
  std::vector<Place> places(mesh.triangles.size());
  Eigen::AlignedBox3d bounds;
  for (const Point& v : mesh.vertices)
    if (v.allFinite()) bounds.extend(v.cast<double>());
  const double size = bounds.isEmpty() ? 0 : bounds.sizes().maxCoeff();
  const double steps = size > 0 ? 0x1p21 / size : 0;
  parallel_for(places.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto index = static_cast<std::uint32_t>(i);
      places[i].triangle = index;
      const Triangle t = triangle_of(mesh, index);
      places[i].has_area = has_area(t.corner[0], t.corner[1], t.corner[2]);
      if (!places[i].has_area) continue;
      const Eigen::Vector3d centre = box_of(t).cast<double>().center() - bounds.min();
      for (int axis = 0; axis < 3; ++axis) {
        const double step = std::clamp(centre[axis] * steps, 0.0, 0x1p21 - 1);
        places[i].on_curve |= spread(static_cast<std::uint64_t>(step)) << axis;
      }
    }
  });
  std::erase_if(places, [](const Place& p) { return !p.has_area; });
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::pair(a.on_curve, a.triangle) < std::pair(b.on_curve, b.triangle);
  });
  std::vector<std::uint32_t> order(places.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = places[i].triangle;
  return order;
}

constexpr std::size_t leaf_size = 4;  // triangles; measured: 2 to 8 take the same time

/// Boxes about `leaf_size` triangles each, about pairs of these, and so on up to one.
class BoxTree {
 public:
  BoxTree(const TriangleMesh& mesh, const std::vector<std::uint32_t>& order) {
    levels_.emplace_back((order.size() + leaf_size - 1) / leaf_size);
    parallel_for(levels_[0].size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
      for (std::size_t leaf = begin; leaf < end; ++leaf)
        for (std::size_t i = leaf * leaf_size; i < std::min((leaf + 1) * leaf_size, order.size());
             ++i)
          levels_[0][leaf].extend(box_of(triangle_of(mesh, order[i])));
    });
    while (levels_.back().size() > 1) {
      const std::vector<Box>& below = levels_.back();
      std::vector<Box> level((below.size() + 1) / 2);
      for (std::size_t i = 0; i < below.size(); ++i) level[i / 2].extend(below[i]);
      levels_.push_back(std::move(level));
    }
  }

  std::size_t leaves() const { return levels_[0].size(); }

  /// Calls found(other) for each leaf from `leaf` on whose box meets that of `leaf`.
  template <class Found>
  void for_each_neighbour(std::size_t leaf, const Found& found) const {
    descend(levels_.size() - 1, 0, leaf, found);
  }

 private:
  template <class Found>
  void descend(std::size_t level, std::size_t node, std::size_t leaf, const Found& found) const {
    const bool before = (node + 1) << level <= leaf;
    if (before || !levels_[level][node].intersects(levels_[0][leaf])) return;
    if (level == 0) return found(node);
    descend(level - 1, 2 * node, leaf, found);
    if (2 * node + 1 < levels_[level - 1].size()) descend(level - 1, 2 * node + 1, leaf, found);
  }

  std::vector<std::vector<Box>> levels_ = {};
};

/// Those of one leaf, and what they are compared with.
struct Leaf {
  std::array<Triangle, leaf_size> triangles = {};
  std::array<Box, leaf_size> boxes = {};
  std::size_t size = 0;
};

Leaf leaf_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& order, std::size_t leaf) {
  Leaf result;
  for (std::size_t i = leaf * leaf_size; i < std::min((leaf + 1) * leaf_size, order.size()); ++i) {
    result.triangles[result.size] = triangle_of(mesh, order[i]);
    result.boxes[result.size] = box_of(result.triangles[result.size]);
    ++result.size;
  }
  return result;
}

}  // namespace

bool has_area(const Point& a, const Point& b, const Point& c) {
  return a.allFinite() && b.allFinite() && c.allFinite() &&
         axis_that_shows_area({.index = {}, .corner = {a, b, c}}) >= 0;
}

std::size_t count_self_intersections(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> order = spatial_order(mesh);
  const BoxTree tree(mesh, order);
  constexpr std::size_t grain = 256;  // leaves
  std::vector<std::size_t> counts((tree.leaves() + grain - 1) / grain, 0);
  parallel_for(tree.leaves(), grain, [&](std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    for (std::size_t leaf = begin; leaf < end; ++leaf) {
      const Leaf ours = leaf_of(mesh, order, leaf);
      tree.for_each_neighbour(leaf, [&](std::size_t other) {
        const Leaf theirs = leaf_of(mesh, order, other);
        for (std::size_t a = 0; a < ours.size; ++a)
          for (std::size_t b = other == leaf ? a + 1 : 0; b < theirs.size; ++b)
            if (ours.boxes[a].intersects(theirs.boxes[b]) &&
                intersect(ours.triangles[a], theirs.triangles[b]))
              ++count;
      });
    }
    counts[begin / grain] = count;
  });
  return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

}  // namespace minescan
