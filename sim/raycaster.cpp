// SPDX-License-Identifier: MIT
#include "sim/raycaster.h"

// The same order as in cmake/dependencies.cmake.
#if __has_include(<embree3/rtcore.h>)
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "sim/vector_math.h"

namespace minescan {
namespace {

// Bits of RTCRay::mask are compared with those of the geometry; with 0 nothing is ever hit.
constexpr unsigned every_geometry = ~0u;

#if RTC_VERSION_MAJOR >= 4
RTCIntersectArguments arguments(RTCRayQueryFlags flags) {
  RTCIntersectArguments result;
  rtcInitIntersectArguments(&result);
  result.flags = flags;
  return result;
}
void intersect1(RTCScene scene, RTCRayHit& ray) {
  RTCIntersectArguments incoherent = arguments(RTC_RAY_QUERY_FLAG_INCOHERENT);
  rtcIntersect1(scene, &ray, &incoherent);
}
void intersect16(const int* valid, RTCScene scene, RTCRayHit16& rays) {
  RTCIntersectArguments coherent = arguments(RTC_RAY_QUERY_FLAG_COHERENT);
  rtcIntersect16(valid, scene, &rays, &coherent);
}
#else
RTCIntersectContext context(RTCIntersectContextFlags flags) {
  RTCIntersectContext result;
  rtcInitIntersectContext(&result);
  result.flags = flags;
  return result;
}
void intersect1(RTCScene scene, RTCRayHit& ray) {
  RTCIntersectContext incoherent = context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcIntersect1(scene, &incoherent, &ray);
}
void intersect16(const int* valid, RTCScene scene, RTCRayHit16& rays) {
  RTCIntersectContext coherent = context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  rtcIntersect16(valid, scene, &coherent, &rays);
}
#endif

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

void check(const TriangleMesh& mesh) {
  if (mesh.triangles.empty())
    throw std::invalid_argument("mesh: expected at least 1 triangle, found none");
  if (mesh.triangles.size() >= no_triangle)
    throw std::invalid_argument(fmt::format("mesh: expected fewer than {} triangles, found {}",
                                            no_triangle, mesh.triangles.size()));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f& v = mesh.vertices[i];
    if (!v.allFinite())
      throw std::invalid_argument(
          fmt::format("mesh: vertex {}: expected finite coordinates, found ({}, {}, {})", i, v.x(),
                      v.y(), v.z()));
  }
  if (mesh.material.size() != mesh.triangles.size())
    throw std::invalid_argument(
        fmt::format("mesh: expected one material for each of {} triangles, "
                    "found {}",
                    mesh.triangles.size(), mesh.material.size()));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t vertex : mesh.triangles[i]) {
      if (vertex >= mesh.vertices.size())
        throw std::invalid_argument(
            fmt::format("mesh: triangle {}: expected vertices below {}, found {}", i,
                        mesh.vertices.size(), vertex));
    }
    if (mesh.material[i] >= mesh.materials.size())
      throw std::invalid_argument(
          fmt::format("mesh: triangle {}: expected a material below {}, found {}", i,
                      mesh.materials.size(), mesh.material[i]));
  }
  for (const Material& material : mesh.materials) {
    if (!(material.reflectance > 0 && material.reflectance <= 1))
      throw std::invalid_argument(
          fmt::format("mesh: material '{}': expected a reflectance in (0, 1], found {}",
                      material.name, material.reflectance));
    if (!(material.wetness >= 0 && material.wetness <= 1))
      throw std::invalid_argument(
          fmt::format("mesh: material '{}': expected a wetness in [0, 1], found {}", material.name,
                      material.wetness));
    for (const auto& [what, value] : {std::pair{"roughness", material.roughness},
                                      std::pair{"fine slope", material.fine_slope}}) {
      if (!(value >= 0 && std::isfinite(value)))
        throw std::invalid_argument(
            fmt::format("mesh: material '{}': expected a finite {} >= 0, found {}", material.name,
                        what, value));
    }
  }
}

RTCRayHit single_ray(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float near,
                     float far) {
  RTCRayHit r{};
  r.ray.org_x = origin.x();
  r.ray.org_y = origin.y();
  r.ray.org_z = origin.z();
  r.ray.dir_x = direction.x();
  r.ray.dir_y = direction.y();
  r.ray.dir_z = direction.z();
  r.ray.tnear = near;
  r.ray.tfar = far;
  r.ray.mask = every_geometry;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return r;
}

// Hits in double precision, given what Embree found: the triangle of each, none of them
// no_triangle, and its range.
void refine(const TriangleMesh& mesh, const RayPacket& rays, const Lanes& float_range,
            HitPacket& hits) {
  // Triangles and corners lie all over the memory. Step by step all rays wait for it at once.
  std::array<const Eigen::Vector3f*, 3 * lanes> at;
  for (std::size_t i = 0; i < lanes; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      at[3 * i + k] = &mesh.vertices[mesh.triangles[hits.triangle[i]][k]];
      __builtin_prefetch(at[3 * i + k]);
    }
  Corners corners;
  for (std::size_t i = 0; i < lanes; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      corners.a[k][i] = (*at[3 * i])[axis];
      corners.b[k][i] = (*at[3 * i + 1])[axis];
      corners.c[k][i] = (*at[3 * i + 2])[axis];
    }
  meet_planes(rays, corners, hits);
  for (std::size_t i = 0; i < lanes; ++i) {
    // Along a triangle seen edge-on the plane says nothing of where on it the ray arrived; Embree's
    // range does. Elsewhere the two differ by less than 1e-4 m.
    const auto found = static_cast<double>(float_range[i]);
    if (!(std::abs(hits.range[i] - found) <= 1e-3)) hits.range[i] = found;
  }
}

Hit refined(const TriangleMesh& mesh, const Ray& ray, std::uint32_t triangle, float range) {
  RayPacket rays;
  rays.count = 1;
  rays.set(0, ray);
  rays.fill();
  HitPacket hits;
  hits.triangle.fill(triangle);
  Lanes ranges;
  ranges.fill(range);
  refine(mesh, rays, ranges, hits);
  return hits.lane(0);
}

}  // namespace

struct RayCaster::Impl {
  TriangleMesh mesh;
  std::string error = {};  // Embree's words; written while building only
  Owned<RTCDevice> device = {};
  Owned<RTCScene> scene = {};

  Impl(TriangleMesh m, Tree tree) : mesh(std::move(m)) {
    check(mesh);
    // Embree reads 16 bytes at the last vertex, which has 12.
    mesh.vertices.reserve(mesh.vertices.size() + 1);

    device.reset(rtcNewDevice(nullptr));
    if (!device) fail(rtcGetDeviceError(nullptr));
    rtcSetDeviceErrorFunction(
        device.get(),
        [](void* self, RTCError, const char* text) { static_cast<Impl*>(self)->error = text; },
        this);

    const Owned<RTCGeometry> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    require_success();
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh.vertices.data(), 0, sizeof(mesh.vertices[0]),
                               mesh.vertices.size());
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh.triangles.data(), 0, sizeof(mesh.triangles[0]),
                               mesh.triangles.size());
    const RTCBuildQuality quality =
        tree == Tree::fast ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_LOW;
    rtcSetGeometryBuildQuality(geometry.get(), quality);
    rtcCommitGeometry(geometry.get());
    require_success();

    scene.reset(rtcNewScene(device.get()));
    require_success();
    // Without ROBUST a few rays in a million pass between neighbouring triangles.
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), quality);
    rtcAttachGeometry(scene.get(), geometry.get());
    rtcCommitScene(scene.get());
    require_success();
    rtcSetDeviceErrorFunction(device.get(), nullptr, nullptr);
  }

  // The error function takes errors away from rtcGetDeviceError only in Embree 4; `error` is set in
  // both.
  void require_success() {
    const RTCError code = rtcGetDeviceError(device.get());
    if (code != RTC_ERROR_NONE || !error.empty()) fail(code);
  }
  [[noreturn]] void fail(RTCError code) const {
    throw std::runtime_error(fmt::format("Embree {}: error {}: {}", RTC_VERSION_STRING,
                                         static_cast<int>(code),
                                         error.empty() ? "no device" : error));
  }

  // `found` has a geometry where a ray met something.
  void intersect(const RayPacket& rays, double max_range, RTCRayHit16& found) const {
    alignas(64) std::array<int, lanes> valid;
    for (std::size_t i = 0; i < lanes; ++i) valid[i] = i < rays.count ? -1 : 0;
    // One array after the other, which compilers turn into wide instructions.
    const auto narrow = [](const DoubleLanes& from, float* to) {
      for (std::size_t i = 0; i < lanes; ++i) to[i] = static_cast<float>(from[i]);
    };
    narrow(rays.origin[0], found.ray.org_x);
    narrow(rays.origin[1], found.ray.org_y);
    narrow(rays.origin[2], found.ray.org_z);
    narrow(rays.direction[0], found.ray.dir_x);
    narrow(rays.direction[1], found.ray.dir_y);
    narrow(rays.direction[2], found.ray.dir_z);
    std::fill_n(found.ray.tnear, lanes, 0.0f);
    std::fill_n(found.ray.tfar, lanes, static_cast<float>(max_range));
    std::fill_n(found.ray.time, lanes, 0.0f);
    std::fill_n(found.ray.mask, lanes, every_geometry);
    std::fill_n(found.ray.id, lanes, 0u);
    std::fill_n(found.ray.flags, lanes, 0u);
    std::fill_n(found.hit.geomID, lanes, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(found.hit.instID[0], lanes, RTC_INVALID_GEOMETRY_ID);
    intersect16(valid.data(), scene.get(), found);
  }

  Hit cast_one(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double min_range,
               double max_range) const {
    RTCRayHit r = single_ray(origin.cast<float>(), direction.cast<float>(),
                             static_cast<float>(min_range), static_cast<float>(max_range));
    intersect1(scene.get(), r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return refined(mesh, {origin, direction}, r.hit.primID, r.ray.tfar);
  }

  Hit cast_without_leak(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                        double min_range, double max_range) const {
    Hit hit = cast_one(origin, direction, min_range, max_range);
    if (hit.triangle != no_triangle) return hit;
    // Of rays aimed at a vertex, about 1 in 100 passes all triangles around it even in a ROBUST
    // scene. A hair beside it, eight times the rounding of single precision, there is none to miss.
    constexpr double hair = 1e-6;
    const Eigen::Vector3d u = direction.unitOrthogonal();
    const Eigen::Vector3d v = direction.cross(u);
    for (const Eigen::Vector3d& side : std::to_array<Eigen::Vector3d>({u, v, -u, -v})) {
      hit = cast_one(origin, direction + hair * side, min_range, max_range);
      if (hit.triangle != no_triangle)
        return refined(mesh, {origin, direction}, hit.triangle, static_cast<float>(hit.range));
    }
    return {};
  }
};

RayCaster::RayCaster(TriangleMesh mesh, Tree tree)
    : impl_(std::make_shared<const Impl>(std::move(mesh), tree)) {}

const TriangleMesh& RayCaster::mesh() const { return impl_->mesh; }

std::optional<Hit> RayCaster::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                   double min_range, double max_range) const {
  const Hit hit = impl_->cast_without_leak(origin, direction, min_range, max_range);
  if (hit.triangle == no_triangle) return std::nullopt;
  return hit;
}

Hit RayCaster::hit_of(const Ray& ray, const Glance& glance) const {
  return refined(impl_->mesh, ray, glance.triangle, glance.range);
}

void RayCaster::cast_packet(const RayPacket& rays, double max_range, HitPacket& hits) const {
  assert(rays.count >= 1 && rays.count <= lanes);
  RTCRayHit16 found;
  impl_->intersect(rays, max_range, found);
  Lanes ranges;
  bool all = true;
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::size_t ray = std::min(i, rays.count - 1);
    const bool met = found.hit.geomID[ray] != RTC_INVALID_GEOMETRY_ID;
    all &= met;
    hits.triangle[i] = met ? found.hit.primID[ray] : 0;
    ranges[i] = found.ray.tfar[ray];
    __builtin_prefetch(&impl_->mesh.triangles[hits.triangle[i]]);
    __builtin_prefetch(&impl_->mesh.material[hits.triangle[i]]);  // who casts asks for it next
  }
  refine(impl_->mesh, rays, ranges, hits);
  if (all) return;
  // Coherent packets lose axis-parallel rays now and then.
  for (std::size_t i = 0; i < rays.count; ++i)
    if (found.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID)
      hits.set(i,
               impl_->cast_without_leak(rays.origin.lane(i), rays.direction.lane(i), 0, max_range));
  for (std::size_t i = rays.count; i < lanes; ++i) hits.set(i, hits.lane(rays.count - 1));
}

void RayCaster::glance_packet(const RayPacket& rays, double max_range,
                              std::array<Glance, lanes>& glances) const {
  assert(rays.count >= 1 && rays.count <= lanes);
  RTCRayHit16 found;
  impl_->intersect(rays, max_range, found);
  for (std::size_t i = 0; i < rays.count; ++i) {
    if (found.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
      const Hit hit =
          impl_->cast_without_leak(rays.origin.lane(i), rays.direction.lane(i), 0, max_range);
      glances[i] = {.triangle = hit.triangle,
                    .range = static_cast<float>(hit.range),
                    .cosine = static_cast<float>(hit.cosine)};
      continue;
    }
    const Eigen::Vector3f normal(found.hit.Ng_x[i], found.hit.Ng_y[i], found.hit.Ng_z[i]);
    const Eigen::Vector3f direction(found.ray.dir_x[i], found.ray.dir_y[i], found.ray.dir_z[i]);
    glances[i] = {.triangle = found.hit.primID[i],
                  .range = found.ray.tfar[i],
                  .cosine = std::min(1.0f, std::abs(normal.dot(direction)) / normal.norm())};
  }
}

}  // namespace minescan
