// SPDX-License-Identifier: MIT
#include "sim/vector_math.h"

#include <numbers>

#include "core/gradient_noise.h"

// This file is compiled once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/vector_math.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace minescan {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Float = hn::CappedTag<float, lanes>;
using Vector = hn::Vec<Float>;

constexpr float pi = std::numbers::pi_v<float>;

void SineCosine(const float* angle, float* sine, float* cosine, std::size_t count) {
  const Float d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const Vector x = hn::LoadU(d, angle + i);
    hn::StoreU(hn::Sin(d, x), d, sine + i);
    hn::StoreU(hn::Cos(d, x), d, cosine + i);
  }
}

void ArcTangent(const float* y, const float* x, float* angle, std::size_t count) {
  const Float d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const Vector vy = hn::LoadU(d, y + i);
    const Vector vx = hn::LoadU(d, x + i);
    const Vector ay = hn::Abs(vy);
    const Vector ax = hn::Abs(vx);
    const Vector high = hn::Max(ax, ay);
    const Vector ratio =
        hn::IfThenElseZero(hn::Gt(high, hn::Zero(d)), hn::Div(hn::Min(ax, ay), high));
    Vector a = hn::Atan(d, ratio);
    a = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(hn::Set(d, pi / 2), a), a);
    a = hn::IfThenElse(hn::Lt(vx, hn::Zero(d)), hn::Sub(hn::Set(d, pi), a), a);
    hn::StoreU(hn::CopySignToAbs(a, vy), d, angle + i);
  }
}

void ArcCosine(const float* x, float* angle, std::size_t count) {
  const Float d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d))
    hn::StoreU(hn::Acos(d, hn::LoadU(d, x + i)), d, angle + i);
}

void ExponentialMinus1(const float* x, float* result, std::size_t count) {
  const Float d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d))
    hn::StoreU(hn::Expm1(d, hn::LoadU(d, x + i)), d, result + i);
}

// Philox4x32-10 (Salmon et al. 2011), a number of 32 bits in each lane of 64. Test: the same bits
// as Random.
void FourNormals(std::uint64_t seed, const std::array<std::uint64_t, lanes>& streams,
                 std::uint64_t block, std::array<Lanes, 4>& result) {
  const hn::CappedTag<std::uint64_t, lanes> d;
  using V = hn::Vec<decltype(d)>;
  const V low = hn::Set(d, 0xffffffff);
  const V m0 = hn::Set(d, 0xD2511F53), m1 = hn::Set(d, 0xCD9E8D57);
  const auto product = [&](V a, V b) {
#if HWY_TARGET == HWY_SCALAR
    return hn::Set(d, (hn::GetLane(a) & 0xffffffff) * hn::GetLane(b));
#else
    const hn::Repartition<std::uint32_t, decltype(d)> halves;
    return hn::MulEven(hn::BitCast(halves, a), hn::BitCast(halves, b));
#endif
  };
  alignas(64) std::array<std::array<std::uint64_t, lanes>, 4> words;
  for (std::size_t i = 0; i < lanes; i += hn::Lanes(d)) {
    const V stream = hn::LoadU(d, streams.data() + i);
    V c0 = hn::Set(d, block & 0xffffffff);
    V c1 = hn::Set(d, block >> 32);
    V c2 = hn::And(stream, low);
    V c3 = hn::ShiftRight<32>(stream);
    auto k0 = static_cast<std::uint32_t>(seed);
    auto k1 = static_cast<std::uint32_t>(seed >> 32);
    for (int round = 0; round < 10; ++round) {
      const V p0 = product(c0, m0);
      const V p1 = product(c2, m1);
      // Their upper halves are anything from here on: products read the lower ones only.
      c0 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p1), c1), hn::Set(d, std::uint64_t{k0}));
      c2 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p0), c3), hn::Set(d, std::uint64_t{k1}));
      c1 = p1;
      c3 = p0;
      k0 += 0x9E3779B9;
      k1 += 0xBB67AE85;
    }
    hn::Store(hn::And(c0, low), d, words[0].data() + i);
    hn::Store(hn::And(c1, low), d, words[1].data() + i);
    hn::Store(hn::And(c2, low), d, words[2].data() + i);
    hn::Store(hn::And(c3, low), d, words[3].data() + i);
  }
  const Float f;
  Lanes radius_part, angle_part;
  for (std::size_t pair = 0; pair < 2; ++pair) {
    for (std::size_t i = 0; i < lanes; ++i) {
      // Middles of 2^24 equal steps, exact in single precision: never 0, so the logarithm is
      // finite.
      radius_part[i] =
          (static_cast<float>(static_cast<std::int32_t>(words[2 * pair + 1][i] >> 8)) + 0.5f) *
          0x1.0p-24f;
      angle_part[i] =
          (static_cast<float>(static_cast<std::int32_t>(words[2 * pair][i] >> 8)) + 0.5f) *
          0x1.0p-24f;
    }
    for (std::size_t i = 0; i < lanes; i += hn::Lanes(f)) {
      const Vector u = hn::LoadU(f, radius_part.data() + i);
      const Vector radius = hn::Sqrt(hn::Mul(hn::Set(f, -2), hn::Log(f, u)));
      const Vector angle = hn::Mul(hn::Set(f, 2 * pi), hn::LoadU(f, angle_part.data() + i));
      hn::StoreU(hn::Mul(radius, hn::Cos(f, angle)), f, result[2 * pair].data() + i);
      hn::StoreU(hn::Mul(radius, hn::Sin(f, angle)), f, result[2 * pair + 1].data() + i);
    }
  }
}

void Product(const MatrixLanes& matrix, const VectorLanes& v, VectorLanes& result) {
  const hn::CappedTag<double, lanes> d;
  using V = hn::Vec<decltype(d)>;
  for (std::size_t i = 0; i < lanes; i += hn::Lanes(d)) {
    const V x = hn::LoadU(d, &v[0][i]), y = hn::LoadU(d, &v[1][i]), z = hn::LoadU(d, &v[2][i]);
    for (std::size_t k = 0; k < 3; ++k) {
      const VectorLanes& row = matrix.row[k];
      const V a = hn::Mul(hn::LoadU(d, &row[0][i]), x), b = hn::Mul(hn::LoadU(d, &row[1][i]), y),
              c = hn::Mul(hn::LoadU(d, &row[2][i]), z);
      // In the order in which Eigen adds.
      const V sum = k < 2 ? hn::Add(hn::Add(a, b), c) : hn::Add(a, hn::Add(b, c));
      hn::StoreU(sum, d, &result[k][i]);
    }
  }
}

void MeetPlanes(const RayPacket& rays, const Corners& corners, HitPacket& hits) {
  const hn::CappedTag<double, lanes> d;
  const hn::Rebind<float, decltype(d)> f;
  using V = hn::Vec<decltype(d)>;
  for (std::size_t i = 0; i < lanes; i += hn::Lanes(d)) {
    const auto corner = [&](const Lanes& x) { return hn::PromoteTo(d, hn::LoadU(f, &x[i])); };
    const auto dot = [](const V* u, const V* v) {
      return hn::MulAdd(u[0], v[0], hn::MulAdd(u[1], v[1], hn::Mul(u[2], v[2])));
    };
    V a[3], ab[3], ac[3], direction[3], offset[3];
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = corner(corners.a[k]);
      ab[k] = hn::Sub(corner(corners.b[k]), a[k]);
      ac[k] = hn::Sub(corner(corners.c[k]), a[k]);
      direction[k] = hn::LoadU(d, &rays.direction[k][i]);
      offset[k] = hn::Sub(a[k], hn::LoadU(d, &rays.origin[k][i]));
    }
    V normal[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
      normal[k] = hn::Sub(hn::Mul(ab[u], ac[v]), hn::Mul(ab[v], ac[u]));
    }
    V scale = hn::Div(hn::Set(d, 1), hn::Sqrt(dot(normal, normal)));
    // Towards the ray's origin.
    scale = hn::CopySign(scale, hn::Neg(dot(normal, direction)));
    for (std::size_t k = 0; k < 3; ++k) {
      normal[k] = hn::Mul(normal[k], scale);
      hn::StoreU(normal[k], d, &hits.normal[k][i]);
    }
    const V slope = dot(normal, direction);
    hn::StoreU(hn::Div(dot(normal, offset), slope), d, &hits.range[i]);
    hn::StoreU(hn::Min(hn::Set(d, 1), hn::Neg(slope)), d, &hits.cosine[i]);
  }
}

void ApplyRelief(const ReliefNoise& relief, const RayPacket& rays,
                 const std::array<bool, lanes>& chosen, HitPacket& hits, DoubleLanes& shift) {
  const hn::CappedTag<double, lanes> d;
  const hn::Rebind<std::uint64_t, decltype(d)> u;
  const hn::RebindToSigned<decltype(u)> s;
  using V = hn::Vec<decltype(d)>;
  using I = hn::Vec<decltype(u)>;
  // mixed_bits
  const auto mix = [&](I h) {
    h = hn::Xor(h, hn::ShiftRight<30>(h)) * hn::Set(u, 0xbf58476d1ce4e5b9);
    h = hn::Xor(h, hn::ShiftRight<27>(h)) * hn::Set(u, 0x94d049bb133111eb);
    return hn::Xor(h, hn::ShiftRight<31>(h));
  };
  const auto set = [&](double x) { return hn::Set(d, x); };
  const auto dot = [](const V* a, const V* b) {
    return hn::Add(hn::Add(hn::Mul(a[0], b[0]), hn::Mul(a[1], b[1])), hn::Mul(a[2], b[2]));
  };

  // The cells of the lattice, places within them, and the gradients at their corners: one by one,
  // which is faster than instructions that gather.
  VectorLanes within;
  std::array<std::array<std::uint64_t, lanes>, 8> pick;
  for (std::size_t i = 0; i < lanes; i += hn::Lanes(d)) {
    const V range = hn::LoadU(d, &hits.range[i]);
    V place[3];
    for (std::size_t k = 0; k < 3; ++k)
      place[k] = hn::Add(hn::LoadU(d, &rays.origin[k][i]),
                         hn::Mul(range, hn::LoadU(d, &rays.direction[k][i])));
    I low = hn::Set(u, relief.seed);
    for (std::size_t k = 0; k < 3; ++k) {
      const V row[3] = {set(relief.to_lattice[k][0]), set(relief.to_lattice[k][1]),
                        set(relief.to_lattice[k][2])};
      const V on_lattice = dot(row, place);
      const V cell = hn::Floor(on_lattice);
      hn::StoreU(hn::Sub(on_lattice, cell), d, &within[k][i]);
      low = hn::Add(low, hn::BitCast(u, hn::ConvertTo(s, cell)) *
                             hn::Set(u, lattice_sum(k == 0, k == 1, k == 2)));
    }
    for (int c = 0; c < 8; ++c) {
      const I corner = hn::Add(low, hn::Set(u, lattice_sum(c & 1, c >> 1 & 1, c >> 2)));
      hn::StoreU(hn::And(mix(corner), hn::Set(u, 255)), u, &pick[static_cast<std::size_t>(c)][i]);
    }
  }
  std::array<VectorLanes, 8> gradients;
  for (std::size_t c = 0; c < 8; ++c)
    for (std::size_t i = 0; i < lanes; ++i) {
      const double* gradient = noise_gradients[pick[c][i]].data();
      for (std::size_t k = 0; k < 3; ++k) gradients[c][k][i] = gradient[k];
    }

  DoubleLanes is_chosen;
  for (std::size_t i = 0; i < lanes; ++i) is_chosen[i] = chosen[i] ? 1 : 0;
  const V one = set(1), height = set(relief.height), reach = set(relief.reach);
  for (std::size_t i = 0; i < lanes; i += hn::Lanes(d)) {
    // As gradient_noise_slope: the weights of the two corners along each axis, and their slopes.
    V t[3], weight[3][2], change[3][2];
    for (std::size_t k = 0; k < 3; ++k) {
      t[k] = hn::LoadU(d, &within[k][i]);
      const V fade =
          hn::Mul(hn::Mul(hn::Mul(t[k], t[k]), t[k]),
                  hn::Add(hn::Mul(t[k], hn::Sub(hn::Mul(set(6), t[k]), set(15))), set(10)));
      const V slope = hn::Mul(hn::Mul(hn::Mul(set(30), t[k]), t[k]),
                              hn::Add(hn::Mul(t[k], hn::Sub(t[k], set(2))), one));
      weight[k][0] = hn::Sub(one, fade);
      weight[k][1] = fade;
      change[k][0] = hn::Neg(slope);
      change[k][1] = slope;
    }
    V noise = hn::Zero(d);
    V noise_slope[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (std::size_t c = 0; c < 8; ++c) {
      const std::size_t at[3] = {c & 1, c >> 1 & 1, c >> 2};
      V gradient[3], from_corner[3];
      for (std::size_t k = 0; k < 3; ++k) {
        gradient[k] = hn::LoadU(d, &gradients[c][k][i]);
        from_corner[k] = hn::Sub(t[k], set(static_cast<double>(at[k])));
      }
      const V along = dot(gradient, from_corner);
      const V xy = hn::Mul(weight[0][at[0]], weight[1][at[1]]);
      const V all = hn::Mul(xy, weight[2][at[2]]);
      noise = hn::MulAdd(all, along, noise);
      const V turn[3] = {hn::Mul(hn::Mul(change[0][at[0]], weight[1][at[1]]), weight[2][at[2]]),
                         hn::Mul(hn::Mul(weight[0][at[0]], change[1][at[1]]), weight[2][at[2]]),
                         hn::Mul(xy, change[2][at[2]])};
      for (std::size_t k = 0; k < 3; ++k)
        noise_slope[k] = hn::MulAdd(along, turn[k], hn::MulAdd(all, gradient[k], noise_slope[k]));
    }

    V direction[3], normal[3], slope[3];
    for (std::size_t k = 0; k < 3; ++k) {
      direction[k] = hn::LoadU(d, &rays.direction[k][i]);
      normal[k] = hn::LoadU(d, &hits.normal[k][i]);
      const V column[3] = {set(relief.to_lattice[0][k]), set(relief.to_lattice[1][k]),
                           set(relief.to_lattice[2][k])};
      slope[k] = hn::Mul(height, dot(column, noise_slope));
    }
    V cosine = hn::LoadU(d, &hits.cosine[i]);
    // A surface seen edge-on moves by the reach, but not if its height is 0: no 0 / 0.
    const V rise = hn::Div(hn::Mul(height, noise), hn::Max(cosine, set(1e-9)));
    const V longer = hn::Neg(hn::Clamp(rise, hn::Neg(reach), reach));
    const auto mask = hn::Ne(hn::LoadU(d, &is_chosen[i]), hn::Zero(d));
    const auto change_chosen = [&](V value, double* place) {
      hn::BlendedStore(value, mask, d, place);
    };
    change_chosen(longer, &shift[i]);
    change_chosen(hn::Add(hn::LoadU(d, &hits.range[i]), longer), &hits.range[i]);
    // The surface at height h(p) above the plane has the normal n - grad h, of the part of the
    // gradient in the plane.
    const V off_plane = dot(slope, normal);
    for (std::size_t k = 0; k < 3; ++k) slope[k] = hn::Sub(slope[k], hn::Mul(off_plane, normal[k]));
    // A side that faces away would be hidden; seen is one that faces the scanner by a tenth of what
    // the triangle does (assumed).
    const V away = hn::Neg(dot(slope, direction));
    const V most = hn::Mul(set(0.9), cosine);
    const V part = hn::IfThenElse(hn::Gt(away, most), hn::Div(most, away), one);
    for (std::size_t k = 0; k < 3; ++k) normal[k] = hn::Sub(normal[k], hn::Mul(part, slope[k]));
    const V scale = hn::Div(one, hn::Sqrt(dot(normal, normal)));
    for (std::size_t k = 0; k < 3; ++k) {
      normal[k] = hn::Mul(normal[k], scale);
      change_chosen(normal[k], &hits.normal[k][i]);
    }
    cosine = hn::Clamp(hn::Neg(dot(normal, direction)), hn::Zero(d), one);
    change_chosen(cosine, &hits.cosine[i]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace minescan
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace minescan {

HWY_EXPORT(SineCosine);
HWY_EXPORT(ArcTangent);
HWY_EXPORT(ArcCosine);
HWY_EXPORT(ExponentialMinus1);
HWY_EXPORT(Product);
HWY_EXPORT(MeetPlanes);
HWY_EXPORT(ApplyRelief);
HWY_EXPORT(FourNormals);

void sine_cosine(const float* angle, float* sine, float* cosine, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(SineCosine)(angle, sine, cosine, count);
}
void arc_tangent(const float* y, const float* x, float* angle, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(ArcTangent)(y, x, angle, count);
}
void arc_cosine(const float* x, float* angle, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(ArcCosine)(x, angle, count);
}
void product(const MatrixLanes& matrix, const VectorLanes& v, VectorLanes& result) {
  HWY_DYNAMIC_DISPATCH(Product)(matrix, v, result);
}
void meet_planes(const RayPacket& rays, const Corners& corners, HitPacket& hits) {
  HWY_DYNAMIC_DISPATCH(MeetPlanes)(rays, corners, hits);
}
void apply_relief(const ReliefNoise& relief, const RayPacket& rays,
                  const std::array<bool, lanes>& chosen, HitPacket& hits, DoubleLanes& shift) {
  HWY_DYNAMIC_DISPATCH(ApplyRelief)(relief, rays, chosen, hits, shift);
}
void exponential_minus_1(const float* x, float* result, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(ExponentialMinus1)(x, result, count);
}
void four_normals(std::uint64_t seed, const std::array<std::uint64_t, lanes>& streams,
                  std::uint64_t block, std::array<Lanes, 4>& result) {
  HWY_DYNAMIC_DISPATCH(FourNormals)(seed, streams, block, result);
}

}  // namespace minescan
#endif
