// SPDX-License-Identifier: MIT
// The sums of 3D-NDT over points in single precision: the same terms as registration/ndt_score.h,
// many at a time.
#pragma once

#include <cstddef>
#include <vector>

#include "core/pose.h"
#include "registration/ndt_field.h"
#include "registration/ndt_score.h"
#include "registration/search.h"

namespace minescan {

/// Points as structure of arrays in single precision, padded with points that lie nowhere.
class PackedPoints {
 public:
  explicit PackedPoints(const std::vector<Eigen::Vector3d>& points);

  std::size_t size() const { return size_; }
  std::size_t padded_size() const { return x_.size(); }
  const float* x() const { return x_.data(); }
  const float* y() const { return y_.data(); }
  const float* z() const { return z_.data(); }

 private:
  std::size_t size_ = 0;
  std::vector<float> x_, y_, z_;
};

/// As ndt_score(grid, ...), ndt_value and ndt_information, within the rounding of single precision:
/// coordinates are exact to 1e-7 of the box's size, sums to 1e-6 of their terms' absolute values,
/// and a point within that of a cell's face may count for the cell beyond it. Score::hessian is as
/// `curvature` says.
Score ndt_score(const NdtField& field, const Pose& T_target_source, const PackedPoints& points,
                Curvature curvature = Curvature::full);
/// Equal to ndt_score(...).value to the last bit.
double ndt_value(const NdtField& field, const Pose& T_target_source, const PackedPoints& points);
NdtInformation ndt_information(const NdtField& field, const Pose& T_target_source,
                               const PackedPoints& points);

}  // namespace minescan
