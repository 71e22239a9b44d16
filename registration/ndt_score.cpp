// SPDX-License-Identifier: MIT
#include "registration/ndt_score.h"

#include <cmath>

namespace minescan {
namespace {

// Below e^-120 a point has left its cell's reach for good; leaving it out also keeps exp away from
// numbers that are slow to calculate with.
constexpr double max_exponent = 120;

// Four points are worked on at a time, one in each lane: a lane sums every fourth point that meets
// a cell, and the four sums are added at the end. Processors with wider registers run the same
// additions and multiplications in fewer instructions and get the same bits, since none are fused.
constexpr int lanes = 4;
using Lanes = double __attribute__((vector_size(lanes * sizeof(double))));

// Compiled twice, chosen when the program starts; the thread sanitizer can not be called that
// early.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_THREAD__)
#define MINESCAN_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define MINESCAN_WIDE
#endif
// What is called by such a function has to become part of it to be compiled twice as well.
#define MINESCAN_INLINE __attribute__((always_inline))

double sum(const Lanes& x) { return (x[0] + x[1]) + (x[2] + x[3]); }

/// Points with the cells that they have met, one per lane, until all lanes are filled.
struct Batch {
  Lanes y[3] = {};  // R x: turned, not shifted
  Lanes x[3] = {};  // x' (paper, eq. 7)
  Lanes L[6] = {};  // C^-1: xx, xy, xz, yy, yz, zz
  Lanes n[3] = {};  // the cell's normal
  int filled = 0;
};

/// v = C^-1 x' and w = exp(-x'^T v / 2) of each lane; w = 0 in lanes not filled.
MINESCAN_INLINE inline void densities(const Batch& b, Lanes (&v)[3], Lanes& w) {
  v[0] = b.L[0] * b.x[0] + b.L[1] * b.x[1] + b.L[2] * b.x[2];
  v[1] = b.L[1] * b.x[0] + b.L[3] * b.x[1] + b.L[4] * b.x[2];
  v[2] = b.L[2] * b.x[0] + b.L[4] * b.x[1] + b.L[5] * b.x[2];
  const Lanes exponent = (b.x[0] * v[0] + b.x[1] * v[1] + b.x[2] * v[2]) / 2;
  for (int i = 0; i < lanes; ++i)
    w[i] = i < b.filled && exponent[i] < max_exponent ? std::exp(-exponent[i]) : 0;
}

/// Calls visit(batch) for all points with a cell, in order, the last batch with the rest.
template <class Visit>
MINESCAN_INLINE inline std::size_t for_each_batch(const NdtGrid& grid, const Pose& T,
                                                  const std::vector<Eigen::Vector3d>& points,
                                                  bool with_normals, Visit&& visit) {
  const Eigen::Matrix3d R = T.linear();
  const double r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
  const double r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
  const double r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  const Eigen::Vector3d t = T.translation();
  Batch batch;
  std::size_t met = 0;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d y(r00 * p.x() + r01 * p.y() + r02 * p.z(),
                            r10 * p.x() + r11 * p.y() + r12 * p.z(),
                            r20 * p.x() + r21 * p.y() + r22 * p.z());
    const Eigen::Vector3d moved = y + t;
    const NdtCell* cell = grid.find(moved);
    if (!cell) continue;
    ++met;
    const int lane = batch.filled++;
    for (int i = 0; i < 3; ++i) {
      batch.y[i][lane] = y[i];
      batch.x[i][lane] = moved[i] - cell->mean[i];
    }
    for (std::size_t i = 0; i < 6; ++i) batch.L[i][lane] = cell->information[i];
    if (with_normals)
      for (int i = 0; i < 3; ++i) batch.n[i][lane] = grid.normal(*cell)[i];
    if (batch.filled == lanes) {
      visit(batch);
      batch.filled = 0;
    }
  }
  if (batch.filled > 0) visit(batch);
  return met;
}

/// Sum of J^T A J for symmetric 3 x 3 matrices A, with J = [I | -[y]x], in 21 numbers.
struct SymmetricSum {
  Lanes tt[6] = {};  // xx, xy, xz, yy, yz, zz
  Lanes tw[9] = {};  // row i: y x (row i of A)
  Lanes ww[6] = {};

  MINESCAN_INLINE inline void add(const Lanes (&a)[6], const Lanes (&y)[3]) {
    for (int i = 0; i < 6; ++i) tt[i] += a[i];
    // Rows of B = A (-[y]x): y crossed with each row of A.
    const Lanes b00 = y[1] * a[2] - y[2] * a[1], b01 = y[2] * a[0] - y[0] * a[2],
                b02 = y[0] * a[1] - y[1] * a[0];
    const Lanes b10 = y[1] * a[4] - y[2] * a[3], b11 = y[2] * a[1] - y[0] * a[4],
                b12 = y[0] * a[3] - y[1] * a[1];
    const Lanes b20 = y[1] * a[5] - y[2] * a[4], b21 = y[2] * a[2] - y[0] * a[5],
                b22 = y[0] * a[4] - y[1] * a[2];
    tw[0] += b00, tw[1] += b01, tw[2] += b02;
    tw[3] += b10, tw[4] += b11, tw[5] += b12;
    tw[6] += b20, tw[7] += b21, tw[8] += b22;
    // [y]x B, the upper triangle.
    ww[0] += y[1] * b20 - y[2] * b10;
    ww[1] += y[1] * b21 - y[2] * b11;
    ww[2] += y[1] * b22 - y[2] * b12;
    ww[3] += y[2] * b01 - y[0] * b21;
    ww[4] += y[2] * b02 - y[0] * b22;
    ww[5] += y[0] * b12 - y[1] * b02;
  }

  Matrix6d matrix() const {
    double a[6], b[9], c[6];
    for (int i = 0; i < 6; ++i) a[i] = sum(tt[i]), c[i] = sum(ww[i]);
    for (int i = 0; i < 9; ++i) b[i] = sum(tw[i]);
    Matrix6d H;
    H.topLeftCorner<3, 3>() << a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5];
    H.topRightCorner<3, 3>() << b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8];
    H.bottomLeftCorner<3, 3>() = H.topRightCorner<3, 3>().transpose();
    H.bottomRightCorner<3, 3>() << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    return H;
  }
};

}  // namespace

Score ndt_score(const NdtCell& cell, const Pose& T_target_source, const Eigen::Vector3d& point) {
  const Eigen::Matrix3d L = information_matrix(cell);
  const Eigen::Vector3d y = T_target_source.linear() * point;
  const Eigen::Vector3d x = y + T_target_source.translation() - cell.mean;  // eq. 7
  const Eigen::Vector3d v = L * x;
  const double w = std::exp(-x.dot(v) / 2);  // eq. 4 with c = 1

  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(y);
  const Vector6d h = J.transpose() * v;
  Matrix6d S = Matrix6d::Zero();  // v^T times the second derivatives of x'
  S.bottomRightCorner<3, 3>() = (v * y.transpose() + y * v.transpose()) / 2;
  S.bottomRightCorner<3, 3>().diagonal().array() -= v.dot(y);
  return {.value = -w,                                                     // eq. 6, one term
          .gradient = w * h,                                               // eq. 8
          .hessian = w * (J.transpose() * L * J - h * h.transpose() + S),  // eq. 9
          .met = 1};
}

MINESCAN_WIDE
Score ndt_score(const NdtGrid& grid, const Pose& T_target_source,
                const std::vector<Eigen::Vector3d>& points) {
  Lanes value = {}, g[6] = {};
  SymmetricSum H;
  Score score;
  score.met =
      for_each_batch(grid, T_target_source, points, false, [&](const Batch& b) MINESCAN_INLINE {
        Lanes v[3], w;
        densities(b, v, w);
        const Lanes(&y)[3] = b.y;
        const Lanes wv[3] = {w * v[0], w * v[1], w * v[2]};
        value -= w;
        for (int i = 0; i < 3; ++i) g[i] += wv[i];
        g[3] += y[1] * wv[2] - y[2] * wv[1];
        g[4] += y[2] * wv[0] - y[0] * wv[2];
        g[5] += y[0] * wv[1] - y[1] * wv[0];
        // J^T C^-1 J - h h^T = J^T (C^-1 - v v^T) J, since h = J^T v.
        H.add({w * b.L[0] - wv[0] * v[0], w * b.L[1] - wv[0] * v[1], w * b.L[2] - wv[0] * v[2],
               w * b.L[3] - wv[1] * v[1], w * b.L[4] - wv[1] * v[2], w * b.L[5] - wv[2] * v[2]},
              y);
        // The second derivatives of x': (v y^T + y v^T) / 2 - (v.y) I.
        const Lanes d[3] = {wv[0] * y[0], wv[1] * y[1], wv[2] * y[2]};
        H.ww[0] -= d[1] + d[2], H.ww[3] -= d[0] + d[2], H.ww[5] -= d[0] + d[1];
        H.ww[1] += (wv[0] * y[1] + wv[1] * y[0]) / 2;
        H.ww[2] += (wv[0] * y[2] + wv[2] * y[0]) / 2;
        H.ww[4] += (wv[1] * y[2] + wv[2] * y[1]) / 2;
      });
  score.value = sum(value);
  for (int i = 0; i < 6; ++i) score.gradient[i] = sum(g[i]);
  score.hessian = H.matrix();
  return score;
}

MINESCAN_WIDE
double ndt_value(const NdtGrid& grid, const Pose& T_target_source,
                 const std::vector<Eigen::Vector3d>& points) {
  Lanes value = {};
  for_each_batch(grid, T_target_source, points, false, [&](const Batch& b) MINESCAN_INLINE {
    Lanes v[3], w;
    densities(b, v, w);
    value -= w;
  });
  return sum(value);
}

MINESCAN_WIDE
NdtInformation ndt_information(const NdtGrid& grid, const Pose& T_target_source,
                               const std::vector<Eigen::Vector3d>& points) {
  SymmetricSum gauss_newton, surface;
  for_each_batch(grid, T_target_source, points, true, [&](const Batch& b) MINESCAN_INLINE {
    Lanes v[3], w;
    densities(b, v, w);
    gauss_newton.add({w * b.L[0], w * b.L[1], w * b.L[2], w * b.L[3], w * b.L[4], w * b.L[5]}, b.y);
    const Lanes wn[3] = {w * b.n[0], w * b.n[1], w * b.n[2]};
    surface.add({wn[0] * b.n[0], wn[0] * b.n[1], wn[0] * b.n[2], wn[1] * b.n[1], wn[1] * b.n[2],
                 wn[2] * b.n[2]},
                b.y);
  });
  return {.gauss_newton = gauss_newton.matrix(), .surface = surface.matrix()};
}

}  // namespace minescan
