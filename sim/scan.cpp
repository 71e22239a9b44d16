// SPDX-License-Identifier: MIT
#include "sim/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/gradient_noise.h"
#include "core/parallel.h"
#include "core/random.h"
#include "sim/footprint.h"
#include "sim/kinematics.h"
#include "sim/ranging.h"

namespace minescan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Neighbouring beams are cast together. On a grid in tiles of 4 rings by 4 columns: their rays stay
// closer together than 16 beams of one plane would, which makes Embree 1.7 times as fast. Without a
// grid, one after the other.
constexpr std::size_t tile_size = RayCaster::packet_size;
static_assert(tile_size == lanes);
constexpr double far = std::numeric_limits<double>::infinity();
struct TileShape {
  int rings;
  int columns;
};
TileShape tile_shape(const Scanner& s) {
  return s.pattern == Pattern::risley ? TileShape{16, 1} : TileShape{4, 4};
}

// Calls visit(array of a, the same array of b) for every per-point array of two scans.
constexpr std::size_t array_count = 14;
template <class Visit>
void for_each_array(Scan& a, Scan& b, const Visit& visit) {
  visit(a.cloud.points, b.cloud.points);
  visit(a.intensity, b.intensity);
  visit(a.time, b.time);
  visit(a.ring, b.ring);
  visit(a.column, b.column);
  visit(a.range, b.range);
  visit(a.true_range, b.true_range);
  visit(a.true_point, b.true_point);
  visit(a.incidence, b.incidence);
  visit(a.true_normal, b.true_normal);
  visit(a.triangle, b.triangle);
  visit(a.material, b.material);
  visit(a.flags, b.flags);
  visit(a.echo, b.echo);
}

// The relief of one material that its triangles leave out, as gradient noise.
struct FineRelief {
  Matrix3d to_lattice = Matrix3d::Zero();  // from the world; zero: no relief
  double height = 0;                       // metres per unit of noise
  double reach = 0;                        // metres along the beam
  std::uint64_t seed = 0;

  explicit FineRelief(const Material& material) {
    if (!(material.roughness > 0 && material.fine_slope > 0)) return;
    const double wavelength = 2 * std::numbers::pi * material.roughness / material.fine_slope;
    // On a plane of the lattice noise has another height than elsewhere; walls and floors are
    // parallel to the axes of the world, so the lattice is not.
    const Eigen::AngleAxisd turn(1, Vector3d(1, 2, 3).normalized());
    to_lattice = gradient_noise_wavelength / wavelength * turn.toRotationMatrix();
    height = material.roughness / gradient_noise_rms;
    reach = fine_relief_reach * wavelength;
    seed = derived_seed(0, "fine relief");  // the stone's, not the scan's
  }

  // What `hit` of `ray` is with the relief.
  void apply(const Ray& ray, Hit& hit) const {
    const Vector3d place = ray.origin + hit.range * ray.direction;
    const NoiseSlope noise = gradient_noise_slope(to_lattice * place, seed);
    // A surface seen edge-on moves by the reach, but not if its height is 0: no 0 / 0.
    hit.range -= std::clamp(height * noise.value / std::max(hit.cosine, 1e-9), -reach, reach);
    // The surface at height h(p) above the plane has the normal n - grad h, of the part of the
    // gradient in the plane.
    Vector3d slope = height * (to_lattice.transpose() * noise.slope);
    slope -= slope.dot(hit.normal) * hit.normal;
    // A side that faces away would be hidden; seen is one that faces the scanner by a tenth of what
    // the triangle does (assumed).
    const double away = -slope.dot(ray.direction);
    if (away > 0.9 * hit.cosine) slope *= 0.9 * hit.cosine / away;
    hit.normal = (hit.normal - slope).normalized();
    hit.cosine = std::clamp(-hit.normal.dot(ray.direction), 0.0, 1.0);
  }
};

// What carries the scanner: a place, or a path.
struct Carrier {
  Pose T_world_start = Pose::Identity();
  const SmoothPath* path = nullptr;
  double start = 0;

  Pose at(double time) const { return path ? path->at(start + time) : T_world_start; }
};

// The points of some columns: those of column c lie from place c * plane_beams * returns on.
struct Strip {
  Scan points = {};                              // its arrays only
  std::array<std::size_t, tile_size> kept = {};  // of each column
  std::size_t columns = 0;
};

// Everything about one scan that does not change from beam to beam.
struct Sweep {
  const RayCaster& caster;
  const Scanner& scanner;
  const Carrier& carrier;
  std::uint64_t seed;
  double age;
  Kinematics kinematics;
  Ranging ranging;
  std::vector<double> reflectance;  // of each material, as wet as it is
  std::vector<FineRelief> reliefs;  // of each material; empty if none has any
  bool noisy;

  // One beam on its way through the stages.
  struct Shot {
    int ring = 0;
    std::size_t column = 0;  // within the strip
    double time = 0;         // seconds
    Beam beam = {};          // as it goes, in the frame of the scan
  };

  // The sub-rays of one shot, as far as they were cast.
  struct Footprint {
    std::array<Ray, all_sub_rays> rays;
    std::array<Glance, all_sub_rays> glances;
    std::size_t count = 1;  // of them cast, the axis included
    double off_plane = 0;   // metres, of the farthest end from the plane that the axis meets
  };
  // Casts what the footprints of the shots need beyond the axes.
  void cast_footprints(std::span<const Ray> axes, std::span<const Shot> shots,
                       std::span<const Hit> hits, std::span<Footprint> footprints) const;
  Ray sub_ray(const Ray& axis, const Vector3d& along, std::size_t k) const;

  // Whether dust swallows a beam before it comes to the hit.
  bool lost_in_dust(std::uint64_t beam, const Hit& hit) const {
    Random random(derived_seed(seed, "dust"), beam);
    return random.uniform() > std::exp(-scanner.dust_loss * hit.range);
  }

  // Scans columns [first, first + count) into a strip that has room for them.
  void scan_strip(int first, int count, Strip& strip) const;
};

Ray Sweep::sub_ray(const Ray& axis, const Vector3d& along, std::size_t k) const {
  const SubRay& place = sub_rays()[k];
  const Vector3d across = axis.direction.cross(along);
  const double divergence_across =
      scanner.divergence_across > 0 ? scanner.divergence_across : scanner.divergence;
  // Diameters and full angles: half of them for radii.
  const Vector3d spot = scanner.spot / 2 * (place.along * along + place.across * across);
  const Vector3d spread =
      place.along * scanner.divergence / 2 * along + place.across * divergence_across / 2 * across;
  return {axis.origin + spot, (axis.direction + spread).normalized()};
}

void Sweep::cast_footprints(std::span<const Ray> axes, std::span<const Shot> shots,
                            std::span<const Hit> hits, std::span<Footprint> footprints) const {
  const std::size_t count = axes.size();
  std::array<Vector3d, tile_size> along;
  for (std::size_t i = 0; i < count; ++i) {
    along[i] = carrier.T_world_start.linear() * shots[i].beam.along;
    footprints[i].rays[0] = axes[i];
    footprints[i].glances[0] = {hits[i].triangle, static_cast<float>(hits[i].range),
                                static_cast<float>(hits[i].cosine)};
    footprints[i].count = few_sub_rays;
  }
  std::array<Ray, tile_size> rays;
  std::array<Glance, tile_size> glances;
  // The same sub-ray of all beams of the tile: these are neighbours.
  for (std::size_t k = 1; k < few_sub_rays; ++k) {
    for (std::size_t i = 0; i < count; ++i) rays[i] = sub_ray(axes[i], along[i], k);
    caster.glance_packet({rays.data(), count}, scanner.max_range, glances);
    for (std::size_t i = 0; i < count; ++i) {
      footprints[i].rays[k] = rays[i];
      footprints[i].glances[k] = glances[i];
    }
  }
  const auto measure_off_plane = [&](std::size_t i, std::size_t first) {
    Footprint& f = footprints[i];
    const Vector3d on_plane = axes[i].origin + hits[i].range * axes[i].direction;
    for (std::size_t k = first; k < f.count; ++k) {
      const bool met = f.glances[k].triangle != no_triangle && hits[i].triangle != no_triangle;
      const Vector3d end =
          f.rays[k].origin + static_cast<double>(f.glances[k].range) * f.rays[k].direction;
      f.off_plane = std::max(f.off_plane, met ? std::abs(hits[i].normal.dot(end - on_plane)) : far);
    }
  };
  for (std::size_t i = 0; i < count; ++i) {
    footprints[i].off_plane = 0;
    measure_off_plane(i, 1);
  }
  if (scanner.sub_rays <= static_cast<int>(few_sub_rays)) return;
  for (std::size_t i = 0; i < count; ++i) {
    Footprint& f = footprints[i];
    const auto leaves_plane = [&](std::size_t k) {
      if (f.glances[k].triangle == no_triangle) return true;
      const Vector3d on_plane = axes[i].origin + hits[i].range * axes[i].direction;
      const double expected =
          hits[i].normal.dot(on_plane - f.rays[k].origin) / hits[i].normal.dot(f.rays[k].direction);
      // True for NaN.
      return !(std::abs(expected - static_cast<double>(f.glances[k].range)) <= edge_tolerance);
    };
    bool edge = !scanner.edge_test || hits[i].triangle == no_triangle;
    for (std::size_t k = 1; k < few_sub_rays && !edge; ++k) edge = leaves_plane(k);
    if (!edge) continue;
    for (std::size_t k = few_sub_rays; k < all_sub_rays; ++k)
      f.rays[k] = sub_ray(axes[i], along[i], k);
    constexpr std::size_t rest = all_sub_rays - few_sub_rays;
    static_assert(rest <= RayCaster::packet_size);
    caster.glance_packet({f.rays.data() + few_sub_rays, rest}, scanner.max_range,
                         {f.glances.data() + few_sub_rays, rest});
    f.count = all_sub_rays;
    measure_off_plane(i, few_sub_rays);
  }
}

void Sweep::scan_strip(int first, int count, Strip& strip) const {
  Scan& out = strip.points;
  const TriangleMesh& mesh = caster.mesh();
  const TileShape tile = tile_shape(scanner);
  const auto plane_beams = static_cast<std::size_t>(scanner.plane_beams);
  const std::size_t column_size = plane_beams * static_cast<std::size_t>(scanner.returns);
  const bool with_footprint = scanner.sub_rays > 1;
  const Matrix3d R_start_world = carrier.T_world_start.linear().transpose();

  std::array<Kinematics::Plane, tile_size> planes;
  std::array<std::size_t, tile_size> place;  // of the next point of each column
  for (std::size_t c = 0; c < static_cast<std::size_t>(count); ++c) {
    const std::size_t column = static_cast<std::size_t>(first) + c;
    const double jitter =
        scanner.motion_jitter > 0 ? Random(derived_seed(seed, "head"), column).normal() : 0;
    planes[c] = kinematics.plane(static_cast<int>(column), jitter);
    place[c] = c * column_size;
  }

  std::array<Shot, tile_size> shots;
  std::array<Ray, tile_size> axes;
  std::array<Hit, tile_size> hits;
  std::array<Footprint, tile_size> footprints;
  std::array<std::uint8_t, tile_size * max_facets> sub_ray_of;  // each facet
  std::array<std::uint64_t, tile_size> beams = {};              // their numbers in the scan
  std::array<Echoes, tile_size> echoes;
  Light light;
  for (int first_ring = 0; first_ring < scanner.plane_beams; first_ring += tile.rings) {
    const int ring_count = std::min(tile.rings, scanner.plane_beams - first_ring);
    std::size_t rays = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(count); ++c)
      for (int r = first_ring; r < first_ring + ring_count; ++r, ++rays) {
        shots[rays].ring = r;
        shots[rays].column = c;
        beams[rays] =
            (static_cast<std::size_t>(first) + c) * plane_beams + static_cast<std::size_t>(r);
      }
    if (noisy)
      for (std::size_t block = 0; block < ranging.blocks(); ++block)
        four_normals(seed, beams, block, light.normals[block]);
    for (std::size_t i = 0; i < rays; ++i) {
      Shot& shot = shots[i];
      const Kinematics::Plane& plane = planes[shot.column];
      shot.time = kinematics.time(shot.ring, plane.column);
      shot.beam = kinematics.actual(plane, shot.ring, static_cast<double>(light.normals[0][3][i]));
      if (carrier.path) {
        const Pose T_start_scanner =
            carrier.T_world_start.inverse(Eigen::Isometry) * carrier.at(shot.time);
        shot.beam = {T_start_scanner * shot.beam.origin,
                     T_start_scanner.linear() * shot.beam.direction,
                     T_start_scanner.linear() * shot.beam.along};
      }
      axes[i] = {carrier.T_world_start * shot.beam.origin,
                 carrier.T_world_start.linear() * shot.beam.direction};
    }
    caster.cast_packet({axes.data(), rays}, scanner.max_range, hits);
    if (with_footprint)
      cast_footprints({axes.data(), rays}, {shots.data(), rays}, {hits.data(), rays},
                      {footprints.data(), rays});

    // What the light of each beam met, and which sub-ray each part of it is.
    light.beams = rays;
    std::size_t facets = 0;
    for (std::size_t i = 0; i < rays; ++i) {
      light.first[i] = facets;
      light.age[i] = age + shots[i].time;
      if (scanner.dust_loss > 0 && lost_in_dust(beams[i], hits[i])) continue;
      Hit& axis = hits[i];
      double shift = 0;  // of fine relief
      const auto add = [&](std::size_t k, double weight, double range, double signal) {
        if (!(range >= scanner.min_range && range <= scanner.max_range)) return;
        light.facets[facets] = {weight, range, signal};
        sub_ray_of[facets++] = static_cast<std::uint8_t>(k);
      };
      const std::size_t cast_count = with_footprint ? footprints[i].count : 1;
      const double* weights =
          cast_count == all_sub_rays ? all_weights().data() : few_weights().data();
      if (axis.triangle != no_triangle) {
        const std::uint8_t material = mesh.material[axis.triangle];
        if (!reliefs.empty() && reliefs[material].height > 0) {
          shift = -axis.range;
          reliefs[material].apply(axes[i], axis);
          shift += axis.range;
        }
        add(0, with_footprint ? weights[0] : 1, axis.range, reflectance[material] * axis.cosine);
      }
      for (std::size_t k = 1; k < cast_count; ++k) {
        const Glance& glance = footprints[i].glances[k];
        if (glance.triangle == no_triangle) continue;
        const std::uint8_t material = mesh.material[glance.triangle];
        const bool moved = axis.triangle != no_triangle && material == mesh.material[axis.triangle];
        add(k, weights[k], static_cast<double>(glance.range) + (moved ? shift : 0),
            reflectance[material] * static_cast<double>(glance.cosine));
      }
    }
    light.first[rays] = facets;
    ranging.measure(light, {echoes.data(), rays});
    Lanes cosines = {}, incidences;
    for (std::size_t i = 0; i < rays; ++i) cosines[i] = static_cast<float>(hits[i].cosine);
    arc_cosine(cosines.data(), incidences.data(), rays);

    for (std::size_t i = 0; i < rays; ++i) {
      const Shot& shot = shots[i];
      if (echoes[i].count == 0) continue;
      const Beam nominal = kinematics.nominal(planes[shot.column], shot.ring);
      for (std::size_t e = 0; e < echoes[i].count; ++e) {
        const Echo& echo = echoes[i].echo[e];
        const std::size_t k = sub_ray_of[light.first[i] + echo.facet];
        const Ray& ray = k == 0 ? axes[i] : footprints[i].rays[k];
        const Hit hit = k == 0 ? hits[i] : *caster.cast(ray.origin, ray.direction, 0, far);
        const std::size_t to = place[shot.column]++;
        // In single precision, as files hold them, so that writing and reading changes nothing: at
        // 48 m the last digit is worth 4 micrometres.
        out.cloud.points[to] =
            (nominal.origin + echo.range * nominal.direction).cast<float>().cast<double>();
        out.intensity[to] = echo.amplitude;
        out.time[to] = shot.time;
        out.ring[to] = static_cast<std::uint32_t>(shot.ring);
        out.column[to] = static_cast<std::uint32_t>(planes[shot.column].column);
        out.range[to] = echo.range;
        out.true_range[to] = hit.range;
        out.true_point[to] =
            (k == 0 ? Vector3d(shot.beam.origin + hit.range * shot.beam.direction)
                    : Vector3d(R_start_world * (ray.origin + hit.range * ray.direction -
                                                carrier.T_world_start.translation())))
                .cast<float>();
        out.incidence[to] = k == 0 ? incidences[i] : std::acos(static_cast<float>(hit.cosine));
        out.true_normal[to] = (R_start_world * hit.normal).cast<float>();
        out.triangle[to] = hit.triangle;
        out.material[to] = mesh.material[hit.triangle];
        out.flags[to] = echo.flags;
        // A surface seen at grazing incidence spreads along the beam, but it is one.
        if (with_footprint && footprints[i].off_plane <= surface_gap / 2)
          out.flags[to] &= static_cast<std::uint8_t>(~flag_mixed_pixel);
        out.echo[to] = static_cast<std::uint8_t>(e + 1);
      }
    }
  }
  for (std::size_t c = 0; c < static_cast<std::size_t>(count); ++c) {
    strip.kept[c] = place[c] - c * column_size;
  }
  strip.columns = static_cast<std::size_t>(count);
}

void check_pose(const Pose& T_world_scanner) {
  if (!T_world_scanner.matrix().allFinite())
    throw std::invalid_argument("T_world_scanner: expected finite numbers");
  // Poses are read from text of four digits and more, and normalised; this only finds scalings.
  if (!T_world_scanner.linear().isUnitary(1e-6))
    throw std::invalid_argument("T_world_scanner: expected a rotation and a translation");
}

// Appends the points of strips.
void append(Scan& result, std::span<Strip> strips, std::size_t column_size) {
  parallel_for(array_count, 1, [&](std::size_t wanted, std::size_t) {
    for (Strip& strip : strips) {
      std::size_t number = 0;
      for_each_array(result, strip.points, [&](auto& all, const auto& part) {
        if (number++ != wanted) return;
        for (std::size_t c = 0; c < strip.columns; ++c) {
          const auto from = part.begin() + static_cast<std::ptrdiff_t>(c * column_size);
          all.insert(all.end(), from, from + static_cast<std::ptrdiff_t>(strip.kept[c]));
        }
      });
    }
  });
}

Scan scan_from(const RayCaster& caster, const Scanner& scanner, const Carrier& carrier,
               std::uint64_t seed, const std::string& scene, double age) {
  const auto plane_beams = static_cast<std::size_t>(scanner.plane_beams);
  const auto planes = static_cast<std::size_t>(scanner.planes);
  const std::size_t column_size = plane_beams * static_cast<std::size_t>(scanner.returns);

  Scan result;
  result.scene = scene;
  result.scanner = scanner.name;
  result.seed = seed;
  result.T_world_scanner = carrier.T_world_start;
  result.beams = plane_beams * planes;
  if (scanner.pattern != Pattern::risley) {
    result.rings = static_cast<std::uint32_t>(plane_beams);
    result.columns = static_cast<std::uint32_t>(planes);
  }

  Sweep sweep{.caster = caster,
              .scanner = scanner,
              .carrier = carrier,
              .seed = seed,
              .age = age,
              .kinematics = Kinematics(scanner),
              .ranging = Ranging(scanner),
              .reflectance = {},
              .reliefs = {},
              .noisy = scanner.encoder_jitter > 0 || scanner.range_noise > 0 ||
                       scanner.range_noise_growth > 0 || scanner.amplitude_noise > 0};
  const std::vector<Material>& materials = caster.mesh().materials;
  for (const Material& m : materials) {
    sweep.reflectance.push_back(wet_reflectance(m));
    sweep.reliefs.emplace_back(m);
  }
  const auto has_relief = [](const FineRelief& relief) { return relief.height > 0; };
  if (!scanner.fine_relief || std::none_of(sweep.reliefs.begin(), sweep.reliefs.end(), has_relief))
    sweep.reliefs.clear();

  // A few strips at a time: their points stay in the processor's cache until they are appended,
  // and the result is written once.
  const auto columns = static_cast<std::size_t>(tile_shape(scanner).columns);
  std::array<Strip, 16> strips;
  for (Strip& strip : strips)
    for_each_array(strip.points, result, [&](auto& array, auto& all) {
      array.resize(std::min(columns, planes) * column_size);
      all.reserve(planes * column_size);
    });
  for (std::size_t first = 0; first < planes; first += strips.size() * columns) {
    const std::size_t here = std::min(strips.size() * columns, planes - first);
    parallel_for(here, columns, [&](std::size_t begin, std::size_t end) {
      sweep.scan_strip(static_cast<int>(first + begin), static_cast<int>(end - begin),
                       strips[begin / columns]);
    });
    append(result, {strips.data(), (here + columns - 1) / columns}, column_size);
  }
  return result;
}

}  // namespace

Scan scan(const RayCaster& caster, const Scanner& scanner, const Pose& T_world_scanner,
          std::uint64_t seed, const std::string& scene, double age) {
  check(scanner);
  check_pose(T_world_scanner);
  return scan_from(caster, scanner, {.T_world_start = T_world_scanner}, seed, scene, age);
}

Scan scan(const RayCaster& caster, const Scanner& scanner, const SmoothPath& T_world_scanner,
          double start, std::uint64_t seed, const std::string& scene) {
  check(scanner);
  const Pose T_world_start = T_world_scanner.at(start);
  T_world_scanner.at(start + Kinematics(scanner).duration());  // throws where the path has ended
  return scan_from(caster, scanner,
                   {.T_world_start = T_world_start, .path = &T_world_scanner, .start = start}, seed,
                   scene, start);
}

}  // namespace minescan
