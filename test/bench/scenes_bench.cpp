// SPDX-License-Identifier: MIT
// Contouring: triangles per second, and whether its cost grows with the surface and not with the
// space around it. Processor time of all threads is what to compare: on a busy machine the clock on
// the wall tells of its neighbours.
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "core/text.h"
#include "scenes/contour.h"
#include "scenes/mine.h"
#include "scenes/scene.h"
#include "scenes/scene_mesh.h"

namespace minescan {
namespace {

TriangleMesh mesh_from(const std::string& scene, double edge_length) {
  return mesh_of(find_scene(scene).make({{"edge-length", number_text(edge_length)}}, 1));
}

struct Seconds {
  double processor = 0;  // of all threads
  double wall = 0;
};

Seconds seconds_of(auto&& work) {
  const auto processor = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const auto wall = std::chrono::steady_clock::now();
  const double start = processor();
  work();
  return {processor() - start,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count()};
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>();
    sum += (b - a).cross(c - a).norm() / 2;
  }
  return sum;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// `ns_per_square` is processor time per square of the lattice on the surface (m^2 * edge^-2). It
// stays about flat where cost grows with the area; shorter edges show one more octave of relief.
void contour_scene(benchmark::State& state, const std::string& scene) {
  const double edge = 1e-3 * static_cast<double>(state.range(0));
  TriangleMesh mesh;
  std::vector<double> processor, wall;
  for (auto _ : state) {
    const Seconds seconds = seconds_of([&] { mesh = mesh_from(scene, edge); });
    processor.push_back(seconds.processor);
    wall.push_back(seconds.wall);
  }
  const auto triangles = static_cast<double>(mesh.triangles.size());
  const auto bytes =
      static_cast<double>(mesh.vertices.size() * sizeof(mesh.vertices[0]) +
                          mesh.triangles.size() * sizeof(mesh.triangles[0]) + mesh.material.size());
  state.counters["triangles"] = triangles;
  state.counters["triangles_per_s"] = triangles / median(wall);
  state.counters["triangles_per_cpu_s"] = triangles / median(processor);
  state.counters["bytes_per_triangle"] = bytes / triangles;
  state.counters["ns_per_square"] = 1e9 * median(processor) * edge * edge / area(mesh);
}
BENCHMARK_CAPTURE(contour_scene, junction, std::string("junction"))
    ->ArgName("edge_mm")
    ->Arg(100)
    ->Arg(50)
    ->Iterations(3)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(contour_scene, junction, std::string("junction"))
    ->ArgName("edge_mm")
    ->Arg(25)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(contour_scene, kvarntorp_loop, std::string("kvarntorp-loop"))
    ->ArgName("edge_mm")
    ->Arg(50)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// The same drift in bounds of ten times its length, width and height: `large_to_small` is the
// median of the ratios of processor times of neighbouring turns.
void contour_in_empty_space(benchmark::State& state) {
  const double edge = 0.1;
  Mine mine;
  mine.drifts["main"] = {.line = {{-15, 0, 0}, {15, 0, 0}}};
  const ImplicitSurface small = surface_of(mine, 1, edge);
  ImplicitSurface large = small;
  const Eigen::Vector3d centre = small.bounds.center();
  large.bounds = {centre - 5 * small.bounds.sizes(), centre + 5 * small.bounds.sizes()};
  std::vector<double> ratios;
  for (auto _ : state) {
    const double in_small =
        seconds_of([&] { benchmark::DoNotOptimize(contour(small, edge)); }).processor;
    const double in_large =
        seconds_of([&] { benchmark::DoNotOptimize(contour(large, edge)); }).processor;
    ratios.push_back(in_large / in_small);
  }
  state.counters["large_to_small"] = median(ratios);
}
BENCHMARK(contour_in_empty_space)->Iterations(7)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace minescan
