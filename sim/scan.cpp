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

constexpr double far = std::numeric_limits<double>::infinity();

// Neighbouring beams are cast together. On a grid in tiles of 4 rings by 4 columns: their rays stay
// closer together than 16 beams of one plane would, which makes Embree 1.7 times as fast. Without a
// grid, one after the other.
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

// Calls visit(array...) for each of them, with the same ones of other scans.
template <class Visit, class... Scans>
void for_each_array(const Visit& visit, Scans&... scans) {
  constexpr std::size_t arrays = std::tuple_size_v<decltype(arrays_of(std::declval<Scan&>()))>;
  [&]<std::size_t... number>(std::index_sequence<number...>) {
    const auto visit_one = [&]<std::size_t n>(std::integral_constant<std::size_t, n>) {
      visit(std::get<n>(arrays_of(scans))...);
    };
    (visit_one(std::integral_constant<std::size_t, number>{}), ...);
  }
  (std::make_index_sequence<arrays>{});
}

// What carries the scanner: a place, or a path.
struct Carrier {
  Pose T_world_start = Pose::Identity();
  const SmoothPath* path = nullptr;
  double start = 0;

  Pose at(double time) const { return path ? path->at(start + time) : T_world_start; }
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

// Sixteen beams on their way through the stages: aimed, cast, received, recorded. Lanes beyond the
// last beam repeat it.
struct Beams {
  Kinematics::Rings rings;
  std::array<std::size_t, lanes> columns;    // within the strip
  std::array<std::uint64_t, lanes> numbers;  // in the scan
  DoubleLanes times;                         // seconds
  Kinematics::Beams actual;                  // as they go, in the frame of the scan
  RayPacket axes;                            // the same in the world frame
  VectorLanes along;                         // world frame, Beam::along; of footprints only
  HitPacket hits;                            // of the axes
  DoubleLanes shifts;                        // of the axes by fine relief, metres
  std::array<Footprint, lanes> footprints;
  Light light;
  std::array<Echoes, lanes> echoes;

  std::size_t count() const { return axes.count; }
};

// Everything about one scan that does not change from beam to beam.
struct Sweep {
  const RayCaster& caster;
  const Scanner& scanner;
  const Carrier& carrier;
  std::uint64_t seed;
  double age;
  MatrixLanes R_world_start, R_start_world;
  Kinematics kinematics;
  Ranging ranging;
  std::vector<double> reflectance;  // of each material, as wet as it is
  std::vector<FineRelief> reliefs;  // of each material; empty if none has any
  bool noisy;

  // Scans neighbouring columns, a tile wide or less, from `first` on. places[c]: of the first point
  // of column first + c; afterwards behind its last one.
  void scan_columns(std::size_t first, std::span<std::size_t> places, Scan& out) const;

  // The stages. `beams` tell ring, column and number.
  void aim(const Kinematics::Heads& heads, Beams& beams) const;
  void cast(Beams& beams) const;
  void receive(Beams& beams) const;
  // place[c]: of the next point of column c.
  void record(const Kinematics::Heads& heads, const Beams& beams, Scan& out,
              std::span<std::size_t> place) const;

  // Gives the hits of the axes the relief of their materials.
  void apply_reliefs(Beams& beams) const;
  // By how much fine relief moves a triangle that a sub-ray of beam i met, metres.
  double shift_of(const Beams& beams, std::size_t i, std::uint32_t triangle) const;
  // Casts what the footprints need beyond the axes.
  void cast_footprints(Beams& beams) const;
  Ray sub_ray(const Ray& axis, const Vector3d& along, std::size_t k) const;
  // Whether dust swallows a beam before it comes to the hit.
  bool lost_in_dust(std::uint64_t beam, double range) const;
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

bool Sweep::lost_in_dust(std::uint64_t beam, double range) const {
  if (scanner.dust_loss == 0) return false;
  Random random(derived_seed(seed, "dust"), beam);
  return random.uniform() > std::exp(-scanner.dust_loss * range);
}

void Sweep::aim(const Kinematics::Heads& heads, Beams& beams) const {
  if (noisy)
    for (std::size_t block = 0; block < ranging.blocks(); ++block)
      four_normals(seed, beams.numbers, block, beams.light.normals[block]);
  for (std::size_t i = 0; i < lanes; ++i)
    beams.times[i] = kinematics.time(beams.rings[i], heads.column[i]);
  kinematics.actual(heads, beams.rings, beams.light.normals[0][3], beams.actual);
  if (scanner.sub_rays > 1) kinematics.along(heads, beams.rings, beams.along);
  if (carrier.path) {
    for (std::size_t i = 0; i < lanes; ++i) {
      const Pose T_start_scanner =
          carrier.T_world_start.inverse(Eigen::Isometry) * carrier.at(beams.times[i]);
      beams.actual.origin.set(i, T_start_scanner * beams.actual.origin.lane(i));
      beams.actual.direction.set(i, T_start_scanner.linear() * beams.actual.direction.lane(i));
      if (scanner.sub_rays > 1) beams.along.set(i, T_start_scanner.linear() * beams.along.lane(i));
    }
  }
  product(R_world_start, beams.actual.direction, beams.axes.direction);
  // Most scanners stand still and have no lever: all their beams leave from one place.
  if (carrier.path || kinematics.has_lever())
    product(R_world_start, beams.actual.origin, beams.axes.origin);
  else
    beams.axes.origin = {};
  for (std::size_t k = 0; k < 3; ++k)
    for (double& x : beams.axes.origin[k])
      x += carrier.T_world_start.translation()[static_cast<Eigen::Index>(k)];
  if (scanner.sub_rays > 1) {
    const VectorLanes along = beams.along;
    product(R_world_start, along, beams.along);
  }
}

void Sweep::cast(Beams& beams) const {
  caster.cast_packet(beams.axes, scanner.max_range, beams.hits);
  if (scanner.sub_rays > 1) cast_footprints(beams);
  apply_reliefs(beams);
}

void Sweep::apply_reliefs(Beams& beams) const {
  beams.shifts.fill(0);
  if (reliefs.empty()) return;
  // Material by material, all beams that met it.
  std::array<std::size_t, lanes> material;
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::uint32_t triangle = beams.hits.triangle[i];
    material[i] = triangle == no_triangle ? reliefs.size() : caster.mesh().material[triangle];
  }
  for (std::size_t i = 0; i < lanes; ++i) {
    const std::size_t wanted = material[i];
    if (wanted == reliefs.size()) continue;
    std::array<bool, lanes> chosen;
    for (std::size_t j = 0; j < lanes; ++j) {
      chosen[j] = material[j] == wanted;
      if (chosen[j]) material[j] = reliefs.size();
    }
    if (reliefs[wanted].exists())
      reliefs[wanted].apply(beams.axes, chosen, beams.hits, beams.shifts);
  }
}

void Sweep::cast_footprints(Beams& beams) const {
  const std::size_t count = beams.count();
  RayPacket rays;
  std::array<Glance, lanes> glances;
  // The same sub-ray of all beams of the tile: these are neighbours.
  rays.count = count;
  for (std::size_t k = 1; k < few_sub_rays; ++k) {
    for (std::size_t i = 0; i < count; ++i) {
      beams.footprints[i].rays[k] = sub_ray(beams.axes.lane(i), beams.along.lane(i), k);
      rays.set(i, beams.footprints[i].rays[k]);
    }
    rays.fill();
    caster.glance_packet(rays, scanner.max_range, glances);
    for (std::size_t i = 0; i < count; ++i) beams.footprints[i].glances[k] = glances[i];
  }
  for (std::size_t i = 0; i < count; ++i) {
    Footprint& f = beams.footprints[i];
    const Ray axis = beams.axes.lane(i);
    const Hit hit = beams.hits.lane(i);
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
    constexpr std::size_t rest = all_sub_rays - few_sub_rays;
    static_assert(rest <= lanes);
    rays.count = rest;
    for (std::size_t k = 0; k < rest; ++k) {
      f.rays[few_sub_rays + k] = sub_ray(axis, beams.along.lane(i), few_sub_rays + k);
      rays.set(k, f.rays[few_sub_rays + k]);
    }
    rays.fill();
    caster.glance_packet(rays, scanner.max_range, glances);
    std::copy_n(glances.begin(), rest, f.glances.begin() + few_sub_rays);
    f.count = all_sub_rays;
    look_at(few_sub_rays, all_sub_rays);
  }
}

void Sweep::receive(Beams& beams) const {
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  Light& light = beams.light;
  std::size_t sub_rays = 1;
  for (std::size_t i = 0; i < beams.count(); ++i)
    sub_rays = std::max(sub_rays, beams.footprints[i].count);
  light.clear(sub_rays);
  for (std::size_t i = 0; i < beams.count(); ++i) {
    const std::uint32_t triangle = beams.hits.triangle[i];
    const double axis_range = beams.hits.range[i];
    const Footprint& footprint = beams.footprints[i];
    light.age[i] = age + beams.times[i];
    if (lost_in_dust(beams.numbers[i], axis_range)) continue;
    const std::span<const double> weights = footprint.weights();
    const auto add = [&](std::size_t k, double range, double signal) {
      if (range >= scanner.min_range && range <= scanner.max_range)
        light.set(k, i, {weights[k], range, signal});
    };
    if (triangle != no_triangle)
      add(0, axis_range, reflectance[material_of[triangle]] * beams.hits.cosine[i]);
    for (std::size_t k = 1; k < footprint.count; ++k) {
      const Glance& glance = footprint.glances[k];
      if (glance.triangle == no_triangle) continue;
      add(k, static_cast<double>(glance.range) + shift_of(beams, i, glance.triangle),
          reflectance[material_of[glance.triangle]] * static_cast<double>(glance.cosine));
    }
  }
  ranging.measure(light, {beams.echoes.data(), beams.count()});
}

double Sweep::shift_of(const Beams& beams, std::size_t i, std::uint32_t triangle) const {
  const std::uint32_t axis = beams.hits.triangle[i];
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  return axis != no_triangle && material_of[axis] == material_of[triangle] ? beams.shifts[i] : 0;
}

void Sweep::record(const Kinematics::Heads& heads, const Beams& beams, Scan& out,
                   std::span<std::size_t> place) const {
  const std::vector<std::uint8_t>& material_of = caster.mesh().material;
  Lanes cosines, incidences;
  for (std::size_t i = 0; i < lanes; ++i) cosines[i] = static_cast<float>(beams.hits.cosine[i]);
  arc_cosine(cosines.data(), incidences.data(), lanes);
  Kinematics::Beams nominal;
  kinematics.nominal(heads, beams.rings, nominal);
  VectorLanes normals;
  product(R_start_world, beams.hits.normal, normals);

  for (std::size_t i = 0; i < beams.count(); ++i) {
    const Echoes& echoes = beams.echoes[i];
    for (std::size_t e = 0; e < echoes.count; ++e) {
      const Echo& echo = echoes.echo[e];
      const std::size_t to = place[beams.columns[i]]++;
      if (echo.sub_ray == 0) {
        const double range = beams.hits.range[i];
        out.true_range[to] = range;
        out.true_point[to] =
            (beams.actual.origin.lane(i) + range * beams.actual.direction.lane(i)).cast<float>();
        out.incidence[to] = incidences[i];
        out.true_normal[to] = normals.lane(i).cast<float>();
        out.triangle[to] = beams.hits.triangle[i];
      } else {
        const Footprint& footprint = beams.footprints[i];
        const Ray& ray = footprint.rays[echo.sub_ray];
        Hit hit = caster.hit_of(ray, footprint.glances[echo.sub_ray]);
        hit.range += shift_of(beams, i, hit.triangle);
        const Matrix3d R = carrier.T_world_start.linear().transpose();
        out.true_range[to] = hit.range;
        out.true_point[to] =
            (R * (ray.origin + hit.range * ray.direction - carrier.T_world_start.translation()))
                .cast<float>();
        out.incidence[to] = std::acos(static_cast<float>(hit.cosine));
        out.true_normal[to] = (R * hit.normal).cast<float>();
        out.triangle[to] = hit.triangle;
      }
      // In single precision, as files hold them, so that writing and reading changes nothing: at
      // 48 m the last digit is worth 4 micrometres. Number by number: of Eigen's x.cast<float>()
      // .cast<double>() g++ 12 leaves out both casts (-O2).
      for (std::size_t k = 0; k < 3; ++k)
        out.cloud.points[to][static_cast<Eigen::Index>(k)] = static_cast<double>(
            static_cast<float>(nominal.origin[k][i] + echo.range * nominal.direction[k][i]));
      out.intensity[to] = echo.amplitude;
      out.time[to] = beams.times[i];
      out.ring[to] = static_cast<std::uint32_t>(beams.rings[i]);
      out.column[to] = static_cast<std::uint32_t>(heads.column[i]);
      out.range[to] = echo.range;
      out.material[to] = material_of[out.triangle[to]];
      // A surface seen at grazing incidence spreads along the beam, but it is one.
      const bool one_surface = beams.footprints[i].off_plane <= surface_gap / 2;
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
  std::array<std::size_t, lanes> place;
  std::copy(places.begin(), places.end(), place.begin());

  std::array<Kinematics::Plane, lanes> planes;
  for (std::size_t c = 0; c < columns; ++c) {
    const std::size_t column = first + c;
    const double jitter =
        scanner.motion_jitter > 0 ? Random(derived_seed(seed, "head"), column).normal() : 0;
    planes[c] = kinematics.plane(static_cast<int>(column), jitter);
  }

  Beams beams;
  Kinematics::Heads heads;
  Kinematics::Rings rings_from_first;
  for (int first_ring = 0; first_ring < scanner.plane_beams; first_ring += tile.rings) {
    const int rings = std::min(tile.rings, scanner.plane_beams - first_ring);
    const std::size_t count = columns * static_cast<std::size_t>(rings);
    if (count != beams.count()) {  // the first tile, and the last one if it is smaller
      beams.axes.count = count;
      for (std::size_t i = 0; i < lanes; ++i) {
        const auto beam = static_cast<int>(std::min(i, count - 1));
        beams.columns[i] = static_cast<std::size_t>(beam / rings);
        rings_from_first[i] = beam % rings;
        heads.set(i, planes[beams.columns[i]]);
      }
    }
    for (std::size_t i = 0; i < lanes; ++i) {
      beams.rings[i] = first_ring + rings_from_first[i];
      beams.numbers[i] =
          (first + beams.columns[i]) * plane_beams + static_cast<std::size_t>(beams.rings[i]);
    }
    aim(heads, beams);
    cast(beams);
    receive(beams);
    record(heads, beams, out, {place.data(), columns});
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
              .R_world_start = MatrixLanes(carrier.T_world_start.linear()),
              .R_start_world = MatrixLanes(carrier.T_world_start.linear().transpose()),
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
  // Strips a tile wide are scanned side by side, each into memory with room for all that its beams
  // may return, and joined in order.
  const auto width = static_cast<std::size_t>(tile_shape(scanner).columns);
  struct Strip {
    Scan scan;
    std::array<std::size_t, lanes> ends;  // of its columns
  };
  std::vector<Strip> strips(parallel_slots());
  const auto columns_of = [&](std::size_t i) { return std::min(width, planes - i * width); };
  parallel_in_order((planes + width - 1) / width,
                    [&](std::size_t i, std::size_t slot) {
                      auto& [part, ends] = strips[slot];
                      for_each_array([&](auto& array) { array.resize(width * column_size); }, part);
                      for (std::size_t c = 0; c < width; ++c) ends[c] = c * column_size;
                      sweep.scan_columns(i * width, {ends.data(), columns_of(i)}, part);
                    },
                    [&](std::size_t i, std::size_t slot) {
                      auto& [part, ends] = strips[slot];
                      for_each_array(
                          [&](auto& all, const auto& some) {
                            for (std::size_t c = 0; c < columns_of(i); ++c)
                              all.insert(all.end(), &some[c * column_size], &some[ends[c]]);
                          },
                          result, part);
                    });
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
