// SPDX-License-Identifier: MIT
#include "registration/kdtree_packet.h"

#include <algorithm>

// This file is compiled once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "registration/kdtree_packet.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace minescan {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Double = hn::CappedTag<double, KdPacket::size>;
using V = hn::Vec<Double>;
constexpr std::size_t width = hn::MaxLanes(Double());
constexpr std::size_t registers = KdPacket::size / width;

/// A number of each query.
struct Lanes {
  V v[registers];

  HWY_INLINE static Lanes load(const double* from) {
    Lanes lanes;
    for (std::size_t r = 0; r < registers; ++r) lanes.v[r] = hn::LoadU(Double(), from + r * width);
    return lanes;
  }
  HWY_INLINE void store(double* to) const {
    for (std::size_t r = 0; r < registers; ++r) hn::StoreU(v[r], Double(), to + r * width);
  }
};

HWY_INLINE bool any_below(const Lanes& a, const Lanes& b) {
  auto below = hn::Lt(a.v[0], b.v[0]);
  for (std::size_t r = 1; r < registers; ++r) below = hn::Or(below, hn::Lt(a.v[r], b.v[r]));
  return !hn::AllFalse(Double(), below);
}

HWY_INLINE bool most_below(const Lanes& a, const Lanes& b) {
  std::size_t count = 0;
  for (std::size_t r = 0; r < registers; ++r)
    count += hn::CountTrue(Double(), hn::Lt(a.v[r], b.v[r]));
  return 2 * count > KdPacket::size;
}

// In the order in which KdTree adds, those to boxes as well as those to points: rounding is
// monotonic, so that a box is never further away than a point in it, not even by a bit.
HWY_INLINE V sum_of_squares(V x, V y, V z) {
  return hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
}

HWY_INLINE Lanes squared_distances(const Lanes (&query)[3], const KdBox& box) {
  Lanes squared;
  for (std::size_t r = 0; r < registers; ++r) {
    V side[3];
    for (int i = 0; i < 3; ++i) {
      const V before = hn::Sub(hn::Set(Double(), double{box.low[i]}), query[i].v[r]);
      const V beyond = hn::Sub(query[i].v[r], hn::Set(Double(), double{box.high[i]}));
      side[i] = hn::Max(hn::Max(before, beyond), hn::Zero(Double()));
    }
    squared.v[r] = sum_of_squares(side[0], side[1], side[2]);
  }
  return squared;
}

void Search(const KdArrays& tree, KdPacket& packet) {
  const Lanes query[3] = {Lanes::load(packet.x), Lanes::load(packet.y), Lanes::load(packet.z)};
  Lanes nearest = Lanes::load(packet.nearest), rest = Lanes::load(packet.rest);
  Lanes place = Lanes::load(packet.place);
  const auto scan = [&](const KdNode& leaf) HWY_ATTR {
    const double* group = tree.xyz + 3 * leaf.second_or_begin;
    V here = hn::Set(Double(), static_cast<double>(leaf.second_or_begin));
    for (std::size_t left = leaf.count; left > 0; group += 3 * KdArrays::group) {
      const std::size_t points = std::min(left, KdArrays::group);
      left -= points;
      for (std::size_t i = 0; i < points; ++i) {
        const V x = hn::Set(Double(), group[i]);
        const V y = hn::Set(Double(), group[i + KdArrays::group]);
        const V z = hn::Set(Double(), group[i + 2 * KdArrays::group]);
        for (std::size_t r = 0; r < registers; ++r) {
          const V squared = sum_of_squares(hn::Sub(x, query[0].v[r]), hn::Sub(y, query[1].v[r]),
                                           hn::Sub(z, query[2].v[r]));
          rest.v[r] = hn::Min(rest.v[r], hn::Max(nearest.v[r], squared));
          place.v[r] = hn::IfThenElse(hn::Lt(squared, nearest.v[r]), here, place.v[r]);
          nearest.v[r] = hn::Min(nearest.v[r], squared);
        }
        here = hn::Add(here, hn::Set(Double(), 1.0));
      }
    }
  };
  struct Waiting {
    double squared[KdPacket::size];
    std::uint32_t node;
  };
  Waiting waiting[kd_levels];  // each level leaves one node
  std::size_t count = 0;
  std::uint32_t at = 0;
  if (!any_below(squared_distances(query, tree.boxes[0]), rest)) return;
  for (;;) {
    while (tree.nodes[at].axis >= 0) {
      const std::uint32_t first = at + 1, second = tree.nodes[at].second_or_begin;
      const Lanes to_first = squared_distances(query, tree.boxes[first]);
      const Lanes to_second = squared_distances(query, tree.boxes[second]);
      const bool reaches_first = any_below(to_first, rest);
      const bool reaches_second = any_below(to_second, rest);
      if (!reaches_first && !reaches_second) break;
      const bool first_is_next =
          reaches_first && !(reaches_second && most_below(to_second, to_first));
      if (reaches_first && reaches_second) {
        (first_is_next ? to_second : to_first).store(waiting[count].squared);
        waiting[count++].node = first_is_next ? second : first;
      }
      at = first_is_next ? first : second;
    }
    if (tree.nodes[at].axis < 0) scan(tree.nodes[at]);
    do {
      if (count == 0) {
        nearest.store(packet.nearest);
        rest.store(packet.rest);
        place.store(packet.place);
        return;
      }
      --count;
    } while (!any_below(Lanes::load(waiting[count].squared), rest));
    at = waiting[count].node;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace minescan
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace minescan {

HWY_EXPORT(Search);

void search_packet(const KdArrays& tree, KdPacket& packet) {
  HWY_DYNAMIC_DISPATCH(Search)(tree, packet);
}

}  // namespace minescan
#endif
