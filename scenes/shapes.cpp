// SPDX-License-Identifier: MIT
#include "scenes/shapes.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/text.h"

namespace minescan {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& expected,
                         const std::string& found) {
  throw std::invalid_argument(what + ": expected " + expected + ", found " + found);
}

void check_length(const std::string& what, double metres) {
  if (!(metres > 0 && std::isfinite(metres))) refuse(what, "a number > 0 (m)", number_text(metres));
}

void check_sides(const std::string& what, int sides) {
  if (!(sides >= 3)) refuse(what, "3 sides or more", std::to_string(sides));
}

void check_frame(const std::string& what, const Frame& frame) {
  if (!frame.matrix().allFinite()) refuse(what, "a finite frame", "one that is not");
}

std::uint32_t vertex_count(const TriangleMesh& mesh, std::size_t more) {
  if (mesh.vertices.size() + more > std::numeric_limits<std::uint32_t>::max())
    refuse("mesh", "fewer than 2^32 vertices", std::to_string(mesh.vertices.size() + more));
  return static_cast<std::uint32_t>(mesh.vertices.size());
}

void add_triangle(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                  std::uint8_t material) {
  mesh.triangles.push_back({a, b, c});
  mesh.material.push_back(material);
}

/// Rings of `sides` corners each, one behind the other, corners counter-clockwise as seen from the
/// last ring's side: joined to their neighbours, first and last filled.
void add_rings(TriangleMesh& mesh, std::span<const Eigen::Vector3d> corners, std::uint32_t sides,
               std::uint8_t material) {
  const std::uint32_t first = vertex_count(mesh, corners.size());
  const auto rings = static_cast<std::uint32_t>(corners.size()) / sides;
  const std::uint32_t last = first + (rings - 1) * sides;
  for (const Eigen::Vector3d& p : corners) mesh.vertices.push_back(p.cast<float>());
  for (std::uint32_t ring = first; ring < last; ring += sides)
    for (std::uint32_t i = 0; i < sides; ++i) {
      const std::uint32_t a = ring + i;
      const std::uint32_t b = ring + (i + 1) % sides;
      add_triangle(mesh, a, b, b + sides, material);
      add_triangle(mesh, a, b + sides, a + sides, material);
    }
  for (std::uint32_t i = 1; i + 1 < sides; ++i) {
    add_triangle(mesh, first, first + i + 1, first + i, material);
    add_triangle(mesh, last, last + i, last + i + 1, material);
  }
}

void check_profile(std::span<const Eigen::Vector2d> profile) {
  if (profile.size() < 2)
    refuse("solid of revolution", "2 points or more", std::to_string(profile.size()));
  for (const Eigen::Vector2d& p : profile) {
    if (!std::isfinite(p.x())) refuse("solid of revolution", "finite x", number_text(p.x()));
    check_length("solid of revolution: radius", p.y());
  }
  if (!(profile.back().x() > profile.front().x()))
    refuse("solid of revolution", "a length > 0 (m)",
           number_text(profile.back().x() - profile.front().x()));
  for (std::size_t i = 1; i < profile.size(); ++i) {
    const Eigen::Vector2d step = profile[i] - profile[i - 1];
    const std::string place = "solid of revolution, point " + std::to_string(i);
    if (!(step.x() >= 0)) refuse(place, "x not falling", number_text(step.x()) + " m");
    if (step.x() > 0) continue;
    if (step.y() == 0) refuse(place, "no point twice", "the one before");
    // Two flat faces would lie upon each other.
    const bool at_first = profile[i].x() == profile.front().x();
    const bool at_last = profile[i].x() == profile.back().x();
    const double before = i >= 2 && profile[i - 2].x() == profile[i].x()
                              ? profile[i - 1].y() - profile[i - 2].y()
                              : 0;
    if ((at_first && step.y() < 0) || (at_last && step.y() > 0) || before * step.y() < 0)
      refuse(place, "no flat face upon another one",
             "radius " + number_text(profile[i].y()) + " m");
  }
}

/// Tangent of half the angle between two unit vectors; not finite if they are opposite.
double half_angle_tangent(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return a.cross(b).norm() / (1 + a.dot(b));
}

}  // namespace

void add_box(TriangleMesh& mesh, const Frame& frame, const Eigen::Vector3d& size,
             std::uint8_t material) {
  check_frame("box", frame);
  for (int axis = 0; axis < 3; ++axis) check_length("box: size", size[axis]);
  const Eigen::Vector3d half = size / 2;
  // Around x from below, then the same at the other end.
  const std::vector<Eigen::Vector3d> corners = {
      frame * Eigen::Vector3d(-half.x(), -half.y(), -half.z()),
      frame * Eigen::Vector3d(-half.x(), half.y(), -half.z()),
      frame * Eigen::Vector3d(-half.x(), half.y(), half.z()),
      frame * Eigen::Vector3d(-half.x(), -half.y(), half.z()),
      frame * Eigen::Vector3d(half.x(), -half.y(), -half.z()),
      frame * Eigen::Vector3d(half.x(), half.y(), -half.z()),
      frame * Eigen::Vector3d(half.x(), half.y(), half.z()),
      frame * Eigen::Vector3d(half.x(), -half.y(), half.z()),
  };
  add_rings(mesh, corners, 4, material);
}

void add_revolved(TriangleMesh& mesh, const Frame& frame, std::span<const Eigen::Vector2d> profile,
                  int sides, std::uint8_t material) {
  check_frame("solid of revolution", frame);
  check_sides("solid of revolution", sides);
  check_profile(profile);
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& p : profile)
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      corners.push_back(frame *
                        Eigen::Vector3d(p.x(), p.y() * std::cos(angle), p.y() * std::sin(angle)));
    }
  add_rings(mesh, corners, static_cast<std::uint32_t>(sides), material);
}

bool tube_fits(std::span<const Eigen::Vector3d> line, double radius) {
  double mitre_before = 0;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Eigen::Vector3d leg = line[i] - line[i - 1];
    double mitre_behind = 0;
    if (i + 1 < line.size())
      mitre_behind =
          radius * half_angle_tangent(leg.normalized(), (line[i + 1] - line[i]).normalized());
    if (!(leg.norm() > mitre_before + mitre_behind)) return false;
    mitre_before = mitre_behind;
  }
  return true;
}

void add_tube(TriangleMesh& mesh, std::span<const Eigen::Vector3d> line, double radius, int sides,
              std::uint8_t material) {
  check_length("tube: radius", radius);
  check_sides("tube", sides);
  if (line.size() < 2) refuse("tube", "2 points or more", std::to_string(line.size()));
  for (std::size_t i = 0; i < line.size(); ++i) {
    const std::string place = "tube, point " + std::to_string(i);
    if (!line[i].allFinite()) refuse(place, "finite coordinates", "some that are not");
    if (i > 0 && line[i] == line[i - 1]) refuse(place, "no point twice", "the one before");
  }
  if (!tube_fits(line, radius))
    refuse("tube of radius " + number_text(radius) + " m", "legs longer than the mitres at bends",
           "a bend too sharp");

  const Eigen::Vector3d start = (line[1] - line[0]).normalized();
  const Eigen::Vector3d side = start.unitOrthogonal();
  const Eigen::Vector3d other_side = start.cross(side);
  // From the line to the corners of the section.
  std::vector<Eigen::Vector3d> section;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    section.emplace_back(radius * (std::cos(angle) * side + std::sin(angle) * other_side));
  }
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector3d& o : section) corners.emplace_back(line[0] + o);
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Eigen::Vector3d before = (line[i] - line[i - 1]).normalized();
    const Eigen::Vector3d behind =
        i + 1 < line.size() ? (line[i + 1] - line[i]).normalized() : before;
    const Eigen::Vector3d normal = before + behind;  // of the plane that halves the bend
    for (Eigen::Vector3d& o : section) {
      // Along the leg to that plane; the next leg goes on from there, its section turned by the
      // smallest rotation from one leg to the other.
      o -= o.dot(normal) / before.dot(normal) * before;
      corners.emplace_back(line[i] + o);
    }
  }
  add_rings(mesh, corners, static_cast<std::uint32_t>(sides), material);
}

void append(TriangleMesh& mesh, const TriangleMesh& more) {
  const std::uint32_t first = vertex_count(mesh, more.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), more.vertices.begin(), more.vertices.end());
  mesh.material.insert(mesh.material.end(), more.material.begin(), more.material.end());
  mesh.triangles.reserve(mesh.triangles.size() + more.triangles.size());
  for (const auto& [a, b, c] : more.triangles)
    mesh.triangles.push_back({first + a, first + b, first + c});
}

}  // namespace minescan
