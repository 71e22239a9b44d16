// SPDX-License-Identifier: MIT
#include "registration/methods.h"

#include "core/table.h"
#include "registration/icp.h"
#include "registration/ndt.h"
#include "registration/robust.h"
#ifdef MINESCAN_PCL
#include "registration/pcl_methods.h"
#endif

namespace minescan {
namespace {

/// A row: the function with options that start from `defaults`.
template <class Options>
Method row(const std::string& name, const std::string& description,
           RegistrationResult (*function)(const PointCloud&, const PointCloud&, const Pose&,
                                          const Options&),
           const Options& defaults = {}) {
  return {.name = name,
          .description = description,
          .fields = fields_of(defaults),
          .run = [=](const PointCloud& target, const PointCloud& source, const Pose& T_guess,
                     const Settings& settings) {
            return function(target, source, T_guess, with_settings(defaults, settings));
          }};
}

}  // namespace

const std::vector<Method>& methods() {
  static const std::vector<Method> table = {
      row("robust", "from far away and without tuning: blurred cells, then 3D-NDT",
          register_robust),
      row("ndt", "3D-NDT with fixed cells, the paper's baseline", register_ndt),
      row("icp", "point-to-point ICP, the paper's baseline", register_icp),
      row("icp-plane", "point-to-plane ICP", register_icp, IcpOptions{.metric = IcpMetric::plane}),
      row("icp-symmetric", "ICP along the sum of both normals", register_icp,
          IcpOptions{.metric = IcpMetric::symmetric}),
#ifdef MINESCAN_PCL
      row("pcl-ndt", "NormalDistributionsTransform of the Point Cloud Library", register_pcl_ndt),
      row("pcl-icp", "IterativeClosestPoint of the Point Cloud Library", register_pcl_icp),
#endif
  };
  return table;
}

const Method& find_method(const std::string& name) { return find_row(methods(), "method", name); }

}  // namespace minescan
