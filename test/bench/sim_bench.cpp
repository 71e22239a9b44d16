// SPDX-License-Identifier: MIT
// Rays per second of complete scans beside those of bare Embree on the same rays, in one run, so
// that the ratio means something on any machine. Embree gets its best order: packets of 16 over
// tiles of 4 x 4 neighbouring beams, coherent, directions laid out in advance.
#include <benchmark/benchmark.h>
#include <time.h>
#if __has_include(<embree3/rtcore.h>)
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "core/parallel.h"
#include "scenes/scene.h"
#include "scenes/scene_mesh.h"
#include "sim/kinematics.h"
#include "sim/raycaster.h"
#include "sim/scan.h"
#include "sim/survey.h"

namespace minescan {
namespace {

constexpr int tile = 4;

// The junction of the paper, 5 cm, as large as users have it.
const TriangleMesh& junction() {
  static const TriangleMesh mesh =
      mesh_of(find_scene("junction").make({{"edge-length", "0.05"}}, 1));
  return mesh;
}

// The data scan of the junction survey: 400 x 360 beams.
const Station& station() { return find_survey("junction").stations.at(1); }

// Embree and nothing else.
class BareEmbree {
 public:
  BareEmbree(const TriangleMesh& mesh, const Scanner& scanner, const Pose& T_world_scanner)
      : vertices_(mesh.vertices), triangles_(mesh.triangles) {
    vertices_.reserve(vertices_.size() + 1);  // Embree reads 16 bytes at the last one
    device_.reset(rtcNewDevice(nullptr));
    scene_.reset(rtcNewScene(device_.get()));
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               vertices_.data(), 0, sizeof(vertices_[0]), vertices_.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               triangles_.data(), 0, sizeof(triangles_[0]), triangles_.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) throw std::runtime_error("Embree");

    origin_ = T_world_scanner.translation().cast<float>();
    const Kinematics kinematics(scanner);
    for (int column = 0; column < scanner.planes; column += tile)
      for (int ring = 0; ring < scanner.plane_beams; ring += tile) {
        Packet packet;
        std::size_t i = 0;
        for (int c = column; c < std::min(column + tile, scanner.planes); ++c)
          for (int r = ring; r < std::min(ring + tile, scanner.plane_beams); ++r, ++i) {
            const Eigen::Vector3f d =
                (T_world_scanner.linear() * kinematics.nominal(kinematics.plane(c, 0), r).direction)
                    .cast<float>();
            packet.x[i] = d.x();
            packet.y[i] = d.y();
            packet.z[i] = d.z();
            packet.valid[i] = -1;
          }
        packets_.push_back(packet);
      }
  }

  // Casts every ray; returns how many hit something.
  std::size_t cast(float max_range) const {
    std::size_t hits = 0;
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments coherent;
    rtcInitIntersectArguments(&coherent);
    coherent.flags = RTC_RAY_QUERY_FLAG_COHERENT;
#else
    RTCIntersectContext coherent;
    rtcInitIntersectContext(&coherent);
    coherent.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
    RTCRayHit16 rays;
    for (const Packet& packet : packets_) {
      for (std::size_t i = 0; i < 16; ++i) {
        rays.ray.org_x[i] = origin_.x();
        rays.ray.org_y[i] = origin_.y();
        rays.ray.org_z[i] = origin_.z();
        rays.ray.dir_x[i] = packet.x[i];
        rays.ray.dir_y[i] = packet.y[i];
        rays.ray.dir_z[i] = packet.z[i];
        rays.ray.tnear[i] = 0;
        rays.ray.tfar[i] = max_range;
        rays.ray.time[i] = 0;
        rays.ray.mask[i] = ~0u;
        rays.ray.id[i] = 0;
        rays.ray.flags[i] = 0;
        rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      }
#if RTC_VERSION_MAJOR >= 4
      rtcIntersect16(packet.valid.data(), scene_.get(), &rays, &coherent);
#else
      rtcIntersect16(packet.valid.data(), scene_.get(), &coherent, &rays);
#endif
      for (std::size_t i = 0; i < 16; ++i)
        if (packet.valid[i] != 0 && rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) ++hits;
    }
    return hits;
  }

 private:
  struct alignas(64) Packet {
    std::array<int, 16> valid = {};
    std::array<float, 16> x = {}, y = {}, z = {};
  };
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::vector<Eigen::Vector3f> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release> device_;
  std::unique_ptr<std::remove_pointer_t<RTCScene>, Release> scene_;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  std::vector<Packet> packets_;
};

// Of this thread's processor time: on a busy machine the clock on the wall tells of its neighbours.
double seconds_of(auto&& work) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Both in turn, so that whatever else the machine does meets both. `scan_to_embree` is the median
// of the ratios of neighbouring turns: rays per second of a complete scan over those of bare
// Embree.
void junction_scan_beside_embree(benchmark::State& state, const Scanner& scanner) {
  const ThreadLimit one(1);
  const Pose& T = station().T_world_scanner;
  const RayCaster caster(junction());
  const BareEmbree embree(junction(), scanner, T);
  const double rays = static_cast<double>(scanner.plane_beams) * scanner.planes;
  std::vector<double> ratios;
  std::vector<double> scan_seconds;
  std::vector<double> embree_seconds;
  std::uint64_t seed = 0;
  for (auto _ : state) {
    embree_seconds.push_back(seconds_of(
        [&] { benchmark::DoNotOptimize(embree.cast(static_cast<float>(scanner.max_range))); }));
    scan_seconds.push_back(seconds_of(
        [&] { benchmark::DoNotOptimize(scan(caster, scanner, T, ++seed, "junction")); }));
    ratios.push_back(embree_seconds.back() / scan_seconds.back());
  }
  state.counters["triangles"] = static_cast<double>(junction().triangles.size());
  state.counters["rays"] = rays;
  state.counters["embree_rays_per_s"] = rays / median(embree_seconds);
  state.counters["scan_rays_per_s"] = rays / median(scan_seconds);
  state.counters["scan_to_embree"] = median(ratios);
}
// The optab of the junction with other settings: a sub-ray for a beam, where nothing else is said.
Scanner optab(Settings settings) {
  settings.try_emplace("sub-rays", "1");
  return with_settings(station_scanner(station()), settings);
}
BENCHMARK_CAPTURE(junction_scan_beside_embree, optab_400x360, optab({}))
    ->Iterations(41)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(junction_scan_beside_embree, optab_400x360_without_fine_relief,
                  optab({{"fine-relief", "false"}}))
    ->Iterations(41)
    ->Unit(benchmark::kMillisecond);
// Four times as dense each way: neighbouring rays share more of the tree.
BENCHMARK_CAPTURE(junction_scan_beside_embree, optab_1600x1440,
                  optab({{"plane-beams", "1600"}, {"planes", "1440"}}))
    ->Iterations(5)
    ->Unit(benchmark::kMillisecond);

// The cost of a footprint: of 19 sub-rays, cast where there may be an edge and cast always, over
// that of one; and the edges that the test misses: returns that are mixed pixels only when all 19
// are cast, of all mixed ones.
void junction_footprint(benchmark::State& state) {
  const ThreadLimit one(1);
  const Pose& T = station().T_world_scanner;
  const RayCaster caster(junction());
  const Scanner single = optab({});
  const Scanner tested = optab({{"sub-rays", "19"}});
  const Scanner always = optab({{"sub-rays", "19"}, {"edge-test", "false"}});
  std::vector<double> tested_ratios, always_ratios;
  for (auto _ : state) {
    const auto seconds = [&](const Scanner& scanner) {
      return seconds_of([&] { benchmark::DoNotOptimize(scan(caster, scanner, T, 1, "")); });
    };
    const double base = seconds(single);
    tested_ratios.push_back(seconds(tested) / base);
    always_ratios.push_back(seconds(always) / base);
  }
  const auto mixed = [&](const Scanner& scanner) {
    const Scan result = scan(caster, scanner, T, 1, "");
    return static_cast<double>(std::ranges::count_if(
        result.flags, [](std::uint8_t flags) { return (flags & flag_mixed_pixel) != 0; }));
  };
  state.counters["tested_to_one"] = median(tested_ratios);
  state.counters["always_to_one"] = median(always_ratios);
  state.counters["mixed"] = mixed(always);
  state.counters["mixed_missed"] = mixed(always) - mixed(tested);
}
BENCHMARK(junction_footprint)->Iterations(11)->Unit(benchmark::kMillisecond);

// What a second thread brings, by the clock on the wall.
void junction_two_threads(benchmark::State& state) {
  const RayCaster caster(junction());
  const Scanner scanner = station_scanner(station());
  std::vector<double> ratios;
  for (auto _ : state) {
    const auto seconds = [&](int threads) {
      const ThreadLimit limit(threads);
      const auto start = std::chrono::steady_clock::now();
      benchmark::DoNotOptimize(scan(caster, scanner, station().T_world_scanner, 1, ""));
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const double one = seconds(1);
    ratios.push_back(one / seconds(2));
  }
  state.counters["one_to_two_threads"] = median(ratios);
}
BENCHMARK(junction_two_threads)->Iterations(21)->Unit(benchmark::kMillisecond);

// The rate users see, all cores.
void junction_scan(benchmark::State& state) {
  const Scanner scanner = station_scanner(station());
  const RayCaster caster(junction());
  std::size_t rays = 0;
  for (auto _ : state)
    rays += scan(caster, scanner, station().T_world_scanner, 1, "junction").beams;
  state.counters["rays_per_s"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsRate);
}
BENCHMARK(junction_scan)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace minescan
