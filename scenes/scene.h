// SPDX-License-Identifier: MIT
// Mines: what can be made by name, and what comes out.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "core/pose.h"
#include "scenes/implicit.h"
#include "scenes/things.h"

namespace minescan {

/// Sides of triangles that make sense: below 1 cm the relief has no more to show, above 2 m a drift
/// is no longer a drift.
inline constexpr Range edge_length_range = between(0.01, 2);

/// How fine the triangles are.
struct MeshOptions {
  double edge_length = 0.05;
  int near_levels = 0;
  double near_range = 8;
};

template <class Visitor>
void fields(MeshOptions& o, Visitor&& field) {
  field("edge-length", o.edge_length, edge_length_range, "m", "side of the contouring cubes");
  field("near-levels", o.near_levels, between(0, 4), "",
        "how often edges are halved near a scanner");
  field("near-range", o.near_range, between(0.5, 100), "m",
        "reach of the shortest edges; twice that for edges twice as long, and so on");
}

/// A mine before it is meshed: a function of space, or the triangles of a file.
struct Scene {
  std::string name = {};
  MeshOptions mesh = {};
  /// The surface with the relief that edges of a length can show; empty for triangles of a file.
  std::function<ImplicitSurface(double edge_length)> surface = {};
  /// What was put into the mine: closed meshes of the things whose place lies in a part of the
  /// plan, materials as those of the surface. May be empty.
  std::function<TriangleMesh(const Eigen::AlignedBox2d& region)> things = {};
  TriangleMesh triangles = {};  // of a file

  std::vector<CentreLine> centre_lines = {};  // of drifts, at floor level
  Pose T_world_view = Pose::Identity();       // where to look from: x forward, z up
};

/// One row of the table of scenes.
struct SceneKind {
  std::string name = {};
  std::string description = {};
  /// What can be set. Parts of a mine have names of their own: those that the keys of `given` name
  /// ("drifts.main.width") are in the list too.
  std::function<std::vector<Field>(const Settings& given)> fields = {};
  /// Prepares it; the same settings and seed give the same mine.
  std::function<Scene(const Settings& settings, std::uint64_t seed)> make = {};
};

/// All scenes that can be made by name.
const std::vector<SceneKind>& scenes();

/// The row called `name`. Throws std::invalid_argument with the known names.
const SceneKind& find_scene(const std::string& name);

}  // namespace minescan
