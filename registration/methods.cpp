// SPDX-License-Identifier: MIT
#include "registration/methods.h"

#include "core/table.h"
#include "registration/d2d.h"
#include "registration/distance_quadrics.h"
#include "registration/icp.h"
#include "registration/ndt.h"
#include "registration/planar_ndt.h"
#include "registration/robust.h"
#include "registration/voxel_gicp.h"
#ifdef MINESCAN_OPEN3D
#include "registration/open3d_methods.h"
#endif
#ifdef MINESCAN_PCL
#include "registration/pcl_methods.h"
#endif

namespace minescan {
const std::vector<Method>& methods() {
  static const std::vector<Method> table = {
      method_row("robust", "from far away and without tuning: blurred cells, then 3D-NDT",
                 register_robust),
      method_row("ndt", "3D-NDT with fixed cells, the paper's baseline", register_ndt),
      method_row("ndt-octree",
                 "3D-NDT with cells of 2 m, halved once where points do not lie along a plane",
                 register_ndt,
                 NdtOptions{.grid = {.cell_size = 2},
                            .terms = {.discretisation = Discretisation::octree}}),
      method_row("ndt-additive", "the same, a point scored by all parts of its cell", register_ndt,
                 NdtOptions{.grid = {.cell_size = 2},
                            .terms = {.discretisation = Discretisation::additive}}),
      method_row("ndt-iterative", "3D-NDT with cells of 2, 1.5 and 1.125 m, one after the other",
                 register_ndt,
                 NdtOptions{.grid = {.cell_size = 1.125}, .levels = 3, .level_ratio = 4.0 / 3}),
      method_row("ndt-iterative-endless", "the same, points outside scored with the border",
                 register_ndt,
                 NdtOptions{.grid = {.cell_size = 1.125},
                            .terms = {.endless = true},
                            .levels = 3,
                            .level_ratio = 4.0 / 3}),
      method_row(
          "ndt-merged",
          "3D-NDT with cells of 2, 1 and 0.5 m, the larger ones put together from the smaller",
          register_ndt, NdtOptions{.grid = {.cell_size = 0.5}, .levels = 3, .merged = true}),
      method_row("ndt-near-far", "3D-NDT with larger cells for far points at first", register_ndt,
                 NdtOptions{.far_distance = 10}),
      method_row("ndt-overlap", "3D-NDT with 8 lattices shifted by half a cell", register_ndt,
                 NdtOptions{.terms = {.neighbourhood = Neighbourhood::overlap}}),
      method_row("ndt-trilinear", "3D-NDT with the 8 nearest cells, weighted", register_ndt,
                 NdtOptions{.terms = {.neighbourhood = Neighbourhood::trilinear}}),
      method_row("ndt-faces", "3D-NDT with the 6 cells beyond a cell's faces, too", register_ndt,
                 NdtOptions{.terms = {.neighbourhood = Neighbourhood::faces}}),
      method_row("ndt-mixture", "3D-NDT with the score of Magnusson's thesis", register_ndt,
                 NdtOptions{.terms = {.density = Density::mixture}}),
      method_row("ndt-d2d", "3D-NDT between distributions of both clouds, cells of 2, 1 and 0.5 m",
                 register_d2d),
      method_row("ndt-radius",
                 "3D-NDT with the score of PCL: mixtures, and all cells with a mean in reach",
                 register_ndt,
                 NdtOptions{.grid = {.min_cell_points = 6},
                            .terms = {.neighbourhood = Neighbourhood::radius,
                                      .density = Density::mixture}}),
      method_row("ndt-2d", "NDT in plan, for level scans: four lattices of squares of 1 m",
                 register_planar_ndt),
      method_row("ndt-slices", "the same in horizontal slices of 0.5 m", register_planar_ndt,
                 PlanarNdtOptions{.slice_height = 0.5}),
      method_row("icp", "point-to-point ICP, the paper's baseline", register_icp),
      method_row("icp-plane", "point-to-plane ICP", register_icp,
                 IcpOptions{.metric = IcpMetric::plane}),
      method_row("icp-symmetric", "ICP along the sum of both normals", register_icp,
                 IcpOptions{.metric = IcpMetric::symmetric}),
      method_row("gicp", "generalized ICP: between planes of both clouds", register_icp,
                 IcpOptions{.metric = IcpMetric::generalized}),
      method_row("vgicp", "generalized ICP with the mean distributions of cells of 1 m",
                 register_voxel_gicp),
      method_row("quadrics", "squared distance to second order, from curvatures of the target",
                 register_distance_quadrics),
      method_row("quadrics-octree", "squared distance from an octree of fitted quadrics",
                 register_distance_quadrics,
                 DistanceQuadricsOptions{.approximant = Approximant::octree}),
#ifdef MINESCAN_PCL
      method_row("pcl-ndt", "NormalDistributionsTransform of the Point Cloud Library",
                 register_pcl_ndt),
      method_row("pcl-icp", "IterativeClosestPoint of the Point Cloud Library", register_pcl_icp),
      method_row("pcl-icp-plane", "the same with the distance from tangent planes",
                 register_pcl_icp_plane),
      method_row("pcl-gicp", "GeneralizedIterativeClosestPoint of the Point Cloud Library",
                 register_pcl_gicp),
      method_row("pcl-fpfh", "global start by features and sample consensus, Point Cloud Library",
                 register_pcl_global),
#endif
#ifdef MINESCAN_OPEN3D
      method_row("open3d-icp", "RegistrationICP of Open3D", register_open3d_icp),
      method_row("open3d-icp-plane", "the same with the distance from tangent planes",
                 register_open3d_icp_plane),
      method_row("open3d-gicp", "RegistrationGeneralizedICP of Open3D", register_open3d_gicp),
#endif
  };
  return table;
}

const Method& find_method(const std::string& name) { return find_row(methods(), "method", name); }

}  // namespace minescan
