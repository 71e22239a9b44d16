// SPDX-License-Identifier: MIT
#include "sim/scan_picture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/interval.h"
#include "sim/drawing.h"

namespace minescan {
namespace {

using Eigen::Vector3d;

constexpr double degree = 0.017453292519943295;

// Anchors of the colour map viridis (van der Walt and Smith 2015), from its dark end but for the
// darkest, which could not be told from the ground.
const std::array<Vector3d, 6> colours = {Vector3d(0.28, 0.18, 0.48), Vector3d(0.23, 0.32, 0.55),
                                         Vector3d(0.17, 0.45, 0.56), Vector3d(0.13, 0.57, 0.55),
                                         Vector3d(0.37, 0.79, 0.38), Vector3d(0.99, 0.91, 0.15)};

// Of a value in [0, 1].
Vector3d colour_of(double value) {
  const double place = std::clamp(value, 0.0, 1.0) * (colours.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), colours.size() - 2);
  const double part = place - static_cast<double>(i);
  return (1 - part) * colours[i] + part * colours[i + 1];
}

// What a point can be besides a good one; the worst first.
struct Kind {
  ScanFlag flag;
  std::string_view label;
  Vector3d colour;
};
const std::array<Kind, 3> kinds = {Kind{flag_wrapped, "wrapped", Vector3d(1, 1, 1)},
                                   Kind{flag_outlier, "wrong period", Vector3d(1, 0.35, 0.1)},
                                   Kind{flag_mixed_pixel, "mixed pixel", Vector3d(1, 0.3, 0.85)}};
constexpr std::size_t no_kind = kinds.size();
std::size_t kind_of(std::uint8_t flags) {
  std::size_t k = 0;
  while (k < kinds.size() && (flags & kinds[k].flag) == 0) ++k;
  return k;
}

// What all but a share of the values at either end are in; wider than a point.
Interval inner(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) {
    return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
  };
  const Interval result{at(share), at(1 - share)};
  return result.high > result.low ? result : Interval{result.low - 0.5, result.high + 0.5};
}

double within(const Interval& interval, double value) {
  return (value - interval.low) / (interval.high - interval.low);
}

// Amplitudes that are shown, as logarithms.
double shown_amplitude(float intensity) {
  return std::log10(std::max(static_cast<double>(intensity), 1e-9));
}
Interval shown_amplitudes(const Scan& scan) {
  std::vector<double> values;
  for (const float a : scan.intensity) values.push_back(shown_amplitude(a));
  return inner(std::move(values), 0.02);
}

void check_scan(const Scan& scan, int width) {
  constexpr int smallest_width = 300;  // for the legend
  if (width < smallest_width)
    throw std::invalid_argument(fmt::format(
        "picture: expected a width of {} pixels or more, found {}", smallest_width, width));
  check_edge("width", width);
  if (scan.cloud.points.empty())
    throw std::invalid_argument("picture: expected a scan with points, found none");
}

// "title low [colours] high" with the upper left corner there; `reversed`: bright is little.
// Returns where it ends.
int draw_scale(Picture& p, int x, int y, const std::string& title, const std::string& low,
               const std::string& high, bool reversed, int dot) {
  const int gap = 4 * dot;
  const std::string before = title + " " + low;
  write_text(p, x, y, before, dot);
  x += text_width(before, dot) + gap;
  const int length = 60 * dot;
  for (int i = 0; i < length; ++i) {
    const double value = static_cast<double>(i) / (length - 1);
    fill_rectangle(p, x + i, y, 1, glyph_height * dot, colour_of(reversed ? 1 - value : value));
  }
  x += length + gap;
  write_text(p, x, y, high, dot);
  return x + text_width(high, dot);
}

}  // namespace

Picture grid_picture(const Scan& scan, bool rings_across, int width) {
  check_scan(scan, width);
  if (scan.rings == 0 || scan.columns == 0)
    throw std::invalid_argument("picture: expected a scan with a grid");
  const int across = static_cast<int>(rings_across ? scan.rings : scan.columns);
  const int down = static_cast<int>(rings_across ? scan.columns : scan.rings);
  const int dot = dot_size(width);
  const int margin = 8 * dot;
  const int columns = width - 2 * margin;
  const int rows =
      std::clamp(static_cast<int>(std::lround(static_cast<double>(columns) * down / across)),
                 columns / 6, columns * 3 / 4);
  const int caption = 16 * dot;
  const int panel = rows + caption + margin;
  Picture picture = blank_picture(width, margin + 2 * panel, ground_colour);

  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> cell(static_cast<std::size_t>(scan.rings) * scan.columns, none);
  for (std::size_t i = 0; i < scan.ring.size(); ++i)
    if (scan.echo[i] == 1)
      cell[static_cast<std::size_t>(scan.column[i]) * scan.rings + scan.ring[i]] =
          static_cast<std::uint32_t>(i);

  const Interval amplitudes = shown_amplitudes(scan);
  const Interval ranges = inner(scan.range, 0.02);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const int i = static_cast<int>((x + 0.5) * across / columns);
      const int j = static_cast<int>((y + 0.5) * down / rows);
      const int ring = rings_across ? across - 1 - i : j;
      const int column = rings_across ? down - 1 - j : i;
      const std::uint32_t point =
          cell[static_cast<std::size_t>(column) * scan.rings + static_cast<std::size_t>(ring)];
      Vector3d amplitude = Vector3d::Zero();
      Vector3d range = Vector3d::Zero();
      if (point != none) {
        amplitude = colour_of(within(amplitudes, shown_amplitude(scan.intensity[point])));
        range = colour_of(1 - within(ranges, scan.range[point]));
      }
      set_pixel(picture, margin + x, margin + y, amplitude);
      set_pixel(picture, margin + x, margin + panel + y, range);
    }
  const int below = margin + rows + 6 * dot;
  draw_scale(picture, margin, below, "amplitude",
             fmt::format("{:.2g}", std::pow(10, amplitudes.low)),
             fmt::format("{:.2g}", std::pow(10, amplitudes.high)), false, dot);
  draw_scale(picture, margin, below + panel, "range", fmt::format("{:.1f} m", ranges.low),
             fmt::format("{:.1f} m", ranges.high), true, dot);
  return picture;
}

Picture points_picture(const Scan& scan, int width) {
  check_scan(scan, width);
  // Right, up and out of the picture, in the scanner frame.
  const double azimuth = -120 * degree;
  const double elevation = 30 * degree;
  const Vector3d out(std::cos(elevation) * std::cos(azimuth),
                     std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  const Vector3d right = Vector3d::UnitZ().cross(out).normalized();
  const Vector3d up = out.cross(right);

  struct Point {
    double x, y, depth;
    std::size_t kind;
    bool faces;    // whether its surface is turned towards the eye
    double value;  // amplitude in [0, 1]
  };
  const Interval amplitudes = shown_amplitudes(scan);
  std::vector<Point> points;
  std::vector<double> xs, ys;  // of those that may set the frame
  std::array<std::size_t, kinds.size()> counts = {};
  for (std::size_t i = 0; i < scan.cloud.points.size(); ++i) {
    const Vector3d& p = scan.cloud.points[i];
    const Point point{p.dot(right),
                      p.dot(up),
                      p.dot(out),
                      kind_of(scan.flags[i]),
                      scan.true_normal[i].cast<double>().dot(out) > 0,
                      within(amplitudes, shown_amplitude(scan.intensity[i]))};
    if (point.kind != no_kind) ++counts[point.kind];
    if ((scan.flags[i] & flag_outlier) == 0) {
      xs.push_back(point.x);
      ys.push_back(point.y);
    }
    points.push_back(point);
  }
  if (xs.empty())
    for (const Point& point : points) {
      xs.push_back(point.x);
      ys.push_back(point.y);
    }
  // One scale for both; the few points that lie far off all others do not make the rest small.
  Interval x_range = inner(std::move(xs), 0.002);
  Interval y_range = inner(std::move(ys), 0.002);
  const double size_x = x_range.high - x_range.low;
  const double size_y = y_range.high - y_range.low;
  const double border = 0.06 * std::max(size_x, size_y);
  const int dot = dot_size(width);
  const int line = 14 * dot;
  const int caption = 2 * line + 4 * dot;
  const double scale =
      std::min(width / (size_x + 2 * border), (width - caption) / (size_y + 2 * border));
  const int rows =
      std::min(width - caption, static_cast<int>(std::ceil(scale * (size_y + 2 * border))));
  Picture picture = blank_picture(width, rows + caption, ground_colour);
  const double middle_x = (x_range.low + x_range.high) / 2;
  const double middle_y = (y_range.low + y_range.high) / 2;

  // Points as large as they are apart.
  const auto shown = static_cast<double>(points.size());
  const int size = std::clamp(
      static_cast<int>(std::lround(0.8 * std::sqrt(scale * size_x * scale * size_y / shown))), 1,
      4);
  std::vector<float> nearest(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows),
                             -std::numeric_limits<float>::infinity());
  std::size_t beyond = 0;
  enum class Layer { turned_away, seen, bad };  // each in front of the one before
  for (const Layer layer : {Layer::turned_away, Layer::seen, Layer::bad})
    for (const Point& point : points) {
      const bool good = point.kind == no_kind;
      if (layer != (!good ? Layer::bad : point.faces ? Layer::seen : Layer::turned_away)) continue;
      const double u = width / 2.0 + scale * (point.x - middle_x);
      const double v = rows / 2.0 - scale * (point.y - middle_y);
      if (!(u >= 0 && v >= 0 && u < width && v < rows)) {
        ++beyond;
        continue;
      }
      const int edge = good ? size : size + 1;
      const int left = static_cast<int>(u) - edge / 2;
      const int top = static_cast<int>(v) - edge / 2;
      Vector3d colour = good ? colour_of(point.value) : kinds[point.kind].colour;
      if (layer == Layer::turned_away) colour = 0.3 * colour + 0.7 * ground_colour;
      for (int y = std::max(top, 0); y < std::min(top + edge, rows); ++y)
        for (int x = std::max(left, 0); x < std::min(left + edge, width); ++x) {
          float& depth = nearest[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(x)];
          if (layer == Layer::seen && static_cast<float>(point.depth) < depth) continue;
          if (layer == Layer::seen) depth = static_cast<float>(point.depth);
          set_pixel(picture, x, y, colour);
        }
    }

  const int margin = 8 * dot;
  const double length = round_length(width / scale / 8);
  int x =
      draw_bar(picture, margin, rows + 6 * dot + glyph_height * dot,
               static_cast<int>(std::lround(length * scale)), fmt::format("{:g} m", length), dot);
  draw_scale(picture, x + 12 * dot, rows + 6 * dot, "amplitude",
             fmt::format("{:.2g}", std::pow(10, amplitudes.low)),
             fmt::format("{:.2g}", std::pow(10, amplitudes.high)), false, dot);
  x = margin;
  const int second = rows + 6 * dot + line;
  for (std::size_t k = kinds.size(); k-- > 0;) {
    if (counts[k] == 0) continue;
    const std::string label = fmt::format("{} {}", counts[k], kinds[k].label);
    fill_rectangle(picture, x, second, glyph_height * dot, glyph_height * dot, kinds[k].colour);
    write_text(picture, x + 10 * dot, second, label, dot);
    x += 22 * dot + text_width(label, dot);
  }
  if (beyond > 0) write_text(picture, x, second, fmt::format("{} beyond the frame", beyond), dot);
  return picture;
}

}  // namespace minescan
