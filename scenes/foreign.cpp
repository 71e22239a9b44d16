// SPDX-License-Identifier: MIT
#include "scenes/foreign.h"

#include <algorithm>
#include <numbers>
#include <set>
#include <stdexcept>
#include <vector>

#include "core/text.h"
#include "scenes/foreign_mesh.h"
#include "scenes/materials.h"
#include "scenes/named_parts.h"

namespace minescan {
namespace {

std::vector<Material> materials_of(const ForeignOptions& options) {
  std::vector<Material> list = mine_materials();
  for (const auto& [name, o] : options.materials) {
    const Material material{.name = name,
                            .reflectance = o.reflectance,
                            .wetness = o.wetness,
                            .roughness = o.roughness,
                            .fine_slope = o.fine_slope};
    const auto known = std::find_if(list.begin(), list.end(),
                                    [&](const Material& m) { return m.name == material.name; });
    if (known != list.end()) {
      *known = material;
    } else {
      list.push_back(material);
    }
  }
  if (list.size() > 256)
    throw std::invalid_argument("mesh: expected at most 256 materials, found " +
                                std::to_string(list.size()));
  return list;
}

bool is_material(const std::vector<Material>& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(), [&](const Material& m) { return m.name == name; });
}

std::uint8_t material_index(const std::vector<Material>& list, const std::string& name) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].name == name) return static_cast<std::uint8_t>(i);
    names.push_back(list[i].name);
  }
  throw std::invalid_argument("mesh: " + unknown_name("material", name, names));
}

}  // namespace

ForeignOptions with_names(ForeignOptions options, const Settings& given) {
  add_named_parts(options.parts, "parts.", given);
  add_named_parts(options.materials, "materials.", given);
  constexpr std::string_view groups = "groups.";
  for (const auto& [key, unused] : given)
    if (key.starts_with(groups) && key.size() > groups.size())
      options.groups.try_emplace(key.substr(groups.size()));
  return options;
}

Scene make_foreign(const ForeignOptions& options) {
  if (options.parts.empty()) throw std::invalid_argument("mesh: expected a file (parts.NAME.file)");
  Scene scene{.name = "mesh"};
  TriangleMesh& mesh = scene.triangles;
  mesh.materials = materials_of(options);
  std::set<std::string> seen;
  for (const auto& [name, part] : options.parts) {
    if (part.file.empty())
      throw std::invalid_argument("mesh: part '" + name + "': expected a file, found none");
    const ForeignMesh file = read_foreign_mesh(part.file);
    std::vector<std::uint8_t> material_of_group;
    for (const std::string& group : file.groups) {
      const auto wanted = options.groups.find(group);
      const std::string& material = wanted != options.groups.end()       ? wanted->second
                                    : is_material(mesh.materials, group) ? group
                                                                         : part.material;
      material_of_group.push_back(material_index(mesh.materials, material));
      seen.insert(group);
    }
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), file.vertices.begin(), file.vertices.end());
    for (std::size_t t = 0; t < file.triangles.size(); ++t) {
      const auto& [a, b, c] = file.triangles[t];
      mesh.triangles.push_back({first + a, first + b, first + c});
      mesh.material.push_back(material_of_group.at(file.group[t]));
    }
  }
  for (const auto& [group, unused] : options.groups)
    if (!seen.contains(group))
      throw std::invalid_argument("mesh: " +
                                  unknown_name("group", group, {seen.begin(), seen.end()}));
  // From the middle of what there is, along its longer side.
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(v);
  scene.T_world_view = Pose(Eigen::Translation3d(box.center().cast<double>()));
  if (box.sizes().y() > box.sizes().x())
    scene.T_world_view.rotate(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  return scene;
}

}  // namespace minescan
