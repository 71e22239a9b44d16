// SPDX-License-Identifier: MIT
#include "sim/validation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "sim/scan.h"

namespace minescan {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double degree = Scanner::degree;
constexpr double speed_of_light = 299792458;  // m/s, by definition
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double warm = 10 * 3600;         // s; after ten hours the warm-up has died away
constexpr double rock_reflectance = 0.35;  // dry sandstone (assumed), as Material's

// ---- plain meshes

// A parallelogram from a corner along u and v, with a material of its own.
void add_plate(TriangleMesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v,
               double reflectance) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vector3d& p :
       {corner, Vector3d(corner + u), Vector3d(corner + u + v), Vector3d(corner + v)})
    mesh.vertices.push_back(p.cast<float>());
  mesh.triangles.push_back({base, base + 1, base + 2});
  mesh.triangles.push_back({base, base + 2, base + 3});
  const auto material = static_cast<std::uint8_t>(mesh.materials.size());
  mesh.materials.push_back({.name = "plate", .reflectance = reflectance});
  mesh.material.insert(mesh.material.end(), 2, material);
}

// A plate across the x axis at x, from y = right to y = left.
void add_screen(TriangleMesh& mesh, double x, double right, double left, double reflectance) {
  // Off the middle in height, so that no beam runs along the diagonal.
  add_plate(mesh, {x, right, -7}, {0, left - right, 0}, {0, 0, 16}, reflectance);
}

// ---- a still plate

// `scanner` with all its beams along x.
Scanner staring(Scanner scanner, int readings) {
  scanner.pattern = Pattern::mirror;
  scanner.motion = Motion::none;
  scanner.plane_beams = 1;
  scanner.planes = readings;
  scanner.plane_centre = 0;
  scanner.lever = scanner.mount = Vector3d::Zero();
  scanner.interlace = 1;
  return scanner;
}

// Readings of a plate, the first return of each beam.
Scan readings(const Scanner& scanner, double range, double reflectance, int count,
              std::uint64_t seed) {
  TriangleMesh mesh;
  add_screen(mesh, range, -9, 7, reflectance);
  Scanner s = staring(scanner, count);
  s.returns = 1;
  return scan(RayCaster(std::move(mesh)), s, Pose::Identity(),
              derived_seed(seed, fmt::format("plate at {} m", range)), "plate", warm);
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

double variance_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum / static_cast<double>(values.size() - 1);
}

// Place i of `count` in an interval, in the middles of equal steps.
double place(const Interval& interval, int i, int count) {
  return interval.low + (interval.high - interval.low) * (i + 0.5) / count;
}

// ---- two surfaces

// The closed form: amplitude and phases of a Gaussian beam's 19 places on a hexagonal lattice, on
// plates at x = near, where y < 0, and x = far.
class TwoPlates {
 public:
  TwoPlates(const Scanner& scanner, double near, double far, double reflectance)
      : scanner_(scanner), near_(near), far_(far), reflectance_(reflectance) {}

  struct Reading {
    double range = 0;
    double near_light = 0;  // shares of the light
    double far_light = 0;
  };
  // Of a beam that leaves the origin `angle` radians to the left of x.
  Reading reading(double angle) const {
    const Scanner& s = scanner_;
    const Vector3d forward(std::cos(angle), std::sin(angle), 0);
    const Vector3d left(-std::sin(angle), std::cos(angle), 0);
    std::vector<std::complex<double>> sums(s.tones.size());
    Reading result;
    // Lattice rows half a radius apart, out to one radius.
    for (int i = -2; i <= 2; ++i)
      for (int j = -2; j <= 2; ++j) {
        const double along = 0.5 * i + 0.25 * j;
        const double across = std::sqrt(3.0) / 4 * j;
        if (std::hypot(along, across) > 1 + 1e-9) continue;
        const double weight = std::exp(-2 * (along * along + across * across));
        const Vector3d from = s.spot / 2 * (along * left + across * Vector3d::UnitZ());
        const Vector3d direction =
            (forward + s.divergence / 2 * (along * left + across * Vector3d::UnitZ())).normalized();
        double range = (near_ - from.x()) / direction.x();
        const bool meets_near = from.y() + range * direction.y() < 0;
        if (!meets_near) range = (far_ - from.x()) / direction.x();
        (meets_near ? result.near_light : result.far_light) += weight;
        const double light = weight * reflectance_ * direction.x() *
                             -std::expm1(-std::pow(s.defocus_range / range, 2));
        for (std::size_t k = 0; k < sums.size(); ++k)
          sums[k] += std::polar(light, 4 * pi * range / (2 * s.tones[k]));
      }
    const double light = result.near_light + result.far_light;
    result.near_light /= light;
    result.far_light /= light;
    double range = 0;
    for (std::size_t k = sums.size(); k-- > 0;) {
      const double fraction = s.tones[k] * std::arg(sums[k]) / (2 * pi);
      range = fraction + s.tones[k] * std::round((range - fraction) / s.tones[k]);
    }
    result.range = range;
    return result;
  }

 private:
  Scanner scanner_;
  double near_;
  double far_;
  double reflectance_;
};

// ---- distances

// Moeller and Trumbore 1997, in double precision; infinite where the ray passes by.
double ray_triangle(const Ray& ray, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double none = std::numeric_limits<double>::infinity();
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d p = ray.direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return none;
  const Vector3d t = ray.origin - a;
  const double u = t.dot(p) / determinant;
  const Vector3d q = t.cross(ab);
  const double v = ray.direction.dot(q) / determinant;
  const double range = ac.dot(q) / determinant;
  return u >= 0 && v >= 0 && u + v <= 1 && range > 0 ? range : none;
}

Vector3d random_direction(Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  const double z = random.normal();
  return Vector3d(x, y, z).normalized();
}

// The largest relative difference to what `exact` says of rays from `origin`.
double worst_difference(const RayCaster& caster, const Vector3d& origin, std::uint64_t seed,
                        const std::function<double(const Vector3d& direction)>& exact) {
  constexpr std::uint64_t rays = 20000;
  double worst = 0;
  for (std::uint64_t i = 0; i < rays; ++i) {
    Random random(seed, i);
    const Vector3d direction = random_direction(random);
    const std::optional<Hit> hit =
        caster.cast(origin, direction, 0, std::numeric_limits<double>::infinity());
    if (!hit) return std::numeric_limits<double>::infinity();
    const double range = exact(direction);
    worst = std::max(worst, std::abs(hit->range - range) / range);
  }
  return worst;
}

// In a box of six planes.
double plane_difference(std::uint64_t seed) {
  const Vector3d half(8, 6, 4);
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Vector3d u = 2 * half[(axis + 1) % 3] * Vector3d::Unit((axis + 1) % 3);
      const Vector3d v = 2 * half[(axis + 2) % 3] * Vector3d::Unit((axis + 2) % 3);
      add_plate(mesh, side * half[axis] * Vector3d::Unit(axis) - (u + v) / 2, u, v,
                rock_reflectance);
    }
  const Vector3d origin(0.5, -0.75, 0.25);
  return worst_difference(
      RayCaster(std::move(mesh)), origin, derived_seed(seed, "planes"), [&](const Vector3d& d) {
        double nearest = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis)
          nearest =
              std::min(nearest, (std::copysign(half[axis], d[axis]) - origin[axis]) / d[axis]);
        return nearest;
      });
}

// Off the axis of a round tunnel of 4000 flat sides, which are at most (pi / 4000)^2 / 2 = 3e-7 of
// the radius inside of the circle, and so long that no ray below 89.9 degrees reaches an end.
double cylinder_difference(std::uint64_t seed) {
  constexpr double radius = 3;
  constexpr double half_length = 2000;
  constexpr int sides = 4000;
  TriangleMesh mesh;
  mesh.materials = {{.name = "rock", .reflectance = rock_reflectance}};
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * pi * i / sides;
    for (const double x : {-half_length, half_length})
      mesh.vertices.push_back(
          Vector3d(x, radius * std::cos(angle), radius * std::sin(angle)).cast<float>());
    const auto a = static_cast<std::uint32_t>(2 * i);
    const auto b = static_cast<std::uint32_t>(2 * ((i + 1) % sides));
    mesh.triangles.push_back({a, a + 1, b + 1});
    mesh.triangles.push_back({a, b + 1, b});
    mesh.material.insert(mesh.material.end(), 2, 0);
  }
  const Vector3d origin(0, 1, -0.5);
  return worst_difference(
      RayCaster(std::move(mesh)), origin, derived_seed(seed, "cylinder"), [&](const Vector3d& d) {
        // |(origin + t d) without x| = radius
        const double a = d.y() * d.y() + d.z() * d.z();
        const double b = origin.y() * d.y() + origin.z() * d.z();
        const double c = origin.y() * origin.y() + origin.z() * origin.z() - radius * radius;
        return (-b + std::sqrt(b * b - a * c)) / a;
      });
}

// ---- the table

Interval about(double value, double share) { return {value * (1 - share), value * (1 + share)}; }

std::vector<ValidationRow> make_rows() {
  std::vector<ValidationRow> rows;

  // SICK LMS 200.
  const Scanner lms = find_scanner("sick-lms200-ptu");
  struct Bin {
    Interval ranges;
    double sigma;  // mm, measured
    std::optional<Interval> equal;
  };
  constexpr double equal_tolerance = 0.06;  // assumed
  const Interval nearest{0.72 - equal_tolerance, 0.72 + equal_tolerance};
  const Interval farthest{0.48 - equal_tolerance, 0.48 + equal_tolerance};
  const Bin bins[] = {{{1, 2}, 2.5, nearest},
                      {{2, 4}, 3.8, Interval{farthest.low, nearest.high}},
                      {{4, 6}, 4.4, Interval{farthest.low, nearest.high}},
                      {{6, 8}, 5.2, farthest}};
  for (const Bin& bin : bins)
    rows.push_back(
        {{.name =
              fmt::format("LMS 200: range noise, {:g} to {:g} m", bin.ranges.low, bin.ranges.high),
          .what = "one sigma of readings of a still plate, the variance of rounding removed",
          .unit = "mm",
          .accepted = about(bin.sigma, 0.3),
          .source =
              fmt::format("{} mm measured on logs of a SICK LMS 200 at rest; +-30 %", bin.sigma)},
         [=](std::uint64_t seed) {
           return 1e3 * range_sigma(lms, bin.ranges, rock_reflectance, seed);
         }});
  for (const Bin& bin : bins)
    rows.push_back(
        {{.name = fmt::format("LMS 200: equal readings, {:g} to {:g} m", bin.ranges.low,
                              bin.ranges.high),
          .what = "share of readings of a still plate that equal the one before, in whole "
                  "centimetres",
          .accepted = bin.equal,
          .source = "0.72 falling to 0.48 from 1-2 m to 6-8 m, measured on logs of a SICK LMS 200 "
                    "at rest; +-0.06"},
         [=](std::uint64_t seed) { return equal_readings(lms, bin.ranges, 0.01, seed); }});

  Scanner half_degree = lms;
  half_degree.motion = Motion::none;
  half_degree.plane_beams = 361;
  half_degree.planes = 1;
  half_degree.plane_field = 180.5 * degree;
  half_degree.interlace = 2;
  const std::string jumps = "at 0.5 degrees, screens 1 to 4 m behind each other, 2 to 10 m away";
  const std::string jumps_source = "measured on logs of SICK LMS 200";
  rows.push_back(
      {{.name = "LMS 200: mixed pixels per jump",
        .what = "share of jumps of more than 1 m with a return more than 0.15 m from "
                "both sides; " +
                jumps,
        .accepted = Interval{0.22, 0.29},
        .source = "0.22 to 0.29, " + jumps_source},
       [=](std::uint64_t seed) { return screen_jumps(half_degree, seed).intermediate_share(); }});
  rows.push_back(
      {{.name = "LMS 200: place of mixed pixels",
        .what = "their median, 0 on the nearer surface and 1 on the farther; " + jumps,
        .accepted = Interval{0.44, 0.53},
        .source = "0.44 to 0.53, " + jumps_source},
       [=](std::uint64_t seed) { return screen_jumps(half_degree, seed).median_position(); }});

  // A phase scanner on a tripod.
  const Scanner tls = find_scanner("tls-phase");
  struct Plate {
    double range;
    double reflectance;
    double sigma;  // mm
    const char* known;
  };
  for (const Plate& plate : std::initializer_list<Plate>{{10, 0.9, 0.60, "measured on"},
                                                         {25, 0.9, 0.96, "measured on"},
                                                         {10, 0.1, 1.2, "from memory, of"},
                                                         {25, 0.1, 2.2, "from memory, of"}})
    rows.push_back(
        {{.name = fmt::format("Focus 120: range noise at {:g} m on {:g} %", plate.range,
                              100 * plate.reflectance),
          .what = "one sigma of readings of a still plate",
          .unit = "mm",
          .accepted = about(plate.sigma, 0.15),
          .source = fmt::format("{} mm, {} a FARO Focus 120; +-15 %", plate.sigma, plate.known)},
         [=](std::uint64_t seed) {
           return 1e3 *
                  range_sigma(tls, {plate.range - 0.1, plate.range + 0.1}, plate.reflectance, seed);
         }});
  const double frequencies[] = {125e6, 15.6e6, 1.97e6};
  for (std::size_t k = 0; k < std::size(frequencies); ++k)
    rows.push_back(
        {{.name = fmt::format("phase scanner: ambiguity at {:g} MHz", frequencies[k] / 1e6),
          .what = "after what distance ranges by one tone repeat",
          .unit = "m",
          .accepted = about(speed_of_light / (2 * frequencies[k]), 1e-4),
          .source = "c / (2 f), tones of a FARO LS; +-0.01 %"},
         [=](std::uint64_t seed) { return ambiguity_interval(tls, k, seed); }});

  // Two surfaces in one footprint.
  const double step = 1e3 * tls.tones[0] * std::ldexp(1.0, -tls.phase_bits);  // mm
  for (const double separation : {0.4, 0.8}) {
    const bool below = separation < tls.tones[0] / 2;
    const char* const side = below ? "below" : "above";
    rows.push_back(
        {{.name = fmt::format("two surfaces {:g} m apart: closed form", separation),
          .what = fmt::format("largest difference between the range of a beam across their edge "
                              "and the sum of phasors; {} half an ambiguity interval",
                              side),
          .unit = "mm",
          .accepted = Interval{0, step},
          .source = "arg of a sum of phasors in double precision; one step of the phase"},
         [=](std::uint64_t) { return 1e3 * two_surfaces(tls, separation).worst_difference; }});
    rows.push_back(
        {{.name = fmt::format("two surfaces {:g} m apart: ranges between", separation),
          .what = fmt::format("share of the beams that see both whose range lies between "
                              "them; {} half an ambiguity interval",
                              side),
          .accepted = below ? Interval{1, 1} : Interval{0, 0},
          .source = "the sum of two phasors less than half a turn apart lies between "
                    "them, else on the other side"},
         [=](std::uint64_t) { return two_surfaces(tls, separation).between; }});
  }

  Scanner one_tone = find_scanner("optab-yawing");
  one_tone.range_noise = one_tone.range_noise_growth = one_tone.leakage = 0;
  one_tone.phase_bits = 0;
  rows.push_back({{.name = "phase noise over signal",
                   .what = "slope of sigma_R 4 pi f / c over 1 / sqrt(2 SNR), "
                           "SNR = A^2 / (2 sigma_n^2)",
                   .accepted = about(1, 0.02),
                   .source = "sigma_phi = sigma_n / A for strong signals; +-2 %"},
                  [=](std::uint64_t seed) { return phase_noise_slope(one_tone, seed); }});

  rows.push_back({{.name = "distances to planes",
                   .what = "largest relative difference to the closed form, 20 000 rays in a box",
                   .accepted = Interval{0, 1e-5},
                   .source = "closed form"},
                  plane_difference});
  rows.push_back({{.name = "distances to a cylinder",
                   .what = "largest relative difference to the closed form, 20 000 rays in a round "
                           "tunnel",
                   .accepted = Interval{0, 1e-5},
                   .source = "closed form"},
                  cylinder_difference});
  return rows;
}

}  // namespace

Verdict verdict(const Finding& finding) {
  if (!finding.expected.accepted) return Verdict::reported;
  const Interval& accepted = *finding.expected.accepted;
  return finding.measured >= accepted.low && finding.measured <= accepted.high ? Verdict::pass
                                                                               : Verdict::fail;
}

const std::vector<ValidationRow>& validation_rows() {
  static const std::vector<ValidationRow> rows = make_rows();
  return rows;
}

double range_sigma(const Scanner& scanner, const Interval& ranges, double reflectance,
                   std::uint64_t seed) {
  constexpr int places = 20;
  constexpr int count = 2000;
  double sum = 0;
  for (int i = 0; i < places; ++i)
    sum += variance_of(readings(scanner, place(ranges, i, places), reflectance, count, seed).range);
  return std::sqrt(sum / places - scanner.quantisation * scanner.quantisation / 12);
}

double equal_readings(const Scanner& scanner, const Interval& ranges, double step,
                      std::uint64_t seed) {
  constexpr int places = 100;
  constexpr int count = 500;
  Scanner rounding = scanner;
  rounding.quantisation = step;
  std::size_t equal = 0;
  std::size_t pairs = 0;
  for (int i = 0; i < places; ++i) {
    // The parts of the golden ratio's multiples are spread most evenly over the steps.
    const double part = i * std::numbers::phi - std::floor(i * std::numbers::phi);
    const double range = step * (std::floor(place(ranges, i, places) / step) + part);
    const std::vector<double> values =
        readings(rounding, range, rock_reflectance, count, seed).range;
    for (std::size_t k = 1; k < values.size(); ++k, ++pairs) equal += values[k] == values[k - 1];
  }
  return static_cast<double>(equal) / static_cast<double>(pairs);
}

double Jumps::intermediate_share() const {
  return static_cast<double>(positions.size()) / static_cast<double>(all);
}

double Jumps::median_position() const {
  if (positions.empty()) return not_a_number;
  std::vector<double> sorted = positions;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

void count_jumps(const Scan& scan, Jumps& jumps) {
  constexpr double jump = 1;       // m
  constexpr double margin = 0.15;  // m
  const std::vector<double>& r = scan.range;
  std::vector<bool> intermediate(r.size(), false);
  const auto neighbours = [&](std::size_t i, std::size_t k) {
    return scan.ring[k] - scan.ring[i] == k - i;
  };
  for (std::size_t k = 1; k + 1 < r.size(); ++k) {
    const double low = std::min(r[k - 1], r[k + 1]);
    const double high = std::max(r[k - 1], r[k + 1]);
    if (!neighbours(k - 1, k + 1) || !(high - low > jump)) continue;
    if (!(r[k] > low + margin && r[k] < high - margin)) continue;
    intermediate[k] = true;
    ++jumps.all;
    jumps.positions.push_back((r[k] - low) / (high - low));
  }
  for (std::size_t k = 1; k < r.size(); ++k)
    if (neighbours(k - 1, k) && !intermediate[k - 1] && !intermediate[k] &&
        std::abs(r[k] - r[k - 1]) > jump)
      ++jumps.all;
}

Jumps screen_jumps(const Scanner& scanner, std::uint64_t seed) {
  constexpr std::uint64_t places = 1000;
  constexpr int screens = 12;
  constexpr double width = 15 * degree;
  Jumps jumps;
  for (std::uint64_t i = 0; i < places; ++i) {
    Random random(derived_seed(seed, "screens"), i);
    const double turn = width * random.uniform();
    std::array<double, screens> range = {};
    for (std::size_t j = 0; j < screens; ++j) {
      // A step of 1 to 4 m from the one before, up or down, that stays within 2 to 10 m.
      double next = 2 + 8 * random.uniform();
      while (j > 0 && !(std::abs(next - range[j - 1]) > 1 && std::abs(next - range[j - 1]) < 4))
        next = 2 + 8 * random.uniform();
      range[j] = next;
    }
    TriangleMesh mesh;
    for (std::size_t j = 0; j < screens; ++j) {
      const double middle = -pi / 2 + (static_cast<double>(j) + 0.5) * width - turn;
      // Behind a nearer neighbour it goes on.
      const auto edge = [&](std::size_t neighbour) {
        const bool behind = neighbour < screens && range[neighbour] < range[j];
        return range[j] * std::tan(width * (behind ? 0.8 : 0.5));
      };
      const Vector3d out(std::cos(middle), std::sin(middle), 0);
      const Vector3d left(-out.y(), out.x(), 0);
      const double right_edge = -edge(j - 1);  // of j = 0: of none
      const double left_edge = edge(j + 1);
      add_plate(mesh, range[j] * out + right_edge * left - 7 * Vector3d::UnitZ(),
                (left_edge - right_edge) * left, 16 * Vector3d::UnitZ(),
                0.2 + 0.3 * random.uniform());
    }
    count_jumps(scan(RayCaster(std::move(mesh), Tree::soon), scanner, Pose::Identity(),
                     derived_seed(seed, fmt::format("screens {}", i)), "screens", warm),
                jumps);
  }
  return jumps;
}

double ambiguity_interval(const Scanner& scanner, std::size_t tone, std::uint64_t seed) {
  Scanner s = scanner;
  s.tones = {scanner.tones.at(tone)};
  s.tone_depths = {};
  s.phase_bits = 0;
  s.min_range = s.min_amplitude = 0;
  s.max_range = 2 * s.tones[0];
  const double range = 1.5 * s.tones[0];
  return range - mean_of(readings(s, range, 0.9, 2000, seed).range);
}

TwoSurfaces two_surfaces(const Scanner& scanner, double separation) {
  constexpr int beams = 40;
  constexpr double near = 10;  // m
  const double far = near + separation;
  const double radius = (scanner.spot + near * scanner.divergence) / 2;
  Scanner s = scanner;
  s.motion = Motion::none;
  s.lever = s.mount = Vector3d::Zero();
  s.plane_beams = beams;
  s.planes = 1;
  s.plane_centre = 0;
  s.plane_field = 3 * radius / near;  // across the edge, from beside the beam to beside it
  s.interlace = 1;
  s.sub_rays = 19;
  s.edge_test = false;
  s.range_noise = s.range_noise_growth = s.amplitude_noise = 0;
  s.range_bias = s.range_scale = s.warm_up = s.leakage = s.harmonic = s.min_amplitude = 0;
  s.encoder_jitter = s.motion_jitter = s.index_error = s.eccentricity = 0;
  s.wobble = s.mirror_tilt = s.axis_tilt = 0;
  TriangleMesh mesh;
  add_screen(mesh, near, -9, 0, rock_reflectance);
  add_screen(mesh, far, -9, 7, rock_reflectance);
  const Scan seen = scan(RayCaster(std::move(mesh)), s, Pose::Identity(), 1, "two plates");

  const TwoPlates plates(s, near, far, rock_reflectance);
  TwoSurfaces result{.worst_difference = seen.range.size() == beams ? 0 : not_a_number};
  int both = 0;
  int between = 0;
  for (std::size_t i = 0; i < seen.range.size(); ++i) {
    const double angle = s.plane_field * ((seen.ring[i] + 0.5) / beams - 0.5);
    const TwoPlates::Reading exact = plates.reading(angle);
    result.worst_difference =
        std::max(result.worst_difference, std::abs(seen.range[i] - exact.range));
    // With less light from one of them the range is the other's, but for what rounding does.
    if (std::min(exact.near_light, exact.far_light) < 0.01) continue;
    ++both;
    between += seen.range[i] > near && seen.range[i] < far;
  }
  result.between = static_cast<double>(between) / both;
  return result;
}

double phase_noise_slope(const Scanner& scanner, std::uint64_t seed) {
  Scanner s = scanner;
  s.tones = {scanner.tones.at(0)};
  s.tone_depths = {};
  s.min_amplitude = 0;
  const double range = s.tones[0] / 2;  // no reading is near the ends of the interval
  double products = 0;
  double squares = 0;
  for (const double reflectance : {0.03, 0.05, 0.1, 0.2, 0.4, 0.8}) {
    const Scan seen = readings(s, range, reflectance, 20000, seed);
    const std::vector<double> amplitudes(seen.intensity.begin(), seen.intensity.end());
    const double A = mean_of(amplitudes);
    const double SNR = A * A / (2 * s.amplitude_noise * s.amplitude_noise);
    const double x = 1 / std::sqrt(2 * SNR);
    // 4 pi f / c = 2 pi / Lambda
    const double y = std::sqrt(variance_of(seen.range)) * 2 * pi / s.tones[0];
    products += x * y;
    squares += x * x;
  }
  return products / squares;
}

double brute_force_difference(const RayCaster& caster, const Vector3d& origin, std::uint64_t count,
                              std::uint64_t seed) {
  const TriangleMesh& mesh = caster.mesh();
  const double none = std::numeric_limits<double>::infinity();
  std::vector<double> difference(count, none);
  parallel_for(count, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Random random(derived_seed(seed, "brute force"), i);
      const Ray ray{origin, random_direction(random)};
      const std::optional<Hit> hit = caster.cast(ray.origin, ray.direction, 0, none);
      double nearest = none;
      for (const auto& [a, b, c] : mesh.triangles)
        nearest = std::min(nearest, ray_triangle(ray, mesh.vertices[a].cast<double>(),
                                                 mesh.vertices[b].cast<double>(),
                                                 mesh.vertices[c].cast<double>()));
      if (hit && nearest < none) difference[i] = std::abs(hit->range - nearest) / nearest;
      if (!hit && nearest == none) difference[i] = 0;
    }
  });
  return *std::max_element(difference.begin(), difference.end());
}

BeamShares beam_shares(const Scan& scan) {
  const auto with_flag = [&](ScanFlag flag) {
    const auto count = std::count_if(scan.flags.begin(), scan.flags.end(),
                                     [&](std::uint8_t f) { return (f & flag) != 0; });
    return static_cast<double>(count) / static_cast<double>(scan.flags.size());
  };
  const auto first = std::count(scan.echo.begin(), scan.echo.end(), std::uint8_t{1});
  return {.returned = static_cast<double>(first) / static_cast<double>(scan.beams),
          .mixed = with_flag(flag_mixed_pixel),
          .wrapped = with_flag(flag_wrapped),
          .outliers = with_flag(flag_outlier)};
}

}  // namespace minescan
