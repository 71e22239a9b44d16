// SPDX-License-Identifier: MIT
// Our methods beside those of PCL; only in builds that have them.
#include <gtest/gtest.h>

#include <cmath>

#include "clouds.h"
#include "registration/methods.h"

namespace minescan {
namespace {

const Pose near_identity = displaced(Pose::Identity(), {0.2, -0.15, 0.1}, {0.5, -0.3, 0.8}, 0.05);

// The same score by two programs: PCL (1.13) searches for its cells in a tree of means.
TEST(PclMethods, NdtEndsWhereOurNdtRadiusDoes) {
  const PointCloud target = bumpy_tunnel(30000, 1), source = bumpy_tunnel(20000, 2);
  const RegistrationResult theirs =
      find_method("pcl-ndt").run(target, source, near_identity, {{"epsilon", "1e-12"}});
  const RegistrationResult ours =
      find_method("ndt-radius").run(target, source, near_identity, {{"stop-step", "1e-7"}});
  // PCL keeps points in single precision, 1e-6 m here, and its steps end there.
  EXPECT_NEAR(ours.score, theirs.score, 1e-5 * std::abs(theirs.score));
  const PoseError error = pose_error(theirs.T_target_source, ours.T_target_source);
  EXPECT_LT(error.translation, 1e-4);
  EXPECT_LT(error.rotation, 1e-5);
}

}  // namespace
}  // namespace minescan
