// SPDX-License-Identifier: MIT
// Scenes from files: meshes that others made, with a material for each file or group.
#pragma once

#include <map>
#include <string>

#include "core/fields.h"
#include "scenes/named_parts.h"
#include "scenes/scene.h"

namespace minescan {

/// One file.
struct MeshPart {
  std::string file = {};
  std::string material = "sandstone";  // of groups that name none
};

template <class Visitor>
void fields(MeshPart& o, Visitor&& field) {
  field("file", o.file, ".ply, .obj or .stl");
  field("material", o.material, "of what has no other");
}

/// A material in place of one of mine_materials(), or beside them.
struct MaterialOptions {
  double reflectance = 0.35;
  double wetness = 0;
  double roughness = 0;
  double fine_slope = 0;
};

template <class Visitor>
void fields(MaterialOptions& o, Visitor&& field) {
  field("reflectance", o.reflectance, ratio, "", "diffuse, when dry, at the scanner's wavelength");
  field("wetness", o.wetness, between(0, 1), "", "0 dry, 1 wet");
  field("roughness", o.roughness, between(0, 1), "m", "RMS of the relief finer than the triangles");
  field("fine-slope", o.fine_slope, between(0, 10), "", "RMS slope of that relief");
}

struct ForeignOptions {
  std::map<std::string, MeshPart> parts = {};
  std::map<std::string, std::string> groups = {};  // material by the name of a group in a file
  std::map<std::string, MaterialOptions> materials = {};
};

template <class Visitor>
void fields(ForeignOptions& o, Visitor&& field) {
  for (auto& [name, part] : o.parts) fields(part, under("parts." + name + ".", field));
  for (auto& [name, material] : o.groups)
    field(("groups." + name).c_str(), material, "material of that group");
  for (auto& [name, material] : o.materials)
    fields(material, under("materials." + name + ".", field));
}

/// `options` with the further parts, groups and materials that `given` names.
ForeignOptions with_names(ForeignOptions options, const Settings& given);

/// All files as one scene. A group has the material that `groups` says, else the material of its
/// own name if there is one, else that of its file. Throws std::invalid_argument for no part, an
/// unknown material or a group that no file has, and as read_foreign_mesh.
Scene make_foreign(const ForeignOptions& options);

}  // namespace minescan
