// SPDX-License-Identifier: MIT
#include "registration/ndt_sums.h"

#include <algorithm>
#include <array>

// This file is compiled once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "registration/ndt_sums.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#ifndef MINESCAN_NDT_SUMS
#define MINESCAN_NDT_SUMS
namespace minescan {

// Points worked on together, in one register or several: each has sums of its own, so that the
// order of additions does not depend on the width of the registers.
constexpr std::size_t field_lanes = 16;
// Points whose terms are added in single precision before the sums go on in double.
constexpr std::size_t field_block = 2048;

// Beyond it a density is below the smallest normal float; the plain form goes to 120.
constexpr float max_exponent = 80;

/// What one pass over the points yields: value, gradient, the sum of J^T A J, and for `information`
/// the sum of w u and a second sum of J^T A J, that of the surface.
struct FieldSums {
  std::array<double, 1 + 6 + 21 + 1 + 21> sum = {};
  std::size_t met = 0;
};
enum class FieldTerms { value, newton, gauss_newton, information };

}  // namespace minescan
#endif

HWY_BEFORE_NAMESPACE();
namespace minescan {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Float = hn::CappedTag<float, field_lanes>;
using Integer = hn::RebindToSigned<Float>;
using V = hn::Vec<Float>;
using I = hn::Vec<Integer>;
constexpr std::size_t registers = field_lanes / hn::MaxLanes(Float());

HWY_INLINE V cross_part(V a, V b, V c, V d) { return hn::NegMulAdd(c, d, hn::Mul(a, b)); }  // ab-cd

/// Sum of J^T A J for symmetric 3 x 3 matrices A, with J = [I | -[y]x], in 21 numbers: `tt` and
/// `ww` are xx, xy, xz, yy, yz, zz, row i of `tw` is y x (row i of A).
struct SymmetricSum {
  V tt[6], tw[9], ww[6];

  HWY_INLINE SymmetricSum() {
    const V zero = hn::Zero(Float());
    for (V& v : tt) v = zero;
    for (V& v : tw) v = zero;
    for (V& v : ww) v = zero;
  }
  HWY_INLINE void add(const V* a, const V* y) {
    for (int i = 0; i < 6; ++i) tt[i] = hn::Add(tt[i], a[i]);
    // Rows of B = A (-[y]x): y crossed with each row of A.
    constexpr int row[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    V b[3][3];
    for (int i = 0; i < 3; ++i) {
      const V ax = a[row[i][0]], ay = a[row[i][1]], az = a[row[i][2]];
      b[i][0] = cross_part(y[1], az, y[2], ay);
      b[i][1] = cross_part(y[2], ax, y[0], az);
      b[i][2] = cross_part(y[0], ay, y[1], ax);
      for (int j = 0; j < 3; ++j) tw[3 * i + j] = hn::Add(tw[3 * i + j], b[i][j]);
    }
    // [y]x B, the upper triangle.
    ww[0] = hn::Add(ww[0], cross_part(y[1], b[2][0], y[2], b[1][0]));
    ww[1] = hn::Add(ww[1], cross_part(y[1], b[2][1], y[2], b[1][1]));
    ww[2] = hn::Add(ww[2], cross_part(y[1], b[2][2], y[2], b[1][2]));
    ww[3] = hn::Add(ww[3], cross_part(y[2], b[0][1], y[0], b[2][1]));
    ww[4] = hn::Add(ww[4], cross_part(y[2], b[0][2], y[0], b[2][2]));
    ww[5] = hn::Add(ww[5], cross_part(y[0], b[1][2], y[1], b[0][2]));
  }
};

/// Sums of one block, in single precision.
struct BlockSums {
  V value = hn::Zero(Float()), squares = hn::Zero(Float()), g[6];
  SymmetricSum hessian, surface;

  HWY_INLINE BlockSums() {
    for (V& v : g) v = hn::Zero(Float());
  }
};

HWY_INLINE double sum_of_lanes(V v) {
  const Float d;
  HWY_ALIGN float lane[field_lanes] = {};
  hn::Store(v, d, lane);
  double sum = 0;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) sum += static_cast<double>(lane[i]);
  return sum;
}

HWY_INLINE void add(const SymmetricSum& block, double* sum) {
  for (const V& v : block.tt) *sum++ += sum_of_lanes(v);
  for (const V& v : block.tw) *sum++ += sum_of_lanes(v);
  for (const V& v : block.ww) *sum++ += sum_of_lanes(v);
}

/// Four numbers that stand together in the rows that begin at base[0], base[1], ..., `from` being
/// where they stand in row 0: one vector per number. Turned in registers, four rows to a part of
/// 128 bits: instructions that gather take three times as long and more.
HWY_INLINE void load_four(const float* from, const std::int32_t* base, V (&number)[4]) {
  const Float d;
#if HWY_TARGET == HWY_SCALAR
  for (int k = 0; k < 4; ++k) number[k] = hn::Set(d, from[base[0] + k]);
#else
  const std::size_t parts = hn::Lanes(d) / 4;
  V row[4];  // part p of row[j]: the numbers of row 4 p + j
  for (std::size_t j = 0; j < 4; ++j) {
    row[j] = hn::LoadDup128(d, from + base[4 * (parts - 1) + j]);
    for (std::size_t p = parts - 1; p-- > 0;)
      row[j] = hn::IfThenElse(hn::FirstN(d, 4 * (p + 1)), hn::LoadDup128(d, from + base[4 * p + j]),
                              row[j]);
  }
  const hn::Repartition<double, Float> pairs;
  const auto low = [&](V a, V b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveLower(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const auto high = [&](V a, V b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveUpper(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const V first_low = hn::InterleaveLower(d, row[0], row[1]),
          first_high = hn::InterleaveUpper(d, row[0], row[1]),
          second_low = hn::InterleaveLower(d, row[2], row[3]),
          second_high = hn::InterleaveUpper(d, row[2], row[3]);
  number[0] = low(first_low, second_low);
  number[1] = high(first_low, second_low);
  number[2] = low(first_high, second_high);
  number[3] = high(first_high, second_high);
#endif
}

/// The points of a block that meet a distribution, one after the other.
struct MetPoints {
  // y = R x, turned and not shifted, and where the row begins; as many as a block has and the rest
  // of a register.
  HWY_ALIGN float y[3][field_block + field_lanes];
  HWY_ALIGN std::int32_t base[field_block + field_lanes];
  // Of a trilinear field only: the weight along each axis.
  HWY_ALIGN float weight[3][field_block + field_lanes];
  std::size_t count = 0;
};

/// The trilinear weight of a field's corner, and its derivatives along the axes, times the density
/// that it weighs.
struct Weights {
  V all, slope[3];
  V bend[3];  // [i]: by the two other axes than i

  HWY_INLINE Weights() {}
  HWY_INLINE Weights(const NdtField& field, const MetPoints& met, std::size_t at, V density) {
    const Float d;
    V part[3], sign[3];
    for (int i = 0; i < 3; ++i) {
      part[i] = hn::LoadU(d, met.weight[i] + at);
      const bool after = (field.trilinear_corner >> i & 1) != 0;
      sign[i] = hn::Set(d, static_cast<float>((after ? 1 : -1) / field.side));
    }
    all = hn::Mul(hn::Mul(part[0], part[1]), part[2]);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      slope[i] = hn::Mul(hn::Mul(density, sign[i]), hn::Mul(part[j], part[k]));
      bend[i] = hn::Mul(hn::Mul(density, part[i]), hn::Mul(sign[j], sign[k]));
    }
  }
};

/// T in single precision, for the coordinates of a field.
struct Motion {
  V R[3][3], t[3];

  HWY_INLINE Motion(const NdtField& field, const Pose& T) {
    const Float d;
    const Eigen::Matrix3d rotation = T.linear();
    const Eigen::Vector3d shift = T.translation() - field.corner;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) R[i][j] = hn::Set(d, static_cast<float>(rotation(i, j)));
      t[i] = hn::Set(d, static_cast<float>(shift[i]));
    }
  }
};

/// Of a field with means: gives points that are inside and have no row yet that of the nearest.
/// What it makes of the numbers of others does not matter.
HWY_INLINE void take_nearest(const NdtField& field, const Motion& motion, const V* y,
                             hn::Mask<Float> inside, I& number) {
  const Float d;
  const Integer di;
  HWY_ALIGN float at[3][field_lanes];
  HWY_ALIGN std::int32_t numbers[field_lanes];
  for (int i = 0; i < 3; ++i) hn::Store(hn::Add(y[i], motion.t[i]), d, at[i]);
  hn::Store(hn::IfThenElseZero(hn::RebindMask(di, inside), number), di, numbers);
  for (std::size_t i = 0; i < hn::Lanes(di); ++i)
    if (numbers[i] < 0)
      numbers[i] = field.nearest_row({double{at[0][i]}, double{at[1][i]}, double{at[2][i]}});
  number = hn::Load(di, numbers);
}

/// Turns the points from `begin` to `end` and keeps those that meet a distribution.
HWY_INLINE void meet(const NdtField& field, const Motion& motion, const PackedPoints& points,
                     std::size_t begin, std::size_t end, MetPoints& met) {
  const Float d;
  const Integer di;
  constexpr std::int32_t row_floats = sizeof(NdtField::Row) / sizeof(float);
  const V zero = hn::Zero(d), half = hn::Set(d, 0.5f), beyond = hn::Set(d, nowhere / 2);
  const V per_side = hn::Set(d, static_cast<float>(1 / field.side));
  const V limit[3] = {hn::Set(d, static_cast<float>(field.size[0])),
                      hn::Set(d, static_cast<float>(field.size[1])),
                      hn::Set(d, static_cast<float>(field.size[2]))};
  const I size_x = hn::Set(di, field.size[0]), size_y = hn::Set(di, field.size[1]);
  met.count = 0;
  for (std::size_t at = begin; at < end; at += hn::Lanes(d)) {
    const V p[3] = {hn::LoadU(d, points.x() + at), hn::LoadU(d, points.y() + at),
                    hn::LoadU(d, points.z() + at)};
    // Padding stays outside: it is further away than any point can be.
    auto inside = hn::Lt(p[0], beyond);
    V y[3], weight[3] = {zero, zero, zero};
    I index[3];
    for (int i = 0; i < 3; ++i) {
      y[i] = hn::MulAdd(motion.R[i][2], p[2],
                        hn::MulAdd(motion.R[i][1], p[1], hn::Mul(motion.R[i][0], p[0])));
      V cell = hn::Mul(hn::Add(y[i], motion.t[i]), per_side);
      if (field.trilinear_corner >= 0) {
        // Of the two centres on either side the one before or the one after.
        const V from_centre = hn::Sub(cell, half);
        const V before = hn::Floor(from_centre);
        const V part = hn::Sub(from_centre, before);
        const bool after = (field.trilinear_corner >> i & 1) != 0;
        cell = after ? hn::Add(before, hn::Set(d, 1)) : before;
        weight[i] = after ? part : hn::Sub(hn::Set(d, 1), part);
      }
      if (field.endless)
        cell = hn::Min(hn::Max(cell, zero), hn::Sub(limit[i], half));
      else
        inside = hn::And(inside, hn::And(hn::Ge(cell, zero), hn::Lt(cell, limit[i])));
      index[i] = hn::ConvertTo(di, hn::IfThenElseZero(inside, cell));
    }
    if (hn::AllFalse(d, inside)) continue;
    // Lanes that left the box after the first axis look at a cell of it that does not matter.
    const I place = hn::IfThenElseZero(
        hn::RebindMask(di, inside),
        hn::Add(hn::Mul(hn::Add(hn::Mul(index[2], size_y), index[1]), size_x), index[0]));
    I number;
    if (field.stored) {
      HWY_ALIGN std::int32_t one_by_one[field_lanes];
      hn::Store(place, di, one_by_one);
      for (std::size_t i = 0; i < hn::Lanes(di); ++i)
        one_by_one[i] = field.stored->find(one_by_one[i]);
      number = hn::Load(di, one_by_one);
    } else {
      number = hn::GatherIndex(di, field.number.data(), place);
    }
    if (field.means) take_nearest(field, motion, y, inside, number);
    const auto meets = hn::And(inside, hn::RebindMask(d, hn::Gt(number, hn::Set(di, -1))));
    // Whole registers: instructions that compress into memory take AMD's Zen 4 a hundred cycles.
    for (int i = 0; i < 3; ++i) hn::StoreU(hn::Compress(y[i], meets), d, met.y[i] + met.count);
    if (field.trilinear_corner >= 0)
      for (int i = 0; i < 3; ++i)
        hn::StoreU(hn::Compress(weight[i], meets), d, met.weight[i] + met.count);
    hn::StoreU(hn::Compress(hn::Mul(number, hn::Set(di, row_floats)), hn::RebindMask(di, meets)),
               di, met.base + met.count);
    met.count += hn::CountTrue(d, meets);
  }
}

/// `special`: of a field with a reach or with heights of its rows.
template <FieldTerms terms, bool special>
FieldSums Sum(const NdtField& field, const Pose& T, const PackedPoints& points) {
  const Float d;
  const Motion motion(field, T);
  const float* const rows = field.rows.front().mean;
  const auto unmet =
      static_cast<std::int32_t>((field.rows.size() - 1) * sizeof(NdtField::Row) / sizeof(float));
  const V half = hn::Set(d, 0.5f), farthest = hn::Set(d, max_exponent);
  const V reach_squared = hn::Set(d, static_cast<float>(field.reach * field.reach));

  FieldSums result;
  MetPoints met;
  for (std::size_t begin = 0; begin < points.padded_size(); begin += field_block) {
    meet(field, motion, points, begin, std::min(begin + field_block, points.padded_size()), met);
    result.met += met.count;
    const std::size_t end = (met.count + field_lanes - 1) / field_lanes * field_lanes;
    for (std::size_t i = met.count; i < end; ++i) {
      for (float* y : {met.y[0], met.y[1], met.y[2]}) y[i] = 0;
      met.base[i] = unmet;
      for (float* weight : {met.weight[0], met.weight[1], met.weight[2]}) weight[i] = 0;
    }
    BlockSums sums_of[registers];
    for (std::size_t at = 0; at < end; at += hn::Lanes(d)) {
      BlockSums& sums = sums_of[at / hn::Lanes(d) % registers];
      const V y[3] = {hn::LoadU(d, met.y[0] + at), hn::LoadU(d, met.y[1] + at),
                      hn::LoadU(d, met.y[2] + at)};
      // NdtField::Row in three parts: the mean and the first of L, four of L, the last and a
      // normal.
      V row[3][4];
      for (int i = 0; i < 3; ++i) load_four(rows + 4 * i, met.base + at, row[i]);
      const V L[6] = {row[0][3], row[1][0], row[1][1], row[1][2], row[1][3], row[2][0]};
      V x[3];
      for (int i = 0; i < 3; ++i)  // paper, eq. 7
        x[i] = hn::Sub(hn::Add(y[i], motion.t[i]), row[0][i]);
      const V v[3] = {hn::MulAdd(L[2], x[2], hn::MulAdd(L[1], x[1], hn::Mul(L[0], x[0]))),
                      hn::MulAdd(L[4], x[2], hn::MulAdd(L[3], x[1], hn::Mul(L[1], x[0]))),
                      hn::MulAdd(L[5], x[2], hn::MulAdd(L[4], x[1], hn::Mul(L[2], x[0])))};
      const V exponent =
          hn::Mul(half, hn::MulAdd(x[2], v[2], hn::MulAdd(x[1], v[1], hn::Mul(x[0], v[0]))));
      const V near = hn::Min(exponent, farthest);
      V w = hn::IfThenElseZero(hn::Lt(exponent, farthest), hn::Exp(d, hn::Neg(near)));  // eq. 4
      if (special && field.row_heights) {
        V last[4];
        load_four(rows + 12, met.base + at, last);
        w = hn::Mul(w, last[0]);
      }
      if (special && field.reach > 0) {
        const V squared = hn::MulAdd(x[2], x[2], hn::MulAdd(x[1], x[1], hn::Mul(x[0], x[0])));
        w = hn::IfThenElseZero(hn::Le(squared, reach_squared), w);
      }
      Weights weights;
      if (field.trilinear_corner >= 0) {
        weights = Weights(field, met, at, w);
        w = hn::Mul(w, weights.all);
      }
      sums.value = hn::Sub(sums.value, w);
      if (terms == FieldTerms::value) continue;

      const V density_v[3] = {hn::Mul(w, v[0]), hn::Mul(w, v[1]), hn::Mul(w, v[2])};
      V wv[3] = {density_v[0], density_v[1], density_v[2]};
      if (field.weights_change && field.trilinear_corner >= 0)
        for (int i = 0; i < 3; ++i) wv[i] = hn::Sub(wv[i], weights.slope[i]);
      for (int i = 0; i < 3; ++i) sums.g[i] = hn::Add(sums.g[i], wv[i]);
      sums.g[3] = hn::Add(sums.g[3], cross_part(y[1], wv[2], y[2], wv[1]));
      sums.g[4] = hn::Add(sums.g[4], cross_part(y[2], wv[0], y[0], wv[2]));
      sums.g[5] = hn::Add(sums.g[5], cross_part(y[0], wv[1], y[1], wv[0]));

      constexpr int first[6] = {0, 0, 0, 1, 1, 2}, second[6] = {0, 1, 2, 1, 2, 2};
      V a[6];
      for (int i = 0; i < 6; ++i) a[i] = hn::Mul(w, L[i]);
      // J^T C^-1 J - h h^T = J^T (C^-1 - v v^T) J, since h = J^T v.
      if (terms == FieldTerms::newton) {
        for (int i = 0; i < 6; ++i) a[i] = hn::NegMulAdd(density_v[first[i]], v[second[i]], a[i]);
        if (field.weights_change && field.trilinear_corner >= 0)
          for (int i = 0; i < 6; ++i) {
            const int k = first[i], l = second[i];
            a[i] = hn::MulAdd(weights.slope[k], v[l], hn::MulAdd(v[k], weights.slope[l], a[i]));
            if (k != l) a[i] = hn::Sub(a[i], weights.bend[3 - k - l]);
          }
      }
      sums.hessian.add(a, y);
      if (terms == FieldTerms::information) {
        sums.squares = hn::MulAdd(w, near, sums.squares);
        const V* const n = row[2] + 1;
        for (int i = 0; i < 6; ++i) a[i] = hn::Mul(w, hn::Mul(n[first[i]], n[second[i]]));
        sums.surface.add(a, y);
      }
      if (terms == FieldTerms::newton) {
        V* const ww = sums.hessian.ww;
        // The second derivatives of x': (v y^T + y v^T) / 2 - (v.y) I.
        const V s[3] = {hn::Mul(wv[0], y[0]), hn::Mul(wv[1], y[1]), hn::Mul(wv[2], y[2])};
        ww[0] = hn::Sub(ww[0], hn::Add(s[1], s[2]));
        ww[3] = hn::Sub(ww[3], hn::Add(s[0], s[2]));
        ww[5] = hn::Sub(ww[5], hn::Add(s[0], s[1]));
        const auto mixed = [&](int i, int j) HWY_ATTR {
          return hn::Mul(half, hn::MulAdd(wv[i], y[j], hn::Mul(wv[j], y[i])));
        };
        ww[1] = hn::Add(ww[1], mixed(0, 1));
        ww[2] = hn::Add(ww[2], mixed(0, 2));
        ww[4] = hn::Add(ww[4], mixed(1, 2));
      }
    }
    for (const BlockSums& sums : sums_of) {
      std::size_t k = 0;
      result.sum[k++] += sum_of_lanes(sums.value);
      if (terms == FieldTerms::value) continue;
      for (const V& v : sums.g) result.sum[k++] += sum_of_lanes(v);
      add(sums.hessian, result.sum.data() + k);
      if (terms != FieldTerms::information) continue;
      k += 21;
      result.sum[k++] += 2 * sum_of_lanes(sums.squares);  // the exponent is half of it
      add(sums.surface, result.sum.data() + k);
    }
  }
  for (double& x : result.sum) x *= field.height;
  return result;
}

template <FieldTerms terms>
FieldSums SumOfAny(const NdtField& field, const Pose& T, const PackedPoints& points) {
  return field.row_heights || field.reach > 0 ? Sum<terms, true>(field, T, points)
                                              : Sum<terms, false>(field, T, points);
}
FieldSums SumValue(const NdtField& field, const Pose& T, const PackedPoints& points) {
  return SumOfAny<FieldTerms::value>(field, T, points);
}
FieldSums SumNewton(const NdtField& field, const Pose& T, const PackedPoints& points) {
  return SumOfAny<FieldTerms::newton>(field, T, points);
}
FieldSums SumGaussNewton(const NdtField& field, const Pose& T, const PackedPoints& points) {
  return SumOfAny<FieldTerms::gauss_newton>(field, T, points);
}
FieldSums SumInformation(const NdtField& field, const Pose& T, const PackedPoints& points) {
  return SumOfAny<FieldTerms::information>(field, T, points);
}

}  // namespace HWY_NAMESPACE
}  // namespace minescan
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace minescan {

HWY_EXPORT(SumValue);
HWY_EXPORT(SumNewton);
HWY_EXPORT(SumGaussNewton);
HWY_EXPORT(SumInformation);

namespace {

/// Of 21 numbers.
Matrix6d matrix_of(const double* a) {
  const double* const b = a + 6;
  const double* const c = b + 9;
  Matrix6d H;
  H.topLeftCorner<3, 3>() << a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5];
  H.topRightCorner<3, 3>() << b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8];
  H.bottomLeftCorner<3, 3>() = H.topRightCorner<3, 3>().transpose();
  H.bottomRightCorner<3, 3>() << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return H;
}

}  // namespace

PackedPoints::PackedPoints(const std::vector<Eigen::Vector3d>& points) : size_(points.size()) {
  const std::size_t padded = (size_ + field_lanes - 1) / field_lanes * field_lanes;
  for (std::vector<float>* list : {&x_, &y_, &z_}) list->assign(padded, nowhere);
  for (std::size_t i = 0; i < size_; ++i) {
    x_[i] = static_cast<float>(points[i].x());
    y_[i] = static_cast<float>(points[i].y());
    z_[i] = static_cast<float>(points[i].z());
  }
}

Score ndt_score(const NdtField& field, const Pose& T_target_source, const PackedPoints& points,
                Curvature curvature) {
  const FieldSums sums = curvature == Curvature::full
                             ? HWY_DYNAMIC_DISPATCH(SumNewton)(field, T_target_source, points)
                             : HWY_DYNAMIC_DISPATCH(SumGaussNewton)(field, T_target_source, points);
  Score score{.value = sums.sum[0], .met = sums.met};
  for (std::size_t i = 0; i < 6; ++i) score.gradient[static_cast<int>(i)] = sums.sum[1 + i];
  score.hessian = matrix_of(sums.sum.data() + 7);
  return score;
}

double ndt_value(const NdtField& field, const Pose& T_target_source, const PackedPoints& points) {
  return HWY_DYNAMIC_DISPATCH(SumValue)(field, T_target_source, points).sum[0];
}

NdtInformation ndt_information(const NdtField& field, const Pose& T_target_source,
                               const PackedPoints& points) {
  const FieldSums sums = HWY_DYNAMIC_DISPATCH(SumInformation)(field, T_target_source, points);
  return {.gauss_newton = matrix_of(sums.sum.data() + 7),
          .surface = matrix_of(sums.sum.data() + 29),
          .weights = -sums.sum[0],
          .squares = sums.sum[28]};
}

}  // namespace minescan
#endif
