// SPDX-License-Identifier: MIT
// Results of our own, written down: a difference means that NDT changed, not that it is wrong.
#include <gtest/gtest.h>

#include "clouds.h"
#include "registration/ndt.h"

namespace minescan {
namespace {

// NDT does not return the identity even for a cloud and itself: points are not spread evenly about
// their cell's mean, so the true pose is not quite the most likely one. The larger the cells, the
// larger this bias. Values with minescan 0.1.0.
TEST(PinnedBias, OfACloudRegisteredWithItself) {
  struct Pinned {
    double cell_size, translation, rotation;
  };
  for (const auto& [cell_size, translation, rotation] :
       {Pinned{0.5, 7.0633e-5, 6.922e-6}, Pinned{1, 4.5196e-4, 1.0345e-5},
        Pinned{2, 1.65286e-3, 1.98759e-4}}) {
    const PointCloud cloud = bumpy_tunnel(6000, 1);
    const RegistrationResult result = register_ndt(cloud, cloud, Pose::Identity(),
                                                   {.grid = {.cell_size = cell_size},
                                                    .sampling = {.ratio = 1},
                                                    .search = {.stop_step = 1e-8}});
    const PoseError error = pose_error(Pose::Identity(), result.T_target_source);
    EXPECT_EQ(result.status, Status::converged);
    // Coordinates of 12 m in single precision are exact to a micrometre; two are seen.
    EXPECT_NEAR(error.translation, translation, 3e-6) << cell_size;
    EXPECT_NEAR(error.rotation, rotation, 3e-7) << cell_size;
  }
}

}  // namespace
}  // namespace minescan
