// SPDX-License-Identifier: MIT
#include "sim/scanner.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <type_traits>

#include "core/gradient_noise.h"
#include "core/parallel.h"
#include "core/random.h"
#include "sim/ranging.h"

namespace minescan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Neighbouring beams are cast together in tiles of 4 rings by 4 columns: their rays stay closer
// together than 16 beams of one plane would, which makes Embree 1.7 times as fast.
constexpr int tile = 4;
constexpr std::size_t tile_size = tile * tile;
static_assert(tile_size == RayCaster::packet_size);

// The middle of step i of `count` equal ones between `first` and `last`.
double middle(double first, double last, int i, int count) {
  return first + (last - first) * (i + 0.5) / count;
}

// A plane of beams has its own frame: beams run from `start` towards `sideways` as the mirror
// turns, and `across` is its normal. The motion turns that frame.
struct PlaneAxes {
  Vector3d start;
  Vector3d sideways;
  Vector3d across;
};
PlaneAxes plane_axes(Motion motion) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  if (motion == Motion::yaw) return {.start = z, .sideways = x, .across = y};
  return {.start = x, .sideways = y, .across = z};
}

// R_scanner_plane at `column`. Turning up is a negative turn about the left axis.
Matrix3d motion_rotation(const Scanner& s, int column) {
  const double angle = middle(s.motion_start, s.motion_end, column, s.planes);
  return s.motion == Motion::yaw ? Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix()
                                 : Eigen::AngleAxisd(-angle, Vector3d::UnitY()).toRotationMatrix();
}

double mirror_angle(const Scanner& s, int ring) {
  return middle(-s.plane_field / 2, s.plane_field / 2, ring, s.plane_beams);
}

// The direction of one ring in the frame of the plane, and what jitter adds to it: `nominal` as the
// instrument believes, `beam` as it is but for the jitter, `turned` the same a right angle onwards.
struct Ring {
  Vector3d nominal = Vector3d::Zero();
  Vector3d beam = Vector3d::Zero();
  Vector3d turned = Vector3d::Zero();
  Vector3d fixed = Vector3d::Zero();  // out of the plane, where the mirror's turning leads nowhere

  // for a mirror angle larger by `jitter`, less than a right angle
  Vector3d jittered(double jitter) const {
    const double sine = std::sin(jitter);
    return fixed + std::sqrt(1 - sine * sine) * beam + sine * turned;
  }
};

Ring make_ring(const Scanner& s, int ring) {
  const PlaneAxes axes = plane_axes(s.motion);
  const double nominal = mirror_angle(s, ring);
  const double angle = nominal + s.index_error;
  const double leaving = s.wobble * std::sin(nominal);
  const double inside = std::cos(leaving);
  return {.nominal = std::cos(nominal) * axes.start + std::sin(nominal) * axes.sideways,
          .beam = inside * (std::cos(angle) * axes.start + std::sin(angle) * axes.sideways),
          .turned = inside * (std::cos(angle) * axes.sideways - std::sin(angle) * axes.start),
          .fixed = std::sin(leaving) * axes.across};
}

// Calls visit(array) for every per-point array of a scan.
template <class Visit>
void for_each_array(Scan& s, Visit&& visit) {
  visit(s.cloud.points);
  visit(s.intensity);
  visit(s.time);
  visit(s.ring);
  visit(s.column);
  visit(s.range);
  visit(s.true_range);
  visit(s.incidence);
  visit(s.true_normal);
  visit(s.triangle);
  visit(s.material);
  visit(s.flags);
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

  // What `hit`, seen along `direction` from `origin`, is with the relief.
  void apply(const Vector3d& origin, const Vector3d& direction, Hit& hit) const {
    const Vector3d place = origin + hit.range * direction;
    const NoiseSlope noise = gradient_noise_slope(to_lattice * place, seed);
    // A surface seen edge-on moves by the reach, but not if its height is 0: no 0 / 0.
    hit.range -= std::clamp(height * noise.value / std::max(hit.cosine, 1e-9), -reach, reach);
    // The surface at height h(p) above the plane has the normal n - grad h, of the part of the
    // gradient in the plane.
    Vector3d slope = height * (to_lattice.transpose() * noise.slope);
    slope -= slope.dot(hit.normal) * hit.normal;
    // A side that faces away would be hidden; seen is one that faces the scanner by a tenth of what
    // the triangle does (assumed).
    const double away = -slope.dot(direction);
    if (away > 0.9 * hit.cosine) slope *= 0.9 * hit.cosine / away;
    hit.normal = (hit.normal - slope).normalized();
    hit.cosine = std::clamp(-hit.normal.dot(direction), 0.0, 1.0);
  }
};

// Everything about one scan that does not change from beam to beam.
struct Sweep {
  const RayCaster& caster;
  const Scanner& scanner;
  const Pose& T_world_scanner;
  std::uint64_t seed;
  Ranging ranging;
  std::vector<Ring> rings;
  std::vector<double> reflectance;  // of each material, as wet as it is
  std::vector<FineRelief> reliefs;  // of each material; empty if none has any
  bool noisy;
  bool jittery;

  // Scans columns [first, first + count), count <= 4. The points of column c are written from place
  // c * plane_beams on; kept[c] tells how many there are.
  void strip(int first, int count, Scan& out, std::vector<std::size_t>& kept) const;
};

void Sweep::strip(int first, int count, Scan& out, std::vector<std::size_t>& kept) const {
  const TriangleMesh& mesh = caster.mesh();
  const Vector3d origin = T_world_scanner.translation();
  const Matrix3d R_scanner_world = T_world_scanner.linear().transpose();
  const auto plane_beams = static_cast<std::size_t>(scanner.plane_beams);
  std::array<Matrix3d, tile> R_scanner_plane;
  std::array<Matrix3d, tile> R_world_plane;
  std::array<std::size_t, tile> place;  // of the next point of each column
  for (int c = 0; c < count; ++c) {
    R_scanner_plane[c] = motion_rotation(scanner, first + c);
    R_world_plane[c] = T_world_scanner.linear() * R_scanner_plane[c];
    place[c] = static_cast<std::size_t>(first + c) * plane_beams;
  }

  std::array<Vector3d, tile_size> directions;
  std::array<std::array<double, 4>, tile_size> normals{};
  std::array<Hit, tile_size> hits;
  for (int first_ring = 0; first_ring < scanner.plane_beams; first_ring += tile) {
    const int ring_count = std::min(tile, scanner.plane_beams - first_ring);
    std::size_t rays = 0;
    for (int c = 0; c < count; ++c) {
      const std::size_t first_beam =
          static_cast<std::size_t>(first + c) * plane_beams + static_cast<std::size_t>(first_ring);
      for (int r = 0; r < ring_count; ++r, ++rays) {
        if (noisy) {
          Random random(seed, first_beam + static_cast<std::size_t>(r));
          normals[rays] = four_normals(random);
        }
        const Ring& ring = rings[static_cast<std::size_t>(first_ring + r)];
        const double jitter = scanner.encoder_jitter * normals[rays][3];
        directions[rays] =
            R_world_plane[c] * (jittery ? ring.jittered(jitter) : ring.fixed + ring.beam);
      }
    }
    caster.cast_packet(origin, {directions.data(), rays}, scanner.max_range, hits);

    std::size_t ray = 0;
    for (int c = 0; c < count; ++c) {
      for (int r = 0; r < ring_count; ++r, ++ray) {
        Hit& hit = hits[ray];
        if (hit.triangle == no_triangle) continue;
        const std::uint8_t material = mesh.material[hit.triangle];
        if (!reliefs.empty() && reliefs[material].height > 0) {
          reliefs[material].apply(origin, directions[ray], hit);
          if (!(hit.range <= scanner.max_range)) continue;
        }
        if (!(hit.range >= scanner.min_range)) continue;
        const Echo echo = ranging.measure(hit.range, reflectance[material], hit.cosine,
                                          {normals[ray][0], normals[ray][1], normals[ray][2]});
        if (!echo.returned) continue;
        const int ring = first_ring + r;
        const std::size_t beam =
            static_cast<std::size_t>(first + c) * plane_beams + static_cast<std::size_t>(ring);
        const std::size_t i = place[c]++;
        // In single precision, as files hold them, so that writing and reading changes nothing: at
        // 48 m the last digit is worth 4 micrometres.
        const Vector3d direction =
            R_scanner_plane[c] * rings[static_cast<std::size_t>(ring)].nominal;
        out.cloud.points[i] = (echo.range * direction).cast<float>().cast<double>();
        out.intensity[i] = echo.amplitude;
        out.time[i] = static_cast<double>(beam) * scanner.beam_time;
        out.ring[i] = static_cast<std::uint32_t>(ring);
        out.column[i] = static_cast<std::uint32_t>(first + c);
        out.range[i] = echo.range;
        out.true_range[i] = hit.range;
        out.incidence[i] = std::acos(static_cast<float>(hit.cosine));
        out.true_normal[i] = (R_scanner_world * hit.normal).cast<float>();
        out.triangle[i] = hit.triangle;
        out.material[i] = material;
        out.flags[i] = echo.flags;
      }
    }
  }
  for (int c = 0; c < count; ++c) {
    const std::size_t column = static_cast<std::size_t>(first + c);
    kept[column] = place[c] - column * plane_beams;
  }
}

void check_pose(const Pose& T_world_scanner) {
  if (!T_world_scanner.matrix().allFinite())
    throw std::invalid_argument("T_world_scanner: expected finite numbers");
  // Poses are read from text of four digits and more, and normalised; this only finds scalings.
  if (!T_world_scanner.linear().isUnitary(1e-6))
    throw std::invalid_argument("T_world_scanner: expected a rotation and a translation");
}

}  // namespace

void check(const Scanner& scanner) {
  Scanner copy = scanner;
  fields(copy, FieldVisitor{[&]<class T>(const char* name, const T& v, const Range& range,
                                         const char*, const char*) {
           if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>)
             read_named(name, value_text(v),
                        [&] { read_number(value_text(v), range, std::is_integral_v<T>); });
         }});
  const double beams = static_cast<double>(scanner.plane_beams) * scanner.planes;
  if (!(beams <= max_beams))
    throw std::invalid_argument(
        fmt::format("scanner '{}': expected plane-beams * planes <= {}, found {}", scanner.name,
                    max_beams, beams));
  if (!(scanner.min_range < scanner.max_range))
    throw std::invalid_argument(
        fmt::format("scanner '{}': expected min-range < max-range, found {} and {}", scanner.name,
                    scanner.min_range, scanner.max_range));
  if (scanner.wrap_interval > 0 && !(scanner.fine_interval <= scanner.wrap_interval))
    throw std::invalid_argument(
        fmt::format("scanner '{}': expected fine-interval <= wrap-interval, found {} and {}",
                    scanner.name, scanner.fine_interval, scanner.wrap_interval));
  if (scanner.cyclic_error > 0 && !(scanner.fine_interval > 0))
    throw std::invalid_argument(fmt::format(
        "scanner '{}': a cyclic-error needs a fine-interval > 0 to repeat with", scanner.name));
}

Vector3d beam_direction(const Scanner& scanner, int ring, int column) {
  return motion_rotation(scanner, column) * make_ring(scanner, ring).nominal;
}

Scan scan(const RayCaster& caster, const Scanner& scanner, const Pose& T_world_scanner,
          std::uint64_t seed, const std::string& scene) {
  check(scanner);
  check_pose(T_world_scanner);
  const auto plane_beams = static_cast<std::size_t>(scanner.plane_beams);
  const auto planes = static_cast<std::size_t>(scanner.planes);

  Scan result;
  result.scene = scene;
  result.scanner = scanner.name;
  result.seed = seed;
  result.T_world_scanner = T_world_scanner;
  result.beams = plane_beams * planes;
  for_each_array(result, [&](auto& array) { array.resize(result.beams); });

  const bool jittery = scanner.encoder_jitter > 0;
  Sweep sweep{.caster = caster,
              .scanner = scanner,
              .T_world_scanner = T_world_scanner,
              .seed = seed,
              .ranging = Ranging(scanner),
              .rings = {},
              .reflectance = {},
              .reliefs = {},
              .noisy = jittery || scanner.range_noise > 0 || scanner.range_noise_growth > 0 ||
                       scanner.amplitude_noise > 0,
              .jittery = jittery};
  sweep.rings.reserve(plane_beams);
  for (int ring = 0; ring < scanner.plane_beams; ++ring)
    sweep.rings.push_back(make_ring(scanner, ring));

  const std::vector<Material>& materials = caster.mesh().materials;
  for (const Material& m : materials) {
    sweep.reflectance.push_back(wet_reflectance(m));
    sweep.reliefs.emplace_back(m);
  }
  const auto has_relief = [](const FineRelief& relief) { return relief.height > 0; };
  if (!scanner.fine_relief || std::none_of(sweep.reliefs.begin(), sweep.reliefs.end(), has_relief))
    sweep.reliefs.clear();

  std::vector<std::size_t> kept(planes);
  parallel_for(planes, tile, [&](std::size_t begin, std::size_t end) {
    sweep.strip(static_cast<int>(begin), static_cast<int>(end - begin), result, kept);
  });

  // Close the gaps that beams without return left at the ends of the columns.
  for_each_array(result, [&](auto& array) {
    std::size_t end = 0;
    for (std::size_t column = 0; column < planes; ++column) {
      const auto from = array.begin() + static_cast<std::ptrdiff_t>(column * plane_beams);
      const auto to = array.begin() + static_cast<std::ptrdiff_t>(end);
      if (from != to) std::copy(from, from + static_cast<std::ptrdiff_t>(kept[column]), to);
      end += kept[column];
    }
    array.resize(end);
  });
  return result;
}

}  // namespace minescan
