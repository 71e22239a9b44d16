// SPDX-License-Identifier: MIT
#include "scenes/exact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "core/text.h"
#include "scenes/materials.h"

namespace minescan {
namespace {

constexpr double eye_height = 1.7;

/// The half space beyond a plane: normal . p > offset.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // out of the open space, unit
  double offset = 0;
};

/// Boxes whose union is the open space.
struct Rooms {
  std::vector<Plane> planes = {};
  std::vector<std::array<std::size_t, 6>> boxes = {};  // indices into `planes`
  Eigen::AlignedBox3d bounds = {};
};

/// Faces that lie in one plane are one face, for there is no edge between them.
std::size_t plane_index(Rooms& rooms, const Plane& plane) {
  for (std::size_t i = 0; i < rooms.planes.size(); ++i)
    if ((rooms.planes[i].normal - plane.normal).norm() < 1e-9 &&
        std::abs(rooms.planes[i].offset - plane.offset) < 1e-9)
      return i;
  rooms.planes.push_back(plane);
  return rooms.planes.size() - 1;
}

/// A box from `low` to `high` turned about the z axis by `heading`.
void add_room(Rooms& rooms, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
              double heading = 0) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::array<std::size_t, 6> box = {};
  for (int axis = 0; axis < 3; ++axis) {
    box[2 * axis] = plane_index(rooms, {-R.col(axis), -low[axis]});
    box[2 * axis + 1] = plane_index(rooms, {R.col(axis), high[axis]});
  }
  rooms.boxes.push_back(box);
  for (int corner = 0; corner < 8; ++corner)
    rooms.bounds.extend(R * Eigen::Vector3d((corner & 1) != 0 ? high.x() : low.x(),
                                            (corner & 2) != 0 ? high.y() : low.y(),
                                            (corner & 4) != 0 ? high.z() : low.z()));
}

ImplicitSurface::Sample sample(const Rooms& rooms, const Eigen::Vector3d& p) {
  ImplicitSurface::Sample nearest = {.value = std::numeric_limits<double>::infinity()};
  for (const auto& box : rooms.boxes) {
    ImplicitSurface::Sample outside = {.value = -std::numeric_limits<double>::infinity()};
    for (const std::size_t i : box) {
      const double distance = rooms.planes[i].normal.dot(p) - rooms.planes[i].offset;
      if (distance > outside.value)
        outside = {.value = distance, .face = static_cast<std::uint8_t>(i + 1)};
    }
    if (outside.value < nearest.value) nearest = outside;
  }
  return nearest;
}

/// A surface whose values change by at most 1 per metre.
ImplicitSurface surface_from(std::function<ImplicitSurface::Sample(const Eigen::Vector3d&)> at,
                             const Eigen::AlignedBox3d& bounds, double area) {
  ImplicitSurface surface;
  surface.range = [at](const Eigen::Vector3d& centre, double radius) {
    const double value = at(centre).value;
    return Interval{value - radius, value + radius};
  };
  surface.at = std::move(at);
  surface.bounds = bounds;
  surface.area = area;
  surface.materials = {mine_materials().at(sandstone)};
  return surface;
}

Scene scene_from(const std::string& name, const MeshOptions& mesh, const ImplicitSurface& surface,
                 const Eigen::Vector3d& eye) {
  Scene scene{.name = name, .mesh = mesh};
  scene.surface = [surface](double) { return surface; };
  scene.T_world_view = Pose(Eigen::Translation3d(eye));
  return scene;
}

Scene scene_from(const std::string& name, const MeshOptions& mesh, const Rooms& rooms, double area,
                 const Eigen::Vector3d& eye) {
  const auto at = [rooms](const Eigen::Vector3d& p) { return sample(rooms, p); };
  return scene_from(name, mesh, surface_from(at, rooms.bounds, area), eye);
}

}  // namespace

Scene make_box(const BoxOptions& o, std::uint64_t) {
  Rooms rooms;
  add_room(rooms, {-o.length / 2, -o.width / 2, 0}, {o.length / 2, o.width / 2, o.height});
  const double area = 2 * (o.length * o.width + o.width * o.height + o.height * o.length);
  return scene_from("box", o.mesh, rooms, area,
                    {-0.4 * o.length, 0, std::min(eye_height, o.height / 2)});
}

Scene make_cylinder(const CylinderOptions& o, std::uint64_t) {
  const double half = o.length / 2, r = o.radius;
  const auto at = [half, r](const Eigen::Vector3d& p) {
    const double wall = std::hypot(p.y(), p.z() - r) - r;
    const double end = std::abs(p.x()) - half;
    if (wall >= end) return ImplicitSurface::Sample{.value = wall, .face = 1};
    return ImplicitSurface::Sample{.value = end,
                                   .face = static_cast<std::uint8_t>(p.x() < 0 ? 2 : 3)};
  };
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(-half, -r, 0), Eigen::Vector3d(half, r, 2 * r));
  const double area = 2 * std::numbers::pi * r * (r + o.length);
  return scene_from("cylinder", o.mesh, surface_from(at, bounds, area),
                    {-0.4 * o.length, 0, std::min(eye_height, r)});
}

Scene make_corridor(const CorridorOptions& o, std::uint64_t) {
  const double half = o.width / 2;
  if (!(std::min(o.first_length, o.second_length) > half))
    throw std::invalid_argument("corridor: expected legs longer than half the width, " +
                                number_text(half) + " m, found " + number_text(o.first_length) +
                                " and " + number_text(o.second_length) + " m");
  Rooms rooms;
  add_room(rooms, {-o.first_length, -half, 0}, {half, half, o.height});
  add_room(rooms, {-half, -half, 0}, {half, o.second_length, o.height});
  const double middle = o.first_length + o.second_length;
  const double area = 2 * middle * o.width + 2 * (middle + o.width) * o.height;
  return scene_from("corridor", o.mesh, rooms, area,
                    {-0.9 * o.first_length, 0, std::min(eye_height, o.height / 2)});
}

Scene make_incised_planes(const IncisedPlanesOptions& o, std::uint64_t) {
  // A groove's corner must stay within the floor.
  const double reach = (o.groove_length + o.groove_width) / 2 * std::numbers::sqrt2 / 2;
  if (!(reach < o.side / 2 && o.groove_width < o.groove_length))
    throw std::invalid_argument(
        "incised-planes: expected grooves within the floor, longer than wide; found length " +
        number_text(o.groove_length) + ", width " + number_text(o.groove_width) + ", side " +
        number_text(o.side) + " m");
  Rooms rooms;
  const double half = o.side / 2;
  add_room(rooms, {-half, -half, 0}, {half, half, o.height});
  for (const double heading : {std::numbers::pi / 4, -std::numbers::pi / 4})
    add_room(rooms, {-o.groove_length / 2, -o.groove_width / 2, -o.groove_depth},
             {o.groove_length / 2, o.groove_width / 2, o.height}, heading);
  const double area =
      2 * o.side * o.side + 4 * o.side * o.height + 4 * o.groove_length * o.groove_depth;
  Scene scene = scene_from("incised-planes", o.mesh, rooms, area,
                           {-0.45 * o.side, 0, std::min(2 * eye_height, 0.8 * o.height)});
  // Down at the grooves.
  scene.T_world_view.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
  return scene;
}

}  // namespace minescan
