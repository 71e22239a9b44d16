// SPDX-License-Identifier: MIT
// How fast registration is, on the scans of the paper's JUNCTION. Times of two programs are
// compared within one run, in turn, with the errors that they end with beside: being fast at
// another accuracy would mean nothing.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <span>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "nanoflann_tree.h"
#include "registration/icp.h"
#include "registration/kdtree.h"
#include "registration/methods.h"
#include "registration/ndt.h"
#include "registration/ndt_field.h"
#include "registration/ndt_score.h"
#include "registration/ndt_sums.h"
#include "scenes/scene.h"
#include "scenes/scene_mesh.h"
#include "sim/survey.h"

namespace minescan {
namespace {

struct Pair {
  PointCloud target = {};
  PointCloud source = {};
  Pose truth = Pose::Identity();
};

const Pair& junction() {
  static const Pair pair = [] {
    const Survey& survey = find_survey("junction");
    const Scene scene = find_scene(survey.scene).make(survey.scene_settings, 1);
    std::vector<Scan> scans = run_survey(survey, mesh_of(scene), 1);
    Scan& target = scans.at(survey.pairs.at(0).target);
    Scan& source = scans.at(survey.pairs.at(0).source);
    return Pair{.target = std::move(target.cloud),
                .source = std::move(source.cloud),
                .truth = target.T_world_scanner.inverse() * source.T_world_scanner};
  }();
  return pair;
}

/// Start poses 1 m and 0.1 rad away (paper, section 5), in random directions.
Pose start(std::uint64_t number) {
  Random random(1, number);
  const auto direction = [&] {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    return Eigen::Vector3d(x, y, z).normalized();
  };
  const Eigen::Vector3d offset = direction(), axis = direction();
  return displaced(junction().truth, offset, axis, 0.1);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Wall time of `work`.
template <class Work>
double seconds(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What one method took and reached over the start poses.
struct Tally {
  std::vector<double> cpu = {}, translation = {}, rotation = {};
  double align_per_step = 0;  // seconds per used point and iteration, of the last run

  void run(const std::string& name, std::uint64_t number) {
    const Pair& pair = junction();
    const OneThread alone;
    const RegistrationResult result =
        find_method(name).run(pair.target, pair.source, start(number), {});
    const PoseError error = pose_error(pair.truth, result.T_target_source);
    cpu.push_back(result.cpu);
    translation.push_back(error.translation);
    rotation.push_back(error.rotation);
    align_per_step =
        result.time.align / result.iterations / static_cast<double>(result.used_points);
  }
  void report(benchmark::State& state, const std::string& name) const {
    state.counters[name + "_cpu_ms"] = 1e3 * median(cpu);
    state.counters[name + "_error_mm"] = 1e3 * median(translation);
    state.counters[name + "_error_mrad"] = 1e3 * median(rotation);
  }
};

/// One registration with all its preparations, from another start pose each time.
void registration(benchmark::State& state, const std::string& name) {
  junction();
  Tally tally;
  std::uint64_t number = 0;
  for (auto _ : state) tally.run(name, number++ % 16);
  tally.report(state, name);
  state.counters["ns_per_point_and_iteration"] = 1e9 * tally.align_per_step;
  state.counters["registrations"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(registration, ndt, std::string("ndt"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(registration, icp, std::string("icp"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(registration, robust, std::string("robust"))->Unit(benchmark::kMillisecond);

/// Ours and theirs in turn from the same start poses; `times_faster` is the ratio of the medians.
void against(benchmark::State& state, const std::string& ours, const std::string& theirs) {
  const auto known = [&](const Method& method) { return method.name == theirs; };
  if (std::none_of(methods().begin(), methods().end(), known)) {
    state.SkipWithError("built without MINESCAN_PCL");
    return;
  }
  junction();
  Tally our, their;
  std::uint64_t number = 0;
  for (auto _ : state) {
    our.run(ours, number);
    their.run(theirs, number++);
  }
  our.report(state, ours);
  their.report(state, theirs);
  state.counters["times_faster"] = median(their.cpu) / median(our.cpu);
}
BENCHMARK_CAPTURE(against, ndt_pcl, std::string("ndt"), std::string("pcl-ndt"))
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);
BENCHMARK_CAPTURE(against, icp_pcl, std::string("icp"), std::string("pcl-icp"))
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);

BENCHMARK_CAPTURE(against, gicp_pcl, std::string("gicp"), std::string("pcl-gicp"))
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);
BENCHMARK_CAPTURE(against, icp_plane_pcl, std::string("icp-plane"), std::string("pcl-icp-plane"))
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);
BENCHMARK_CAPTURE(against, robust_pcl_gicp, std::string("robust"), std::string("pcl-gicp"))
    ->Unit(benchmark::kMillisecond)
    ->Iterations(8);

void ndt_grid(benchmark::State& state) {
  const Pair& pair = junction();
  std::size_t bytes = 0, cells = 1;
  for (auto _ : state) {
    const NdtGrid grid(pair.target.points, {});
    bytes = grid.bytes();
    cells = grid.cells().size();
  }
  state.counters["bytes_per_cell"] = static_cast<double>(bytes) / static_cast<double>(cells);
  state.SetItemsProcessed(state.iterations() *
                          static_cast<std::int64_t>(pair.target.points.size()));
}
BENCHMARK(ndt_grid)->Unit(benchmark::kMillisecond);

/// The sums over points with all derivatives, beside the plain form of them.
void ndt_derivatives(benchmark::State& state) {
  const Pair& pair = junction();
  const NdtGrid grid(pair.target.points, {});
  const NdtField field = ndt_field(grid).value();
  const std::vector<Eigen::Vector3d> points = sampled_points(pair.source.points, {});
  const PackedPoints packed(points);
  std::vector<double> fast, plain;
  for (auto _ : state) {
    fast.push_back(
        seconds([&] { benchmark::DoNotOptimize(ndt_score(field, pair.truth, packed)); }));
    plain.push_back(
        seconds([&] { benchmark::DoNotOptimize(ndt_score(grid, pair.truth, points)); }));
  }
  const auto count = static_cast<double>(points.size());
  state.counters["ns_per_point"] = 1e9 * median(fast) / count;
  state.counters["plain_ns_per_point"] = 1e9 * median(plain) / count;
  state.counters["times_faster"] = median(plain) / median(fast);
  state.counters["bytes_of_target"] = static_cast<double>(field.bytes());
  state.counters["bytes_of_points"] =
      static_cast<double>(pair.target.points.size() * 3 * sizeof(double));
}
BENCHMARK(ndt_derivatives)->Unit(benchmark::kMicrosecond);

/// Beside nanoflann, both with 10 points per leaf.
void kdtree_build(benchmark::State& state) {
  const Pair& pair = junction();
  double ours = 0, theirs = 0;
  for (auto _ : state) {
    ours += seconds([&] { benchmark::DoNotOptimize(KdTree(pair.target.points, 10).bytes()); });
    theirs += seconds([&] { benchmark::DoNotOptimize(NanoflannTree(pair.target.points, 10)); });
  }
  const double points = static_cast<double>(state.iterations() * pair.target.points.size());
  state.counters["ns_per_point"] = 1e9 * ours / points;
  state.counters["nanoflann_ns_per_point"] = 1e9 * theirs / points;
  state.counters["times_faster"] = theirs / ours;
}
BENCHMARK(kdtree_build)->Unit(benchmark::kMillisecond);

/// The points nearest to a sample of the source, at the true pose (0 m off) and at a start; nearest
/// exactly, or within the paper's bound. nanoflann searches exactly.
void kdtree_nearest(benchmark::State& state) {
  const Pair& pair = junction();
  const KdTree tree(pair.target.points, 10);
  const NanoflannTree peer(pair.target.points, 10);
  const TreePolicy policy = {TreeSearch::additive, static_cast<double>(state.range(0)) / 1000};
  std::vector<Eigen::Vector3d> points = sampled_points(pair.source.points, {});
  for (Eigen::Vector3d& p : points) p = (state.range(1) == 0 ? pair.truth : start(0)) * p;
  double ours = 0, theirs = 0;
  for (auto _ : state) {
    ours += seconds([&] {
      for (const Eigen::Vector3d& p : points)
        benchmark::DoNotOptimize(tree.nearest(p, 1000, policy));
    });
    theirs += seconds([&] {
      for (const Eigen::Vector3d& p : points) benchmark::DoNotOptimize(peer.nearest(p));
    });
  }
  const double queries = static_cast<double>(state.iterations() * points.size());
  state.counters["ns_per_query"] = 1e9 * ours / queries;
  state.counters["nanoflann_ns_per_query"] = 1e9 * theirs / queries;
  state.counters["times_faster"] = theirs / ours;
}
BENCHMARK(kdtree_nearest)
    ->ArgNames({"error_mm", "off_m"})
    ->ArgsProduct({{0, 10}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

/// The nearest point and how far the others are: of each point alone, and of eight at once.
void kdtree_packets(benchmark::State& state) {
  const Pair& pair = junction();
  const KdTree tree(pair.target.points, 10);
  std::vector<Eigen::Vector3d> sample = sampled_points(pair.source.points, {}), points;
  for (const std::uint32_t i : KdTree(sample).order()) points.push_back(start(0) * sample[i]);
  double alone = 0, together = 0;
  for (auto _ : state) {
    alone += seconds([&] {
      for (const Eigen::Vector3d& p : points) benchmark::DoNotOptimize(tree.nearest_and_rest(p, 1));
    });
    together += seconds([&] {
      for (std::size_t i = 0; i < points.size(); i += KdPacket::size)
        benchmark::DoNotOptimize(tree.nearest_and_rest(
            std::span(points).subspan(i, std::min(KdPacket::size, points.size() - i)), 1));
    });
  }
  const double queries = static_cast<double>(state.iterations() * points.size());
  state.counters["alone_ns_per_query"] = 1e9 * alone / queries;
  state.counters["together_ns_per_query"] = 1e9 * together / queries;
  state.counters["times_faster"] = alone / together;
}
BENCHMARK(kdtree_packets)->Unit(benchmark::kMillisecond);

void sampling(benchmark::State& state, Sampling kind) {
  const Pair& pair = junction();
  for (auto _ : state)
    benchmark::DoNotOptimize(sampled_points(pair.source.points, {.sampling = kind}).data());
  state.SetItemsProcessed(state.iterations() *
                          static_cast<std::int64_t>(pair.source.points.size()));
}
BENCHMARK_CAPTURE(sampling, uniform, Sampling::uniform)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(sampling, spatial, Sampling::spatial)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace minescan
