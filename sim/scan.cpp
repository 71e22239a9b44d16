// SPDX-License-Identifier: MIT
#include "sim/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "sim/fine_relief.h"
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

// Every per-point array of a scan.
auto arrays_of(Scan& scan) {
  return std::tie(scan.cloud.points, scan.intensity, scan.time, scan.ring, scan.column, scan.range,
                  scan.true_range, scan.true_point, scan.incidence, scan.true_normal, scan.triangle,
                  scan.material, scan.flags, scan.echo);
}

// Calls visit(array...) for each of them, with the same ones of other scans, from several threads.
template <class Visit, class... Scans>
void for_each_array(const Visit& visit, Scans&... scans) {
  constexpr std::size_t arrays = std::tuple_size_v<decltype(arrays_of(std::declval<Scan&>()))>;
  parallel_for(arrays, 1, [&](std::size_t wanted, std::size_t) {
    [&]<std::size_t... number>(std::index_sequence<number...>) {
      const auto visit_wanted = [&]<std::size_t n>(std::integral_constant<std::size_t, n>) {
        if (n == wanted) visit(std::get<n>(arrays_of(scans))...);
      };
      (visit_wanted(std::integral_constant<std::size_t, number>{}), ...);
    }
    (std::make_index_sequence<arrays>{});
  });
}

// What carries the scanner: a place, or a path.
struct Carrier {
  Pose T_world_start = Pose::Identity();
  const SmoothPath* path = nullptr;
  double start = 0;

  Pose at(double time) const { return path ? path->at(start + time) : T_world_start; }
};

// One beam.
struct Shot {
  int ring = 0;
  std::size_t column = 0;                 // within the tile
  std::uint64_t number = 0;               // in the scan
  double time = 0;                        // seconds
  Vector3d origin = Vector3d::Zero();     // of the beam as it goes, in the frame of the scan
  Vector3d direction = Vector3d::Zero();  // unit
};

// The sub-rays of a beam, as far as they were cast.
struct Footprint {
  std::array<Ray, all_sub_rays> rays;
  std::array<Glance, all_sub_rays> glances;
  std::size_t count = 1;  // of them cast, the axis included
  double off_plane = 0;   // metres, of the farthest end from the plane that the axis meets

  std::span<const double> weights() const {
    constexpr static double all = 1;
    if (count == 1) return {&all, 1};
    if (count == few_sub_rays) return few_weights();
    return all_weights();
  }
};

// Beams on their way through the stages: aimed, cast, received, recorded.
struct Beams {
  std::size_t count = 0;
  std::array<Shot, tile_size> shots;
  std::array<Ray, tile_size> axes;        // world frame
  std::array<Vector3d, tile_size> along;  // world frame, Beam::along; of footprints only
  std::array<Hit, tile_size> hits;        // of the axes
  std::array<double, tile_size> shifts;   // of the axes by fine relief, metres
  std::array<Footprint, tile_size> footprints;
  Light light;
  std::array<Echoes, tile_size> echoes;
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

  // How the head stands in the columns of a tile.
  using Planes = std::array<Kinematics::Plane, tile_size>;

  // Scans neighbouring columns, a tile wide or less, from `first` on. places[c]: of the first point
  // of column first + c; afterwards behind its last one.
  void scan_columns(std::size_t first, std::span<std::size_t> places, Scan& out) const;

  // The stages. `shots` tell ring, column and number.
  void aim(const Planes& planes, Beams& beams) const;
  void cast(Beams& beams) const;
  void receive(Beams& beams) const;
  // place[c]: of the next point of column c.
  void record(const Planes& planes, const Beams& beams, Scan& out,
              std::span<std::size_t> place) const;

  // Gives the hits of the axes the relief of their materials.
  void apply_reliefs(Beams& beams) const;
  // By how much fine relief moves a triangle that a sub-ray of beam i met, metres.
  double shift_of(const Beams& beams, std::size_t i, std::uint32_t triangle) const;
  // Casts what the footprints need beyond the axes.
  void cast_footprints(Beams& beams) const;
  Ray sub_ray(const Ray& axis, const Vector3d& along, std::size_t k) const;
  // Whether dust swallows a beam before it comes to the hit.
  bool lost_in_dust(std::uint64_t beam, const Hit& hit) const;
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

bool Sweep::lost_in_dust(std::uint64_t beam, const Hit& hit) const {
  if (scanner.dust_loss == 0) return false;
  Random random(derived_seed(seed, "dust"), beam);
  return random.uniform() > std::exp(-scanner.dust_loss * hit.range);
}

void Sweep::aim(const Planes& planes, Beams& beams) const {
  if (noisy) {
    std::array<std::uint64_t, tile_size> streams = {};
    for (std::size_t i = 0; i < beams.count; ++i) streams[i] = beams.shots[i].number;
    for (std::size_t block = 0; block < ranging.blocks(); ++block)
      four_normals(seed, streams, block, beams.light.normals[block]);
  }
  const Matrix3d R_world_start = carrier.T_world_start.linear();
  const Vector3d start = carrier.T_world_start.translation();
  const bool one_origin = !carrier.path && !kinematics.has_lever();
  for (std::size_t i = 0; i < beams.count; ++i) {
    Shot& shot = beams.shots[i];
    const Kinematics::Plane& plane = planes[shot.column];
    shot.time = kinematics.time(shot.ring, plane.column);
    Beam beam =
        kinematics.actual(plane, shot.ring, static_cast<double>(beams.light.normals[0][3][i]));
    if (carrier.path) {
      const Pose T_start_scanner =
          carrier.T_world_start.inverse(Eigen::Isometry) * carrier.at(shot.time);
      beam = {T_start_scanner * beam.origin, T_start_scanner.linear() * beam.direction,
              T_start_scanner.linear() * beam.along};
    }
    shot.origin = beam.origin;
    shot.direction = beam.direction;
    beams.axes[i].origin = one_origin ? start : carrier.T_world_start * beam.origin;
    beams.axes[i].direction = R_world_start * beam.direction;
    if (scanner.sub_rays > 1) beams.along[i] = R_world_start * beam.along;
  }
}

void Sweep::cast(Beams& beams) const {
  caster.cast_packet({beams.axes.data(), beams.count}, scanner.max_range, beams.hits);
  if (scanner.sub_rays > 1) cast_footprints(beams);
  apply_reliefs(beams);
}

void Sweep::apply_reliefs(Beams& beams) const {
  beams.shifts.fill(0);
  if (reliefs.empty()) return;
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  const auto material = [&](std::size_t i) { return material_of[beams.hits[i].triangle]; };
  std::array<bool, tile_size> done;
  for (std::size_t i = 0; i < beams.count; ++i)
    done[i] = beams.hits[i].triangle == no_triangle || !reliefs[material(i)].exists();
  for (std::size_t i = 0; i < beams.count; ++i) {
    if (done[i]) continue;
    // All beams that met the same material.
    std::array<std::uint8_t, tile_size> chosen;
    std::size_t count = 0;
    for (std::size_t j = i; j < beams.count; ++j) {
      if (done[j] || material(j) != material(i)) continue;
      chosen[count++] = static_cast<std::uint8_t>(j);
      done[j] = true;
    }
    reliefs[material(i)].apply(beams.axes, {chosen.data(), count}, beams.hits, beams.shifts);
  }
}

void Sweep::cast_footprints(Beams& beams) const {
  const std::size_t count = beams.count;
  std::array<Ray, tile_size> rays;
  std::array<Glance, tile_size> glances;
  // The same sub-ray of all beams of the tile: these are neighbours.
  for (std::size_t k = 1; k < few_sub_rays; ++k) {
    for (std::size_t i = 0; i < count; ++i) rays[i] = sub_ray(beams.axes[i], beams.along[i], k);
    caster.glance_packet({rays.data(), count}, scanner.max_range, glances);
    for (std::size_t i = 0; i < count; ++i) {
      beams.footprints[i].rays[k] = rays[i];
      beams.footprints[i].glances[k] = glances[i];
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    Footprint& f = beams.footprints[i];
    const Ray& axis = beams.axes[i];
    const Hit& hit = beams.hits[i];
    f.off_plane = 0;
    bool edge = !scanner.edge_test;
    // How far the ends of some sub-rays are off the plane that the axis meets: at right angles to
    // it, and, for the test, along the sub-ray.
    const auto look_at = [&](std::size_t first, std::size_t end) {
      for (std::size_t k = first; k < end; ++k) {
        if (f.glances[k].triangle == no_triangle || hit.triangle == no_triangle) {
          f.off_plane = far;
          edge = true;
          continue;
        }
        const double range = static_cast<double>(f.glances[k].range);
        const Vector3d on_plane = axis.origin + hit.range * axis.direction;
        const double off =
            std::abs(hit.normal.dot(f.rays[k].origin + range * f.rays[k].direction - on_plane));
        f.off_plane = std::max(f.off_plane, off);
        // True for NaN.
        if (!(off <= edge_tolerance * std::abs(hit.normal.dot(f.rays[k].direction)))) edge = true;
      }
    };
    f.count = few_sub_rays;
    look_at(1, few_sub_rays);
    if (scanner.sub_rays <= static_cast<int>(few_sub_rays) || !edge) continue;
    for (std::size_t k = few_sub_rays; k < all_sub_rays; ++k)
      f.rays[k] = sub_ray(axis, beams.along[i], k);
    constexpr std::size_t rest = all_sub_rays - few_sub_rays;
    static_assert(rest <= RayCaster::packet_size);
    caster.glance_packet({f.rays.data() + few_sub_rays, rest}, scanner.max_range,
                         {f.glances.data() + few_sub_rays, rest});
    f.count = all_sub_rays;
    look_at(few_sub_rays, all_sub_rays);
  }
}

void Sweep::receive(Beams& beams) const {
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  Light& light = beams.light;
  std::size_t sub_rays = 1;
  for (std::size_t i = 0; i < beams.count; ++i)
    sub_rays = std::max(sub_rays, beams.footprints[i].count);
  light.clear(sub_rays);
  for (std::size_t i = 0; i < beams.count; ++i) {
    const Shot& shot = beams.shots[i];
    const Hit& axis = beams.hits[i];
    const Footprint& footprint = beams.footprints[i];
    light.age[i] = age + shot.time;
    if (lost_in_dust(shot.number, axis)) continue;
    const std::span<const double> weights = footprint.weights();
    const auto add = [&](std::size_t k, double range, double signal) {
      if (range >= scanner.min_range && range <= scanner.max_range)
        light.set(k, i, {weights[k], range, signal});
    };
    if (axis.triangle != no_triangle)
      add(0, axis.range, reflectance[material_of[axis.triangle]] * axis.cosine);
    for (std::size_t k = 1; k < footprint.count; ++k) {
      const Glance& glance = footprint.glances[k];
      if (glance.triangle == no_triangle) continue;
      add(k, static_cast<double>(glance.range) + shift_of(beams, i, glance.triangle),
          reflectance[material_of[glance.triangle]] * static_cast<double>(glance.cosine));
    }
  }
  ranging.measure(light, {beams.echoes.data(), beams.count});
}

double Sweep::shift_of(const Beams& beams, std::size_t i, std::uint32_t triangle) const {
  const std::uint32_t axis = beams.hits[i].triangle;
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  return axis != no_triangle && material_of[axis] == material_of[triangle] ? beams.shifts[i] : 0;
}

void Sweep::record(const Planes& planes, const Beams& beams, Scan& out,
                   std::span<std::size_t> place) const {
  const Matrix3d R_start_world = carrier.T_world_start.linear().transpose();
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  Lanes cosines = {}, incidences;
  for (std::size_t i = 0; i < beams.count; ++i)
    cosines[i] = static_cast<float>(beams.hits[i].cosine);
  arc_cosine(cosines.data(), incidences.data(), beams.count);

  for (std::size_t i = 0; i < beams.count; ++i) {
    const Shot& shot = beams.shots[i];
    const Footprint& footprint = beams.footprints[i];
    const Echoes& echoes = beams.echoes[i];
    if (echoes.count == 0) continue;
    const Beam nominal = kinematics.nominal(planes[shot.column], shot.ring);
    for (std::size_t e = 0; e < echoes.count; ++e) {
      const Echo& echo = echoes.echo[e];
      const std::size_t k = echo.sub_ray;
      const Hit* hit = &beams.hits[i];
      Hit beside;
      Vector3d true_point = shot.origin + hit->range * shot.direction;
      float incidence = incidences[i];
      if (k > 0) {
        const Ray& ray = footprint.rays[k];
        beside = caster.hit_of(ray, footprint.glances[k]);
        beside.range += shift_of(beams, i, beside.triangle);
        hit = &beside;
        true_point = R_start_world * (ray.origin + beside.range * ray.direction -
                                      carrier.T_world_start.translation());
        incidence = std::acos(static_cast<float>(beside.cosine));
      }
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
      out.true_range[to] = hit->range;
      out.true_point[to] = true_point.cast<float>();
      out.incidence[to] = incidence;
      out.true_normal[to] = (R_start_world * hit->normal).cast<float>();
      out.triangle[to] = hit->triangle;
      out.material[to] = material_of[hit->triangle];
      // A surface seen at grazing incidence spreads along the beam, but it is one.
      const bool one_surface = footprint.off_plane <= surface_gap / 2;
      out.flags[to] =
          echo.flags & static_cast<std::uint8_t>(one_surface ? ~flag_mixed_pixel : ~flag_none);
      out.echo[to] = static_cast<std::uint8_t>(e + 1);
    }
  }
}

void Sweep::scan_columns(std::size_t first, std::span<std::size_t> places, Scan& out) const {
  const TileShape tile = tile_shape(scanner);
  const auto plane_beams = static_cast<std::size_t>(scanner.plane_beams);
  const std::size_t columns = places.size();
  // A copy: threads that count in neighbouring places would wait for each other.
  std::array<std::size_t, tile_size> place;
  std::copy(places.begin(), places.end(), place.begin());

  Planes planes;
  for (std::size_t c = 0; c < columns; ++c) {
    const std::size_t column = first + c;
    const double jitter =
        scanner.motion_jitter > 0 ? Random(derived_seed(seed, "head"), column).normal() : 0;
    planes[c] = kinematics.plane(static_cast<int>(column), jitter);
  }

  Beams beams;
  for (int first_ring = 0; first_ring < scanner.plane_beams; first_ring += tile.rings) {
    const int end_ring = std::min(first_ring + tile.rings, scanner.plane_beams);
    beams.count = 0;
    for (std::size_t c = 0; c < columns; ++c)
      for (int r = first_ring; r < end_ring; ++r) {
        Shot& shot = beams.shots[beams.count++];
        shot.ring = r;
        shot.column = c;
        shot.number = (first + c) * plane_beams + static_cast<std::size_t>(r);
      }
    aim(planes, beams);
    cast(beams);
    receive(beams);
    record(planes, beams, out, {place.data(), columns});
  }
  std::copy_n(place.begin(), columns, places.begin());
}

void check_pose(const Pose& T_world_scanner) {
  if (!T_world_scanner.matrix().allFinite())
    throw std::invalid_argument("T_world_scanner: expected finite numbers");
  // Poses are read from text of four digits and more, and normalised; this only finds scalings.
  if (!T_world_scanner.linear().isUnitary(1e-6))
    throw std::invalid_argument("T_world_scanner: expected a rotation and a translation");
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
  const auto has_relief = [](const FineRelief& relief) { return relief.exists(); };
  if (!scanner.fine_relief || std::none_of(sweep.reliefs.begin(), sweep.reliefs.end(), has_relief))
    sweep.reliefs.clear();

  for_each_array([&](auto& array) { array.reserve(planes * column_size); }, result);
  // Some columns at a time, in memory that stays in the processor's cache, where each has room for
  // all that its beams may return, so that any thread may write it. Three tiles for every thread:
  // with two, two threads wait for each other (1.8 times as fast as one instead of 1.9); with four,
  // the arrays outgrow a cache of 1 MB (measured, 400 x 360 beams).
  const auto tile_columns = static_cast<std::size_t>(tile_shape(scanner).columns);
  const std::size_t batch = 3 * static_cast<std::size_t>(available_threads()) * tile_columns;
  Scan some;
  for_each_array([&](auto& array) { array.resize(batch * column_size); }, some);
  std::vector<std::size_t> place(batch);
  for (std::size_t begin = 0; begin < planes; begin += batch) {
    const std::size_t columns = std::min(batch, planes - begin);
    for (std::size_t c = 0; c < columns; ++c) place[c] = c * column_size;
    parallel_for(columns, tile_columns, [&](std::size_t first, std::size_t last) {
      sweep.scan_columns(begin + first, {&place[first], last - first}, some);
    });
    for_each_array(
        [&](auto& all, const auto& part) {
          for (std::size_t c = 0; c < columns; ++c)
            all.insert(all.end(), &part[c * column_size], &part[place[c]]);
        },
        result, some);
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
