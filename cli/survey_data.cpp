// SPDX-License-Identifier: MIT
#include "cli/survey_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "cli/machine.h"
#include "cli/progress.h"
#include "cli/station_casters.h"
#include "core/input_file.h"
#include "core/output_file.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "registration/kdtree.h"

namespace minescan {
namespace {

namespace fs = std::filesystem;

// A source point counts as seen by the target if a target point is this near, in metres: a few
// times the distance between neighbouring beams at 20 m (assumed).
constexpr double overlap_distance = 0.5;

double overlap(const KdTree& target, const PointCloud& source, const Pose& T_target_source) {
  constexpr std::size_t grain = 4096;
  std::vector<std::size_t> near((source.points.size() + grain - 1) / grain, 0);
  parallel_for(source.points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (target.nearest(T_target_source * source.points[i], overlap_distance))
        ++near[begin / grain];
  });
  std::size_t count = 0;
  for (const std::size_t n : near) count += n;
  return static_cast<double>(count) /
         static_cast<double>(std::max<std::size_t>(1, source.points.size()));
}

DataSetPair measured_pair(const SurveyData& data, const StationPair& pair,
                          const std::vector<PointCloud>& exact) {
  const std::vector<Station>& stations = data.survey.stations;
  const Pose truth =
      stations[pair.target].T_world_scanner.inverse() * stations[pair.source].T_world_scanner;
  return {.target = pair.target,
          .source = pair.source,
          .overlap = overlap(KdTree(exact[pair.target].points), exact[pair.source], truth),
          .truth = truth,
          .guess = data.odometry[pair.target].inverse() * data.odometry[pair.source]};
}

void write_files(const fs::path& folder, const std::vector<DataSetFile>& files) {
  for (const DataSetFile& file : files) {
    fs::create_directories((folder / file.path).parent_path());
    write_file(folder / file.path, file.bytes);
  }
}

bool is_survey_folder(const fs::path& folder) { return fs::exists(folder / "survey.yaml"); }

// Pairs of a folder. What decides the points is what the files hold.
std::vector<ScanPair> read_pairs(const fs::path& folder) {
  const fs::path table = folder / "pairs.csv";
  const std::vector<DataSetPair> listed = parse_pairs(read_file(table), table.string());
  std::vector<ScanPair> pairs;
  for (std::size_t k = 0; k < listed.size(); ++k) {
    const fs::path target = folder / scan_file(listed[k].target);
    const fs::path source = folder / scan_file(listed[k].source);
    const std::string name = fs::absolute(folder).lexically_normal().filename().string();
    pairs.push_back(
        {.name = fmt::format("{}/{}", name, k),
         .origin = fmt::format("{} {} {}", text_hash(read_file(target)),
                               text_hash(read_file(source)), pose_text(listed[k].truth)),
         .target = read_cloud(target).cloud,
         .source = read_cloud(source).cloud,
         .T_target_source = listed[k].truth});
  }
  return pairs;
}

}  // namespace

SurveyData make_survey(const SurveyConfig& config, bool quiet, bool keep_clouds,
                       const std::function<void(std::size_t, const Scan&)>& on_scan) {
  check(config.survey);
  StationCasters casters(config, quiet);
  SurveyData data;
  data.survey = casters.stations();
  const Survey& survey = data.survey;
  const std::size_t scans = survey.stations.size();
  std::vector<std::size_t> last_use(scans, 0);
  for (const StationPair& pair : survey.pairs)
    for (const std::size_t k : {pair.target, pair.source})
      last_use[k] = std::max(last_use[k], std::max(pair.target, pair.source));

  data.odometry = believed_poses(survey, config.seed);
  data.clouds.resize(scans);
  std::vector<PointCloud> exact(scans);  // where points really were, as long as pairs need them
  std::vector<DataSetPair> pairs(survey.pairs.size());
  Progress progress("scanning", scans, quiet);
  const auto take = [&](std::size_t k, const Scan& scan) {
    if (scan.cloud.points.empty())
      throw std::runtime_error(
          fmt::format("station {}: no beam of {} came back", k, survey.stations[k].scanner));
    if (on_scan) on_scan(k, scan);
    data.points.push_back(scan.cloud.points.size());
    data.beams.push_back(scan.beams);
    if (keep_clouds) data.clouds[k] = scan.cloud;
    if (last_use[k] > 0)
      for (const Eigen::Vector3f& p : scan.true_point) exact[k].points.push_back(p.cast<double>());
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (std::max(survey.pairs[i].target, survey.pairs[i].source) == k)
        pairs[i] = measured_pair(data, survey.pairs[i], exact);
    for (std::size_t other = 0; other <= k; ++other)
      if (last_use[other] <= k) exact[other] = {};
    progress.update(k + 1);
  };
  run_survey(
      survey, [&](std::size_t k) { return casters.at(k); }, config.seed, take);
  data.pairs = pairs;
  data.scene_json = casters.scene_json();
  return data;
}

SurveyData write_survey(const fs::path& folder, const SurveyConfig& config, bool quiet,
                        bool keep_clouds, bool replace, const std::vector<DataSetFormat>& formats) {
  if (replace && fs::exists(folder) && !is_survey_folder(folder) && !fs::is_empty(folder))
    throw std::runtime_error(folder.string() +
                             ": is not the folder of a survey; it stays as it is");
  OutputFolder output(folder, replace);
  const fs::path& path = output.temporary_path();
  fs::create_directory(path / "scans");
  const SurveyData data =
      make_survey(config, quiet, keep_clouds, [&](std::size_t k, const Scan& scan) {
        write_file(path / scan_file(k), print_scan(scan));
        for (const DataSetFormat& format : formats) write_files(path, format.scan_files(k, scan));
      });
  std::vector<double> times;
  std::vector<Pose> truth;
  for (std::size_t k = 0; k < data.points.size(); ++k) {
    times.push_back(data.survey.stations[k].time);
    truth.push_back(data.survey.stations[k].T_world_scanner);
  }
  write_file(path / "truth.tum", print_tum(times, truth));
  write_file(path / "odometry.tum", print_tum(times, data.odometry));
  const Trajectory& trajectory = data.survey.trajectory;
  if (!trajectory.times.empty())
    write_file(path / "trajectory.tum", print_tum(trajectory.times, trajectory.poses));
  write_file(path / "pairs.csv", print_pairs(data.pairs));
  for (const DataSetFormat& format : formats)
    write_files(path, format.summary_files({.name = config.survey.name,
                                            .times = times,
                                            .truth = truth,
                                            .odometry = data.odometry,
                                            .pairs = data.pairs}));
  write_file(path / "scene.json", data.scene_json);
  write_file(path / "survey.yaml", fmt::format("# minescan {}, {}\n{}", version(), machine_text(),
                                               survey_config_yaml(config)));
  output.commit();
  return data;
}

std::vector<ScanPair> scan_pairs(const SurveyConfig& config, const SurveyData& data) {
  std::vector<ScanPair> pairs;
  for (std::size_t k = 0; k < data.pairs.size(); ++k) {
    const DataSetPair& pair = data.pairs[k];
    pairs.push_back({.name = data.pairs.size() == 1 ? config.survey.name
                                                    : fmt::format("{}/{}", config.survey.name, k),
                     .origin = fmt::format("{} pair {}", survey_identity(config), k),
                     .target = data.clouds.at(pair.target),
                     .source = data.clouds.at(pair.source),
                     .T_target_source = pair.truth});
  }
  return pairs;
}

std::vector<ScanPair> load_pairs(const std::string& text, const Config& changes, std::uint64_t seed,
                                 bool quiet) {
  if (fs::is_directory(text)) {
    if (!changes.empty())
      throw std::invalid_argument(fmt::format("{}: {}: the scans of a folder cannot be changed",
                                              changes.front().where, changes.front().key));
    return read_pairs(text);
  }
  const SurveyConfig config = load_survey_config(text, changes, seed);
  return scan_pairs(config, make_survey(config, quiet, true));
}

}  // namespace minescan
