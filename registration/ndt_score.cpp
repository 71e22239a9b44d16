// SPDX-License-Identifier: MIT
#include "registration/ndt_score.h"

#include <cmath>

namespace minescan {
namespace {

// Below e^-120 a point has left its cell's reach for good; leaving it out also keeps exp away from
// numbers that are slow to calculate with.
constexpr double max_exponent = 120;

/// What a point and its cell have in common for value and derivatives.
struct Term {
  Eigen::Vector3d y;  // R x: turned, not shifted
  Eigen::Vector3d v;  // C^-1 x'
  double density;     // exp(-x'^T C^-1 x' / 2), or 0 where it is left out
};

struct Kernel {
  const NdtGrid& grid;
  const Eigen::Matrix3d R;
  const Eigen::Vector3d t;

  /// Calls visit(cell, term) for every point with a cell, in order.
  template <class Visit>
  void each(const std::vector<Eigen::Vector3d>& points, Visit&& visit) const {
    const double r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
    const double r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
    const double r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
    for (const Eigen::Vector3d& p : points) {
      Term term;
      term.y = {r00 * p.x() + r01 * p.y() + r02 * p.z(), r10 * p.x() + r11 * p.y() + r12 * p.z(),
                r20 * p.x() + r21 * p.y() + r22 * p.z()};
      const Eigen::Vector3d moved = term.y + t;
      const NdtCell* cell = grid.find(moved);
      if (!cell) continue;
      const Eigen::Vector3d x = moved - cell->mean;  // eq. 7
      const auto& [xx, xy, xz, yy, yz, zz] = cell->information;
      term.v = {xx * x.x() + xy * x.y() + xz * x.z(), xy * x.x() + yy * x.y() + yz * x.z(),
                xz * x.x() + yz * x.y() + zz * x.z()};
      const double exponent = x.dot(term.v) / 2;
      term.density = exponent < max_exponent ? std::exp(-exponent) : 0;
      visit(*cell, term);
    }
  }
};

Kernel kernel(const NdtGrid& grid, const Pose& T) {
  return {.grid = grid, .R = T.linear(), .t = T.translation()};
}

/// Sum of J^T A J for symmetric 3 x 3 matrices A, with J = [I | -[y]x], in 21 numbers.
struct SymmetricSum {
  double tt[6] = {};  // xx, xy, xz, yy, yz, zz
  double tw[9] = {};  // row i: y x (row i of A)
  double ww[6] = {};

  void add(const double (&a)[6], double y0, double y1, double y2) {
    for (int i = 0; i < 6; ++i) tt[i] += a[i];
    // Rows of B = A (-[y]x): each row of A crossed with y.
    const double b00 = y1 * a[2] - y2 * a[1], b01 = y2 * a[0] - y0 * a[2],
                 b02 = y0 * a[1] - y1 * a[0];
    const double b10 = y1 * a[4] - y2 * a[3], b11 = y2 * a[1] - y0 * a[4],
                 b12 = y0 * a[3] - y1 * a[1];
    const double b20 = y1 * a[5] - y2 * a[4], b21 = y2 * a[2] - y0 * a[5],
                 b22 = y0 * a[4] - y1 * a[2];
    tw[0] += b00, tw[1] += b01, tw[2] += b02;
    tw[3] += b10, tw[4] += b11, tw[5] += b12;
    tw[6] += b20, tw[7] += b21, tw[8] += b22;
    // [y]x B, the upper triangle.
    ww[0] += y1 * b20 - y2 * b10, ww[1] += y1 * b21 - y2 * b11, ww[2] += y1 * b22 - y2 * b12;
    ww[3] += y2 * b01 - y0 * b21, ww[4] += y2 * b02 - y0 * b22;
    ww[5] += y0 * b12 - y1 * b02;
  }

  Matrix6d matrix() const {
    Matrix6d H;
    H.topLeftCorner<3, 3>() << tt[0], tt[1], tt[2], tt[1], tt[3], tt[4], tt[2], tt[4], tt[5];
    H.topRightCorner<3, 3>() << tw[0], tw[1], tw[2], tw[3], tw[4], tw[5], tw[6], tw[7], tw[8];
    H.bottomLeftCorner<3, 3>() = H.topRightCorner<3, 3>().transpose();
    H.bottomRightCorner<3, 3>() << ww[0], ww[1], ww[2], ww[1], ww[3], ww[4], ww[2], ww[4], ww[5];
    return H;
  }
};

}  // namespace

NdtScore ndt_score(const NdtCell& cell, const Pose& T_target_source, const Eigen::Vector3d& point) {
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

NdtScore ndt_score(const NdtGrid& grid, const Pose& T_target_source,
                   const std::vector<Eigen::Vector3d>& points) {
  double value = 0;
  double g[6] = {};
  SymmetricSum H;
  std::size_t met = 0;
  kernel(grid, T_target_source).each(points, [&](const NdtCell& cell, const Term& term) {
    ++met;
    const double w = term.density;
    if (w == 0) return;
    const double v0 = term.v.x(), v1 = term.v.y(), v2 = term.v.z();
    const double y0 = term.y.x(), y1 = term.y.y(), y2 = term.y.z();
    const double w0 = w * v0, w1 = w * v1, w2 = w * v2;
    value -= w;
    g[0] += w0, g[1] += w1, g[2] += w2;
    g[3] += y1 * w2 - y2 * w1, g[4] += y2 * w0 - y0 * w2, g[5] += y0 * w1 - y1 * w0;
    // J^T C^-1 J - h h^T = J^T (C^-1 - v v^T) J, since h = J^T v.
    const auto& [xx, xy, xz, yy, yz, zz] = cell.information;
    H.add({w * xx - w0 * v0, w * xy - w0 * v1, w * xz - w0 * v2, w * yy - w1 * v1, w * yz - w1 * v2,
           w * zz - w2 * v2},
          y0, y1, y2);
    // The second derivatives of x': (v y^T + y v^T) / 2 - (v.y) I.
    H.ww[0] -= w1 * y1 + w2 * y2, H.ww[3] -= w0 * y0 + w2 * y2, H.ww[5] -= w0 * y0 + w1 * y1;
    H.ww[1] += (w0 * y1 + w1 * y0) / 2;
    H.ww[2] += (w0 * y2 + w2 * y0) / 2;
    H.ww[4] += (w1 * y2 + w2 * y1) / 2;
  });
  return {.value = value, .gradient = Vector6d(g), .hessian = H.matrix(), .met = met};
}

double ndt_value(const NdtGrid& grid, const Pose& T_target_source,
                 const std::vector<Eigen::Vector3d>& points) {
  double value = 0;
  kernel(grid, T_target_source).each(points, [&](const NdtCell&, const Term& term) {
    value -= term.density;
  });
  return value;
}

Matrix6d ndt_gauss_newton(const NdtGrid& grid, const Pose& T_target_source,
                          const std::vector<Eigen::Vector3d>& points) {
  SymmetricSum H;
  kernel(grid, T_target_source).each(points, [&](const NdtCell& cell, const Term& term) {
    const double w = term.density;
    const auto& [xx, xy, xz, yy, yz, zz] = cell.information;
    H.add({w * xx, w * xy, w * xz, w * yy, w * yz, w * zz}, term.y.x(), term.y.y(), term.y.z());
  });
  return H.matrix();
}

}  // namespace minescan
