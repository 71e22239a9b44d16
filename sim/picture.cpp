// SPDX-License-Identifier: MIT
#include "sim/picture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "sim/drawing.h"

namespace minescan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int samples = 2;  // per pixel and direction; their mean is the pixel

// What these pictures look like was chosen by eye. Colours are red, green, blue in [0, 1].
const Vector3d outline(0.02, 0.02, 0.03);
constexpr double brightest_surface = 0.94;  // so that ink stands out everywhere
constexpr double step_height = 0.05;        // metres; lower steps cast no shadow in a plan
constexpr double step_slope = 1.5;
constexpr double step_shadow = 0.55;

// A colour of brightness about 1 by which a material can be told from others; the first, mostly
// the rock, is grey. Hues at the golden angle stay apart however many there are. Wet is bluish.
Vector3d tint(std::size_t material, double wetness) {
  const double angle =
      2 * std::numbers::pi * (static_cast<double>(material) * std::numbers::phi - 0.13);
  const double third = 2 * std::numbers::pi / 3;
  const Vector3d hue(std::cos(angle), std::cos(angle - third), std::cos(angle + third));
  const Vector3d dry =
      material == 0 ? Vector3d(1.03, 1, 0.96) : Vector3d(Vector3d::Ones() + 0.17 * hue);
  return (1 - 0.4 * wetness) * dry + 0.4 * wetness * Vector3d(0.75, 1, 1.2);
}

std::vector<Vector3d> tints(const TriangleMesh& mesh) {
  std::vector<Vector3d> result;
  for (std::size_t i = 0; i < mesh.materials.size(); ++i)
    result.push_back(tint(i, mesh.materials[i].wetness));
  return result;
}

// ---- the plan

// The normal on the side that the triangle's vertices run counter-clockwise on.
Vector3d front_normal(const TriangleMesh& mesh, std::uint32_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  const Vector3d a = mesh.vertices[corners[0]].cast<double>();
  const Vector3d b = mesh.vertices[corners[1]].cast<double>();
  const Vector3d c = mesh.vertices[corners[2]].cast<double>();
  return (b - a).cross(c - a).normalized();
}

// What one ray of the plan sees.
struct Floor {
  bool open = false;
  double height = 0;  // z
  Vector3d colour = Vector3d::Zero();
};

struct Plan {
  const RayCaster& caster;
  std::vector<Vector3d> tints;
  Eigen::AlignedBox3d bounds = {};
  bool turned = false;  // world y to the right and x downwards, else x to the right and y upwards
  double metres_per_pixel = 1;
  Vector3d light = Vector3d::UnitZ();

  // The place below a place of the picture, in pixels from the upper left corner of the plan.
  Vector2d world(double x, double y) const {
    const double right = x * metres_per_pixel;
    const double down = y * metres_per_pixel;
    return turned ? Vector2d(bounds.min().x() + down, bounds.min().y() + right)
                  : Vector2d(bounds.min().x() + right, bounds.max().y() - down);
  }
  // Right, up and out of the picture.
  Vector3d in_picture(const Vector3d& v) const {
    return turned ? Vector3d(v.y(), -v.x(), v.z()) : v;
  }

  Vector3d shaded(std::uint32_t triangle, const Vector3d& normal) const;
  Floor below(const Vector2d& place) const;
};

Vector3d Plan::shaded(std::uint32_t triangle, const Vector3d& normal) const {
  // Slopes twice as steep as they are: relief of floors is low.
  const Vector3d n = Vector3d(2 * normal.x(), 2 * normal.y(), normal.z()).normalized();
  const double hill = std::max(0.0, in_picture(n).dot(light));
  const TriangleMesh& mesh = caster.mesh();
  const std::size_t material = mesh.material[triangle];
  // The cube root keeps black rubber and white paint on one picture.
  const double tone = std::cbrt(wet_reflectance(mesh.materials[material]));
  return (tone * (0.3 + 0.9 * hill) * tints[material]).cwiseMin(brightest_surface);
}

Floor Plan::below(const Vector2d& place) const {
  const Vector3d origin(place.x(), place.y(), bounds.max().z() + 1);
  const double bottom = bounds.sizes().z() + 2;
  // Beyond the rounding of a hit to single precision, so that no surface is met twice.
  const double step = 1e-4 + 1e-6 * bounds.max().cwiseAbs().cwiseMax(bounds.min().cwiseAbs()).sum();
  constexpr int most_surfaces = 200;  // one above the other; only broken meshes have more
  bool inside = false;
  double passed = 0;
  for (int i = 0; i < most_surfaces; ++i) {
    const std::optional<Hit> hit = caster.cast(origin, -Vector3d::UnitZ(), passed, bottom);
    if (!hit) break;
    const Vector3d normal = front_normal(caster.mesh(), hit->triangle);
    if (normal.z() < 0) inside = true;
    if (normal.z() > 0 && inside)
      return {
          .open = true, .height = origin.z() - hit->range, .colour = shaded(hit->triangle, normal)};
    passed = std::max(passed, hit->range) + step;
  }
  return {};
}

// The bounds of what is drawn: vertices of no triangle do not count.
Eigen::AlignedBox3d bounds_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d bounds;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) bounds.extend(mesh.vertices[v].cast<double>());
  return bounds;
}

// Which way x and y lie, in a square of 16 dots with the upper left corner there.
void draw_axes(Picture& p, int x, int y, bool turned, int dot) {
  const int arm = 10 * dot;
  const int lower = y + 16 * dot;
  if (turned) {
    fill_rectangle(p, x, y + dot, arm, dot, ink_colour);
    fill_rectangle(p, x, y + dot, dot, arm, ink_colour);
    write_text(p, x + arm + 2 * dot, y - 2 * dot, "y", dot);
    write_text(p, x + 3 * dot, y + 6 * dot, "x", dot);
  } else {
    fill_rectangle(p, x, lower - 2 * dot, arm, dot, ink_colour);
    fill_rectangle(p, x, lower - dot - arm, dot, arm, ink_colour);
    write_text(p, x + arm + 2 * dot, lower - 7 * dot, "x", dot);
    write_text(p, x + 3 * dot, lower - 7 * dot - 9 * dot, "y", dot);
  }
}

// ---- the view inside

struct Camera {
  Pose T_world_camera = Pose::Identity();
  int width = 1;
  int height = 1;
  double focal_length = 1;  // pixels

  // The unit vector, in the world, towards a place of the picture in pixels.
  Vector3d direction(double x, double y) const {
    return T_world_camera.linear() *
           Vector3d(focal_length, width / 2.0 - x, height / 2.0 - y).normalized();
  }
};

// Light sent to the eye by a surface, as a display shows it.
Vector3d lit(const Camera& camera, const TriangleMesh& mesh, std::span<const Vector3d> tints,
             const Hit& hit) {
  if (hit.triangle == no_triangle) return ground_colour;
  const std::size_t material = mesh.material[hit.triangle];
  // The lamp grows dimmer with distance, but less than lamps do, and the ambient light from the
  // upper left even less, so that what is far can be seen as well. Ambient light shows the relief
  // of what the lamp meets head-on.
  const double lamp = 0.6 * hit.cosine * std::pow(1 + hit.range / 6, -1.5);
  static const Vector3d from = Vector3d(-0.3, 0.7, 0.65).normalized();
  const double facing =
      std::max(0.05, 0.4 + 0.6 * hit.normal.dot(camera.T_world_camera.linear() * from));
  const double ambient = 0.45 * facing / (1 + hit.range / 12);
  const double light = 2.6 * wet_reflectance(mesh.materials[material]) * (lamp + ambient);
  return (std::pow(light, 1 / 2.2) * tints[material]).cwiseMin(brightest_surface);
}

void render_rows(const RayCaster& caster, const Camera& camera, std::span<const Vector3d> tints,
                 int first_row, int last_row, Picture& picture) {
  constexpr int block = 2;  // pixels; with 2 x 2 samples each they are one packet
  static_assert(block * block * samples * samples == lanes);
  RayPacket packet;
  HitPacket hits;
  for (int y = first_row; y < last_row; y += block) {
    for (int x = 0; x < camera.width; x += block) {
      const int columns = std::min(block, camera.width - x);
      const int rows = std::min(block, last_row - y);
      packet.count = 0;
      for (int j = 0; j < rows * samples; ++j)
        for (int i = 0; i < columns * samples; ++i)
          packet.set(packet.count++,
                     {camera.T_world_camera.translation(),
                      camera.direction(x + (i + 0.5) / samples, y + (j + 0.5) / samples)});
      packet.fill();
      caster.cast_packet(packet, std::numeric_limits<double>::infinity(), hits);
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
          Vector3d sum = Vector3d::Zero();
          for (int j = 0; j < samples; ++j)
            for (int i = 0; i < samples; ++i) {
              const int ray = (r * samples + j) * columns * samples + c * samples + i;
              sum += lit(camera, caster.mesh(), tints, hits.lane(static_cast<std::size_t>(ray)));
            }
          set_pixel(picture, x + c, y + r, sum / (samples * samples));
        }
      }
    }
  }
}

}  // namespace

Picture plan_picture(const RayCaster& caster, int width) {
  check_edge("width", width);
  const TriangleMesh& mesh = caster.mesh();
  Plan plan{.caster = caster, .tints = tints(mesh), .bounds = bounds_of(mesh)};
  const Vector3d size = plan.bounds.sizes();
  plan.turned = size.y() > size.x();
  plan.light = Vector3d(-1, 1, 1.6).normalized();  // from the upper left
  const double longer = std::max(size.x(), size.y());
  const double shorter = std::min(size.x(), size.y());

  const int dot = dot_size(width);
  const int margin = std::min(12 * dot, width / 8);
  const int columns = width - 2 * margin;
  if (longer > 0) plan.metres_per_pixel = longer / columns;
  // A quotient that rounding left a hair above a whole number is that number.
  const int rows = std::max(1, static_cast<int>(std::ceil(shorter / plan.metres_per_pixel - 1e-6)));
  const int caption = 24 * dot;
  Picture picture = blank_picture(width, margin + rows + caption, ground_colour);

  // How much of each pixel is open, of samples^2.
  std::vector<std::uint8_t> open(static_cast<std::size_t>(columns) *
                                 static_cast<std::size_t>(rows));
  std::vector<double> height(open.size(), -std::numeric_limits<double>::infinity());
  const auto slot = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(x);
  };
  parallel_for(static_cast<std::size_t>(rows), 4, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < columns; ++x) {
        Vector3d sum = Vector3d::Zero();
        for (int j = 0; j < samples; ++j)
          for (int i = 0; i < samples; ++i) {
            const Floor floor =
                plan.below(plan.world(x + (i + 0.5) / samples, y + (j + 0.5) / samples));
            sum += floor.open ? floor.colour : ground_colour;
            if (!floor.open) continue;
            ++open[slot(x, y)];
            height[slot(x, y)] = floor.height;
          }
        set_pixel(picture, margin + x, margin + y, sum / (samples * samples));
      }
  });

  // The shadow at the foot of a step, where flat faces on both sides would look alike.
  parallel_for(static_cast<std::size_t>(rows), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < columns; ++x) {
        if (open[slot(x, y)] == 0) continue;
        const double step = step_height + step_slope * plan.metres_per_pixel;
        bool low = false;
        for (const auto& [i, j] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}})
          low = low || (i >= 0 && j >= 0 && i < columns && j < rows &&
                        height[slot(i, j)] > height[slot(x, y)] + step);
        if (!low) continue;
        std::uint8_t* rgb = pixel(picture, margin + x, margin + y);
        for (int c = 0; c < 3; ++c) rgb[c] = static_cast<std::uint8_t>(step_shadow * rgb[c]);
      }
  });

  // The walls' outline: rock next to what is open, so that it hides nothing.
  const int reach = dot;
  parallel_for(static_cast<std::size_t>(rows), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < columns; ++x) {
        if (open[slot(x, y)] * 2 > samples * samples) continue;
        bool near = false;
        for (int j = std::max(0, y - reach); j <= std::min(rows - 1, y + reach); ++j)
          for (int i = std::max(0, x - reach); i <= std::min(columns - 1, x + reach); ++i)
            near = near || open[slot(i, j)] * 2 > samples * samples;
        if (near) set_pixel(picture, margin + x, margin + y, outline);
      }
  });

  const double length = round_length(columns * plan.metres_per_pixel / 4);
  const int base = picture.height - 8 * dot;
  const int bar_end =
      draw_bar(picture, margin, base, static_cast<int>(std::lround(length / plan.metres_per_pixel)),
               fmt::format("{:g} m", length), dot);
  const std::string extents = fmt::format("{:.1f} x {:.1f} m", size.x(), size.y());
  const int extents_start = width - margin - text_width(extents, dot);
  const int axes_start = extents_start - 30 * dot;
  if (extents_start > bar_end + 4 * dot)
    write_text(picture, extents_start, base - glyph_height * dot, extents, dot);
  if (axes_start > bar_end + 4 * dot)
    draw_axes(picture, axes_start, base - 16 * dot, plan.turned, dot);
  return picture;
}

Picture inside_picture(const RayCaster& caster, const Pose& T_world_camera, double field, int width,
                       int height) {
  check_edge("width", width);
  check_edge("height", height);
  if (!(field > 0 && field < std::numbers::pi))
    throw std::invalid_argument(
        fmt::format("picture: expected a field of view in (0, pi) rad, found {}", field));
  if (!T_world_camera.matrix().allFinite() || !T_world_camera.linear().isUnitary(1e-6))
    throw std::invalid_argument(
        "picture: expected a finite camera pose, a rotation and a translation");
  const Camera camera{.T_world_camera = T_world_camera,
                      .width = width,
                      .height = height,
                      .focal_length = width / 2.0 / std::tan(field / 2)};
  const std::vector<Vector3d> colours = tints(caster.mesh());
  Picture picture = blank_picture(width, height, ground_colour);
  parallel_for(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
    render_rows(caster, camera, colours, static_cast<int>(begin), static_cast<int>(end), picture);
  });

  const std::optional<Hit> middle =
      caster.cast(T_world_camera.translation(), T_world_camera.linear().col(0), 0,
                  std::numeric_limits<double>::infinity());
  if (!middle || !(middle->range > 0)) return picture;
  const int dot = dot_size(width);
  const int cross = 4 * dot;
  fill_rectangle(picture, width / 2 - cross, height / 2, 2 * cross + 1, 1, ink_colour);
  fill_rectangle(picture, width / 2, height / 2 - cross, 1, 2 * cross + 1, ink_colour);
  // One metre, or ten or a tenth of it and so on where that is no sensible length of a bar.
  const double pixels_per_metre = camera.focal_length / middle->range;
  double length = 1;
  while (length * pixels_per_metre > width * 0.5) length /= 10;
  while (length * pixels_per_metre < 4 * dot) length *= 10;
  const int margin = std::min(12 * dot, width / 8);
  const int bar = static_cast<int>(std::lround(length * pixels_per_metre));
  const std::string label = fmt::format("{:g} m at {:.2f} m", length, middle->range);
  // On a dark ground, to be read on any rock.
  fill_rectangle(picture, margin - 4 * dot, height - 19 * dot,
                 bar + 12 * dot + text_width(label, dot), 15 * dot, ground_colour);
  draw_bar(picture, margin, height - 8 * dot, bar, label, dot);
  return picture;
}

Picture stacked(const Picture& above, const Picture& below) {
  for (const Picture* p : {&above, &below}) {
    if (p->width < 1 || p->height < 1 ||
        p->rgb.size() !=
            3 * static_cast<std::size_t>(p->width) * static_cast<std::size_t>(p->height))
      throw std::invalid_argument(
          fmt::format("picture: expected 3 bytes for each of {} x {} pixels, found {}", p->width,
                      p->height, p->rgb.size()));
  }
  Picture result =
      blank_picture(std::max(above.width, below.width), above.height + below.height, ground_colour);
  int top = 0;
  for (const Picture* p : {&above, &below}) {
    const int left = (result.width - p->width) / 2;
    for (int y = 0; y < p->height; ++y) {
      const auto row = p->rgb.begin() + static_cast<std::ptrdiff_t>(3) * p->width * y;
      std::copy(row, row + static_cast<std::ptrdiff_t>(3) * p->width, pixel(result, left, top + y));
    }
    top += p->height;
  }
  return result;
}

}  // namespace minescan
