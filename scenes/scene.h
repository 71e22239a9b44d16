// SPDX-License-Identifier: MIT
// Mines: what can be made by name, and what comes out.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"

namespace minescan {

/// A mine as triangles: a closed 2-manifold in the world frame (z up, metres) whose normals point
/// into the open space.
struct Scene {
  std::string name = {};
  TriangleMesh mesh = {};
};

/// One row of the table of scenes.
struct SceneKind {
  std::string name = {};
  std::string description = {};
  std::vector<Field> fields = {};
  /// Builds it; the same settings and seed give the same bytes for any number of threads.
  std::function<Scene(const Settings& settings, std::uint64_t seed)> make = {};
};

/// All scenes that can be made by name.
const std::vector<SceneKind>& scenes();

/// The row called `name`. Throws std::invalid_argument with the known names.
const SceneKind& find_scene(const std::string& name);

}  // namespace minescan
