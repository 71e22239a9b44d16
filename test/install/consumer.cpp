// SPDX-License-Identifier: MIT
#include <cstdio>

#include "core/random.h"
#include "registration/methods.h"

// A bumpy floor and two walls, moved by 5 cm, and found again by every method of our own.
int main() {
  minescan::PointCloud target, source;
  minescan::Random random(1, 0);
  const minescan::Pose truth(Eigen::Translation3d(0.05, -0.02, 0.01));
  for (int i = 0; i < 6000; ++i) {
    Eigen::Vector3d p(10 * random.uniform(), 10 * random.uniform(), 0.05 * random.normal());
    if (i % 3 != 0) p[i % 3 - 1] = 0.05 * p.z(), p.z() = 4 * random.uniform();
    target.points.push_back(p);
    source.points.push_back(truth.inverse() * p);
  }
  for (const minescan::Method& method : minescan::methods()) {
    if (method.name.starts_with("pcl-")) continue;
    minescan::Settings settings;
    if (minescan::find_field(method.fields, "sample-ratio")) settings["sample-ratio"] = "1";
    const auto result = method.run(target, source, minescan::Pose::Identity(), settings);
    const double error = minescan::pose_error(truth, result.T_target_source).translation;
    std::printf("%s: %.4f m\n", method.name.c_str(), error);
    // The bias of large cells is of the order of centimetres.
    if (!(error < 0.05)) return 1;
  }
}
