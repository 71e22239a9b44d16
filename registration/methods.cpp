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
      row("ndt-octree",
          "3D-NDT with cells of 2 m, halved once where points do not lie along a plane",
          register_ndt,
          NdtOptions{.grid = {.cell_size = 2},
                     .terms = {.discretisation = Discretisation::octree}}),
      row("ndt-additive", "the same, a point scored by all parts of its cell", register_ndt,
          NdtOptions{.grid = {.cell_size = 2},
                     .terms = {.discretisation = Discretisation::additive}}),
      row("ndt-iterative", "3D-NDT with cells of 2, 1.5 and 1.125 m, one after the other",
          register_ndt,
          NdtOptions{.grid = {.cell_size = 1.125}, .levels = 3, .level_ratio = 4.0 / 3}),
      row("ndt-iterative-endless", "the same, points outside scored with the border", register_ndt,
          NdtOptions{.grid = {.cell_size = 1.125},
                     .terms = {.endless = true},
                     .levels = 3,
                     .level_ratio = 4.0 / 3}),
      row("ndt-near-far", "3D-NDT with larger cells for far points at first", register_ndt,
          NdtOptions{.far_distance = 10}),
      row("ndt-overlap", "3D-NDT with 8 lattices shifted by half a cell", register_ndt,
          NdtOptions{.terms = {.neighbourhood = Neighbourhood::overlap}}),
      row("ndt-trilinear", "3D-NDT with the 8 nearest cells, weighted", register_ndt,
          NdtOptions{.terms = {.neighbourhood = Neighbourhood::trilinear}}),
      row("ndt-faces", "3D-NDT with the 6 cells beyond a cell's faces, too", register_ndt,
          NdtOptions{.terms = {.neighbourhood = Neighbourhood::faces}}),
      row("ndt-mixture", "3D-NDT with the score of Magnusson's thesis", register_ndt,
          NdtOptions{.terms = {.density = Density::mixture}}),
      row("icp", "point-to-point ICP, the paper's baseline", register_icp),
      row("icp-plane", "point-to-plane ICP", register_icp, IcpOptions{.metric = IcpMetric::plane}),
      row("icp-symmetric", "ICP along the sum of both normals", register_icp,
          IcpOptions{.metric = IcpMetric::symmetric}),
      row("gicp", "generalized ICP: between planes of both clouds", register_icp,
          IcpOptions{.metric = IcpMetric::generalized}),
#ifdef MINESCAN_PCL
      row("pcl-ndt", "NormalDistributionsTransform of the Point Cloud Library", register_pcl_ndt),
      row("pcl-icp", "IterativeClosestPoint of the Point Cloud Library", register_pcl_icp),
      row("pcl-icp-plane", "the same with the distance from tangent planes",
          register_pcl_icp_plane),
      row("pcl-gicp", "GeneralizedIterativeClosestPoint of the Point Cloud Library",
          register_pcl_gicp),
      row("pcl-fpfh", "global start by features and sample consensus, Point Cloud Library",
          register_pcl_global),
#endif
  };
  return table;
}

const Method& find_method(const std::string& name) { return find_row(methods(), "method", name); }

}  // namespace minescan
