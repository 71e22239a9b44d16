// SPDX-License-Identifier: MIT
#include "scenes/spectra.h"

#include <cmath>
#include <numbers>

#include "scenes/scene_mesh.h"

namespace minescan {
namespace {

constexpr double pi = std::numbers::pi;

}  // namespace

RockOptions flat_rock() {
  RockOptions rock;
  rock.wall.rms = rock.ceiling.rms = rock.concrete.rms = 0;
  rock.floor_class = RoadClass::none;
  rock.bedding_step = rock.overbreak = rock.look_out = rock.half_cast_spacing = 0;
  rock.rock_density = rock.rut_depth = rock.wet_share = rock.puddle_share = 0;
  rock.corner_radius = 0;
  return rock;
}

TriangleMesh drift_mesh(const RockOptions& rock, const StraightDrift& drift, double edge_length,
                        std::uint64_t seed) {
  Mine mine;
  mine.drifts["main"] = {
      .line = {{drift.from, 0, 0}, {drift.to, 0, 0}}, .width = drift.width, .height = drift.height};
  mine.rock = rock;
  return mesh_of(scene_of("drift", mine, {.edge_length = edge_length}, seed));
}

ProfileDensity::ProfileDensity(int samples, double step)
    : n_(static_cast<std::size_t>(samples)), step_(step), turn_(n_), window_(n_), sum_(n_ / 2) {
  for (std::size_t i = 0; i < n_; ++i) {
    const double angle = 2 * pi * static_cast<double>(i) / static_cast<double>(n_);
    turn_[i] = std::polar(1.0, -angle);
    window_[i] = 0.5 - 0.5 * std::cos(angle);
  }
}

void ProfileDensity::add(const std::function<double(double along)>& height) {
  std::vector<double> profile(n_);
  double mean = 0, weights = 0, squares = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    profile[i] = height(static_cast<double>(i) * step_);
    mean += window_[i] * profile[i];
    weights += window_[i];
    squares += window_[i] * window_[i];
  }
  mean /= weights;
  for (std::size_t i = 0; i < n_; ++i) profile[i] = window_[i] * (profile[i] - mean);
  for (std::size_t k = 0; k < sum_.size(); ++k) {
    std::complex<double> amplitude = 0;
    std::size_t turn = 0;  // i k modulo n
    for (std::size_t i = 0; i < n_; ++i) {
      amplitude += profile[i] * turn_[turn];
      turn += k;
      if (turn >= n_) turn -= n_;
    }
    sum_[k] += 2 * std::norm(amplitude) * step_ / squares;
  }
  ++lines_;
}

double ProfileDensity::smoothed(double frequency, double edge, double power) const {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 1; k < sum_.size(); ++k) {
    const double f = static_cast<double>(k) / (static_cast<double>(n_) * step_);
    if (f < frequency / std::exp2(0.25) || f >= frequency * std::exp2(0.25)) continue;
    const double sinc = std::sin(pi * f * edge) / (pi * f * edge);
    sum += sum_[k] / lines_ * std::pow(f, power) / std::pow(sinc, 4);
    ++count;
  }
  return sum / count;
}

double ProfileDensity::slope(double shortest, double longest, double edge) const {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, n = 0;
  for (double f = 1 / longest; f <= 1.001 / shortest; f *= std::sqrt(2.0)) {
    const double x = std::log(f), y = std::log(smoothed(f, edge));
    ++n;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

double vertex_row(double coordinate, double edge) {
  return (std::floor(coordinate / edge) + 0.5) * edge;
}

DriftSpectra drift_spectra(const RockOptions& rock, double edge, std::uint64_t first,
                           std::uint64_t count, const MakeRangeFinder& range_finder) {
  const StraightDrift drift{};
  const double from = 2, step = edge / 2;
  const ProfileDensity none(static_cast<int>((drift.to - 2 * from) / step), step);
  DriftSpectra s{none, none, none};
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const DriftSurvey survey(drift, range_finder(drift_mesh(rock, drift, edge, seed)));
    for (double z = 0.5; z < drift.height - 0.4; z += 0.5) {
      s.wall.add([&](double x) { return survey.left(from + x, vertex_row(z, edge)); });
      s.wall.add([&](double x) { return survey.right(from + x, vertex_row(z, edge)); });
    }
    for (double y = -4; y < 4.1; y += 0.5) {
      s.ceiling.add([&](double x) { return survey.ceiling(from + x, vertex_row(y, edge)); });
      s.floor.add([&](double x) { return survey.floor(from + x, vertex_row(y, edge)); });
    }
  }
  return s;
}

}  // namespace minescan
