// SPDX-License-Identifier: MIT
#include "scenes/refine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "scenes/contour.h"

namespace minescan {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
constexpr std::uint32_t no_vertex = ~0U;
constexpr std::size_t grain = 4096;

// A vertex moves by no more than this part of the level's edge length: relief that the next shorter
// wavelength adds is far lower.
constexpr double farthest = 0.5;
// How near to the surface a vertex is good enough, as a part of the level's edge length.
constexpr double near_enough = 1e-5;
// A triangle may turn by 60 degrees when its corners move, and must be within 80 of the mean normal
// of its surroundings, unless it is not to begin with; slivers would turn over.
constexpr double least_cosine = 0.5;
constexpr double least_upright = 0.17;

/// A mesh under way, with what is known of its triangles.
struct Parts {
  std::vector<Eigen::Vector3f> vertices = {};
  std::vector<Triangle> triangles = {};
  std::vector<std::uint8_t> material = {};
  std::vector<std::uint8_t> level = {};
  std::vector<std::uint8_t> face = {};  // of the surface, see ImplicitSurface
};

void each(std::size_t count, const std::function<void(std::size_t i)>& body) {
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

bool is_near(const Eigen::Vector3d& point, std::span<const Eigen::Vector3d> places, double range) {
  return std::any_of(places.begin(), places.end(), [&](const Eigen::Vector3d& place) {
    return (point - place).squaredNorm() <= range * range;
  });
}

/// Whether each vertex is within `range` of a place.
std::vector<std::uint8_t> vertices_near(const std::vector<Eigen::Vector3f>& vertices,
                                        std::span<const Eigen::Vector3d> places, double range) {
  std::vector<std::uint8_t> near(vertices.size());
  each(vertices.size(),
       [&](std::size_t i) { near[i] = is_near(vertices[i].cast<double>(), places, range); });
  return near;
}

bool any_of_corners(const Triangle& t, const std::vector<std::uint8_t>& flags) {
  return (flags[t[0]] | flags[t[1]] | flags[t[2]]) != 0;
}

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
}

double length(const Parts& mesh, std::uint32_t a, std::uint32_t b) {
  return (mesh.vertices[a].cast<double>() - mesh.vertices[b].cast<double>()).norm();
}

/// A triangle cut at the given middles of its sides (0-1, 1-2, 2-0; no_vertex: not cut).
struct Cut {
  std::array<Triangle, 4> triangles = {};
  std::size_t count = 0;

  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) { triangles[count++] = {a, b, c}; }
};

Cut cut(const Parts& mesh, const Triangle& t, const Triangle& middle) {
  Cut result;
  const auto cuts = 3 - std::count(middle.begin(), middle.end(), no_vertex);
  if (cuts == 0) result.add(t[0], t[1], t[2]);
  if (cuts == 3) {
    result.add(t[0], middle[0], middle[2]);
    result.add(middle[0], t[1], middle[1]);
    result.add(middle[2], middle[1], t[2]);
    result.add(middle[0], middle[1], middle[2]);
  }
  if (cuts == 1) {
    std::size_t i = 0;
    while (middle[i] == no_vertex) ++i;
    const std::uint32_t a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
    result.add(a, middle[i], c);
    result.add(middle[i], b, c);
  }
  if (cuts == 2) {
    std::size_t i = 0;
    while (middle[i] != no_vertex) ++i;
    // Side b-c is whole; cut off corner a, then the rest along its shorter diagonal.
    const std::uint32_t b = t[i], c = t[(i + 1) % 3], a = t[(i + 2) % 3];
    const std::uint32_t in_ca = middle[(i + 1) % 3], in_ab = middle[(i + 2) % 3];
    result.add(a, in_ab, in_ca);
    if (length(mesh, in_ab, c) <= length(mesh, b, in_ca)) {
      result.add(in_ab, b, c);
      result.add(in_ab, c, in_ca);
    } else {
      result.add(in_ab, b, in_ca);
      result.add(b, c, in_ca);
    }
  }
  return result;
}

/// Halves all edges longer than `longest` with an end near a place. What becomes of an edge depends
/// on its ends alone, so neighbours agree.
void halve_edges(Parts& mesh, const std::vector<std::uint8_t>& near, double longest) {
  const auto is_long = [&](std::uint32_t a, std::uint32_t b) {
    return (near[a] | near[b]) != 0 && length(mesh, a, b) > longest;
  };
  std::vector<std::uint64_t> edges;
  for (const Triangle& t : mesh.triangles) {
    if (!any_of_corners(t, near)) continue;
    for (std::size_t i = 0; i < 3; ++i)
      if (is_long(t[i], t[(i + 1) % 3])) edges.push_back(edge_key(t[i], t[(i + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  const std::size_t old_vertices = mesh.vertices.size();
  mesh.vertices.resize(old_vertices + edges.size());
  each(edges.size(), [&](std::size_t i) {
    const Eigen::Vector3d a = mesh.vertices[edges[i] >> 32].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[edges[i] & 0xffffffff].cast<double>();
    mesh.vertices[old_vertices + i] = ((a + b) / 2).cast<float>();
  });

  const auto middle_of = [&](std::uint32_t a, std::uint32_t b) {
    if (!is_long(a, b)) return no_vertex;
    const auto found = std::lower_bound(edges.begin(), edges.end(), edge_key(a, b));
    return static_cast<std::uint32_t>(old_vertices +
                                      static_cast<std::size_t>(found - edges.begin()));
  };
  const auto cut_of = [&](const Triangle& t) {
    Triangle middle = {no_vertex, no_vertex, no_vertex};
    if (any_of_corners(t, near))
      for (std::size_t i = 0; i < 3; ++i) middle[i] = middle_of(t[i], t[(i + 1) % 3]);
    return cut(mesh, t, middle);
  };
  std::vector<std::size_t> first(mesh.triangles.size() + 1, 0);
  each(mesh.triangles.size(),
       [&](std::size_t i) { first[i + 1] = cut_of(mesh.triangles[i]).count; });
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) first[i + 1] += first[i];
  std::vector<Triangle> triangles(first.back());
  std::vector<std::uint8_t> material(first.back()), level(first.back()), face(first.back());
  each(mesh.triangles.size(), [&](std::size_t i) {
    const Cut pieces = cut_of(mesh.triangles[i]);
    for (std::size_t j = 0; j < pieces.count; ++j) {
      triangles[first[i] + j] = pieces.triangles[j];
      material[first[i] + j] = mesh.material[i];
      level[first[i] + j] = mesh.level[i];
      face[first[i] + j] = mesh.face[i];
    }
  });
  mesh.triangles = std::move(triangles);
  mesh.material = std::move(material);
  mesh.level = std::move(level);
  mesh.face = std::move(face);
}

/// The face of each triangle with a corner near a place: that of the surface at its middle. Beside
/// a sharp edge, the middle of a triangle that cuts across a bend may seem to be on the other side;
/// where the material there is not the triangle's own, the face is the usual one of that.
void find_faces(Parts& mesh, const std::vector<std::uint8_t>& near,
                const ImplicitSurface& surface) {
  std::vector<std::uint8_t> is_own(mesh.triangles.size(), 0);
  each(mesh.triangles.size(), [&](std::size_t i) {
    const Triangle& t = mesh.triangles[i];
    if (!any_of_corners(t, near)) return;
    const Eigen::Vector3f sum = mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]];
    const ImplicitSurface::Sample here = surface.at(sum.cast<double>() / 3);
    mesh.face[i] = here.face;
    is_own[i] = here.material == mesh.material[i];
  });
  constexpr std::size_t numbers = 256;
  std::vector<std::array<std::size_t, numbers>> counts(numbers);  // by material and face
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (is_own[i] != 0) ++counts[mesh.material[i]][mesh.face[i]];
  each(mesh.triangles.size(), [&](std::size_t i) {
    if (is_own[i] != 0 || !any_of_corners(mesh.triangles[i], near)) return;
    const auto& count = counts[mesh.material[i]];
    const auto most = std::max_element(count.begin(), count.end());
    if (*most > 0) mesh.face[i] = static_cast<std::uint8_t>(most - count.begin());
  });
}

constexpr std::int16_t sharp = -1;

/// The face of the surface on which each vertex lies; `sharp` where triangles of different faces
/// meet.
std::vector<std::int16_t> faces_of_vertices(const Parts& mesh) {
  constexpr std::int16_t unknown = -2;
  std::vector<std::int16_t> faces(mesh.vertices.size(), unknown);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t])
      faces[v] = faces[v] == unknown || faces[v] == mesh.face[t] ? mesh.face[t] : sharp;
  return faces;
}

/// Directions in which vertices move: normals, of wide surroundings, since corners of a sliver must
/// move alike.
std::vector<Eigen::Vector3d> directions(const Parts& mesh, const std::vector<std::uint8_t>& near) {
  constexpr int rounds = 2;  // of smoothing; assumed
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Triangle& t : mesh.triangles) {
    if (!any_of_corners(t, near)) continue;
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>();
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    for (const std::uint32_t v : t) normals[v] += normal;
  }
  for (int round = 0; round < rounds; ++round) {
    std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
      if (!any_of_corners(t, near)) continue;
      const Eigen::Vector3d sum = normals[t[0]] + normals[t[1]] + normals[t[2]];
      for (const std::uint32_t v : t) sums[v] += sum;
    }
    normals = std::move(sums);
  }
  each(normals.size(), [&](std::size_t i) { normals[i].normalize(); });  // zero stays zero
  return normals;
}

/// How far along `direction` (towards the open space) the surface is from `start`, if a place of
/// that face of it is within `limit`.
std::optional<double> distance_along(const ImplicitSurface& surface, std::int16_t face,
                                     const Eigen::Vector3d& start, const Eigen::Vector3d& direction,
                                     double limit, double tolerance) {
  std::int16_t last_face = face;
  const auto value = [&](double t) {
    const ImplicitSurface::Sample here = surface.at(start + t * direction);
    last_face = here.face;
    return here.value;
  };
  // Near a sharp edge the other face may be in front.
  const auto if_of_face = [&](double t) {
    return last_face == face ? std::optional(t) : std::nullopt;
  };
  double t_a = 0;
  double a = value(0);
  if (std::abs(a) <= tolerance) return 0;
  // The value is about a distance: positive in the rock.
  double t_b = std::clamp(a, -limit, limit);
  double b = value(t_b);
  const double end = std::copysign(limit, a);
  for (const double overshoot : {1.2, 0.0}) {
    if (std::abs(b) <= tolerance) return if_of_face(t_b);
    if ((a < 0) != (b < 0)) break;
    double next = end;
    if (overshoot > 0 && std::abs(b) < std::abs(a))
      next = std::clamp(overshoot * t_b * a / (a - b), -limit, limit);
    t_a = t_b;
    a = b;
    t_b = next;
    b = value(t_b);
  }
  if (!((a < 0) != (b < 0))) return std::nullopt;
  // False position; an end that stays counts half (Illinois), or steps would become tiny.
  constexpr int steps = 8;
  for (int i = 0; i < steps; ++i) {
    const double t = t_a + (t_b - t_a) * (a / (a - b));
    const double here = value(t);
    if (std::abs(here) <= tolerance) return if_of_face(t);
    if ((here < 0) != (b < 0)) {
      t_a = t_b;
      a = b;
    } else {
      a /= 2;
    }
    t_b = t;
    b = here;
  }
  return if_of_face(t_b);
}

/// Puts the vertices near a place on the surface, where it is near and no triangle turns over.
/// Those on sharp edges stay.
void project(Parts& mesh, const std::vector<std::uint8_t>& near, const ImplicitSurface& surface,
             double edge_length) {
  const std::vector<std::int16_t> faces = faces_of_vertices(mesh);
  const std::vector<Eigen::Vector3d> normals = directions(mesh, near);
  std::vector<Eigen::Vector3d> steps = normals;
  each(mesh.vertices.size(), [&](std::size_t i) {
    std::optional<double> distance;
    if (near[i] != 0 && faces[i] != sharp && steps[i].squaredNorm() > 0)
      distance = distance_along(surface, faces[i], mesh.vertices[i].cast<double>(), steps[i],
                                farthest * edge_length, near_enough * edge_length);
    steps[i] *= distance.value_or(0);
  });
  const auto normal_of = [&](const Triangle& t, const std::vector<Eigen::Vector3f>& vertices) {
    const Eigen::Vector3d a = vertices[t[0]].cast<double>();
    const Eigen::Vector3d b = vertices[t[1]].cast<double>();
    const Eigen::Vector3d c = vertices[t[2]].cast<double>();
    return Eigen::Vector3d((b - a).cross(c - a));
  };
  std::vector<Eigen::Vector3f> moved(mesh.vertices.size());
  // Triangles that turn have their corners' steps halved, in the end to nothing.
  constexpr int most_halvings = 3;
  std::vector<std::uint8_t> halvings(mesh.vertices.size(), 0);
  std::vector<std::uint8_t> turned(mesh.triangles.size());
  for (bool again = true; again;) {
    each(mesh.vertices.size(), [&](std::size_t i) {
      const double part = halvings[i] > most_halvings ? 0 : std::ldexp(1.0, -halvings[i]);
      moved[i] = (mesh.vertices[i].cast<double>() + part * steps[i]).cast<float>();
    });
    each(mesh.triangles.size(), [&](std::size_t i) {
      const Triangle& t = mesh.triangles[i];
      turned[i] = 0;
      if (!any_of_corners(t, near)) return;
      const Eigen::Vector3d before = normal_of(t, mesh.vertices);
      const Eigen::Vector3d after = normal_of(t, moved);
      const Eigen::Vector3d around = (normals[t[0]] + normals[t[1]] + normals[t[2]]).normalized();
      const bool upright =
          around.dot(after) > std::min(least_upright * after.norm(), around.dot(before));
      turned[i] = !(upright && before.dot(after) > least_cosine * before.norm() * after.norm());
    });
    again = false;
    std::vector<std::uint8_t> halved = halvings;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      if (turned[i] == 0) continue;
      for (const std::uint32_t v : mesh.triangles[i]) {
        if (halvings[v] > most_halvings) continue;
        halved[v] = static_cast<std::uint8_t>(halvings[v] + 1);
        again = true;
      }
    }
    halvings = std::move(halved);
  }
  mesh.vertices = std::move(moved);
}

void check(const TriangleMesh& mesh, double edge_length, std::span<const Eigen::Vector3d> places,
           const Refinement& refinement) {
  if (!(edge_length > 0 && std::isfinite(edge_length)))
    throw std::invalid_argument("edge-length: expected a number > 0 (m), found " +
                                number_text(edge_length));
  if (!(refinement.range >= 0 && std::isfinite(refinement.range)))
    throw std::invalid_argument("refinement: expected a range >= 0 (m), found " +
                                number_text(refinement.range));
  if (!(refinement.levels >= 0))
    throw std::invalid_argument("refinement: expected 0 or more levels, found " +
                                std::to_string(refinement.levels));
  const std::size_t materials =
      mesh.materials.size() * (static_cast<std::size_t>(refinement.levels) + 1);
  if (!(materials <= 256))
    throw std::invalid_argument("refinement: expected at most 256 materials of all levels, found " +
                                std::to_string(materials));
  for (const Eigen::Vector3d& place : places)
    if (!place.allFinite())
      throw std::invalid_argument("refinement: expected places with finite coordinates");
}

/// Each level makes four triangles of one.
void check_memory(const TriangleMesh& mesh, std::span<const Eigen::Vector3d> places,
                  const Refinement& refinement) {
  std::vector<std::uint8_t> level(mesh.vertices.size(), 0);
  for (int k = 1; k <= refinement.levels; ++k) {
    const double range = refinement.range * std::ldexp(1.0, refinement.levels - k);
    const std::vector<std::uint8_t> near = vertices_near(mesh.vertices, places, range);
    for (std::size_t i = 0; i < near.size(); ++i)
      if (near[i] != 0) level[i] = static_cast<std::uint8_t>(k);
  }
  double triangles = 0;
  for (const Triangle& t : mesh.triangles)
    triangles += std::pow(4.0, std::max({level[t[0]], level[t[1]], level[t[2]]}));
  // A triangle has 15 bytes, twice while it is cut, and half a vertex of 12; beside it are 1.5
  // edges of 8 while it is cut, or two directions for its half of a vertex.
  constexpr double bytes_per_triangle = 2 * (15 + 8) + 2 * 12;
  const double bytes = triangles * bytes_per_triangle;
  if (!(bytes <= contour_bytes_limit))
    throw std::invalid_argument(
        "refinement: " + std::to_string(refinement.levels) + " levels within " +
        number_text(refinement.range) + " m need about " +
        number_text(std::ceil(bytes / (1 << 30))) + " GiB of memory; expected at most " +
        number_text(contour_bytes_limit / (1 << 30)) + " GiB: use fewer levels or a shorter range");
}

}  // namespace

TriangleMesh refined(TriangleMesh mesh,
                     const std::function<ImplicitSurface(double edge_length)>& surface,
                     double edge_length, std::span<const Eigen::Vector3d> places,
                     const Refinement& refinement) {
  check(mesh, edge_length, places, refinement);
  if (refinement.levels == 0) return mesh;
  check_memory(mesh, places, refinement);

  const std::size_t materials = mesh.materials.size();
  Parts parts;
  parts.vertices = std::move(mesh.vertices);
  parts.triangles = std::move(mesh.triangles);
  parts.material = std::move(mesh.material);
  parts.level.resize(parts.triangles.size());
  parts.face.resize(parts.triangles.size());
  for (int k = 1; k <= refinement.levels; ++k) {
    const double edge = std::ldexp(edge_length, -k);
    const double range = refinement.range * std::ldexp(1.0, refinement.levels - k);
    const ImplicitSurface finer = surface(edge);
    if (finer.materials.size() != materials)
      throw std::invalid_argument("refinement: expected " + std::to_string(materials) +
                                  " materials at every edge length, found " +
                                  std::to_string(finer.materials.size()));
    mesh.materials.insert(mesh.materials.end(), finer.materials.begin(), finer.materials.end());

    std::vector<std::uint8_t> near = vertices_near(parts.vertices, places, range);
    // Pieces have their triangle's face, and later levels are within the first.
    if (k == 1) find_faces(parts, near, finer);
    halve_edges(parts, near, edge);
    near = vertices_near(parts.vertices, places, range);
    each(parts.triangles.size(), [&](std::size_t i) {
      const Triangle& t = parts.triangles[i];
      if ((near[t[0]] & near[t[1]] & near[t[2]]) != 0)
        parts.level[i] = static_cast<std::uint8_t>(k);
    });
    project(parts, near, finer, edge);
  }
  mesh.vertices = std::move(parts.vertices);
  mesh.triangles = std::move(parts.triangles);
  mesh.material = std::move(parts.material);
  each(mesh.material.size(), [&](std::size_t i) {
    mesh.material[i] = static_cast<std::uint8_t>(parts.level[i] * materials + mesh.material[i]);
  });
  return mesh;
}

}  // namespace minescan
