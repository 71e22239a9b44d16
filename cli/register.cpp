// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/command.h"
#include "cli/scene_config.h"
#include "core/output_file.h"
#include "core/text.h"
#include "eval/external_method.h"
#include "formats/cloud_file.h"
#include "formats/data_set.h"
#include "registration/methods.h"
#include "registration/registered.h"

namespace minescan {
namespace {

struct State {
  std::string target, source, guess, truth, json, out, axis;
  std::string method = "ndt";
  bool print_config = false;
};

// A file or seven numbers; the identity if nothing is given.
Pose pose_argument(const std::string& text) {
  if (text.empty()) return Pose::Identity();
  return std::filesystem::exists(text) ? read_pose(text) : parse_pose(text);
}

// The direction of a tunnel in the target's frame.
Eigen::Vector3d axis_argument(const std::string& text) {
  const std::vector<std::string> parts = split(text, ',');
  if (parts.size() != 3)
    throw std::invalid_argument("--axis: expected x,y,z, found '" + text + "'");
  Eigen::Vector3d axis;
  for (int i = 0; i < 3; ++i)
    axis[i] = read_number(parts[static_cast<std::size_t>(i)], any_number, false);
  if (!(axis.head<2>().norm() > 0))
    throw std::invalid_argument("--axis: expected a direction that is not vertical, found '" +
                                text + "'");
  return axis;
}

template <class Matrix>
nlohmann::ordered_json matrix_json(const Matrix& matrix) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    rows.push_back(nlohmann::ordered_json::array());
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      rows.back().push_back(matrix(row, column));
  }
  return rows;
}

std::string result_json(const std::string& method, const RegistrationResult& result,
                        const std::optional<PoseError>& error,
                        const std::optional<Eigen::Vector3d>& axis) {
  nlohmann::ordered_json json = {{"method", method},
                                 {"status", value_text(result.status)},
                                 {"T_target_source", matrix_json(result.T_target_source.matrix())},
                                 {"iterations", result.iterations},
                                 {"evaluations", result.evaluations},
                                 {"score", result.score},
                                 {"target_points", result.target_points},
                                 {"source_points", result.source_points},
                                 {"used_points", result.used_points},
                                 {"empty_points", result.empty_points},
                                 {"outside_points", result.outside_points},
                                 {"time_s",
                                  {{"target", result.time.target},
                                   {"source", result.time.source},
                                   {"align", result.time.align}}},
                                 {"cpu_s", result.cpu},
                                 {"target_bytes", result.target_bytes},
                                 {"covariance", matrix_json(result.covariance)}};
  json["directions"] = nlohmann::ordered_json::array();
  for (const Direction& direction : result.directions) {
    nlohmann::ordered_json item = {
        {"hold", direction.hold},
        {"step", std::vector<double>(direction.step.data(), direction.step.data() + 6)}};
    if (axis) item["name"] = direction_name(direction, *axis);
    json["directions"].push_back(std::move(item));
  }
  if (error) {
    json["translation_error_m"] = error->translation;
    json["rotation_error_rad"] = error->rotation;
  }
  return json.dump(2) + "\n";
}

std::string result_text(const std::string& method, const RegistrationResult& result,
                        const std::optional<PoseError>& error,
                        const std::optional<Eigen::Vector3d>& axis) {
  std::string text = fmt::format(
      "{}: {} after {} iterations, {} of {} source points, {:.3f} s\nT_target_source {}\n", method,
      value_text(result.status), result.iterations, result.used_points, result.source_points,
      result.time.target + result.time.source + result.time.align,
      pose_text(result.T_target_source));
  if (error)
    text += fmt::format("error against the truth: {:.4f} m, {:.5f} rad\n", error->translation,
                        error->rotation);
  if (!result.directions.empty()) {
    const Direction& weakest = result.directions.front();
    text += fmt::format("held least: {}{:.2g} of the direction held best\n",
                        axis ? direction_name(weakest, *axis) + ", " : "", weakest.hold);
  }
  return text;
}

CloudFile load(const std::string& path) {
  CloudFile file = read_cloud(path);
  if (file.dropped > 0)
    fmt::print(stderr, "minescan: {}: {} points without three finite coordinates left out\n", path,
               file.dropped);
  return file;
}

int run(const State& state, const Common& common) {
  ExternalMethod external;
  if (is_external_method(state.method)) external = external_method(state.method);
  const Method& method =
      is_external_method(state.method) ? external.method : find_method(state.method);
  Config config = set_entries(common);
  for (const auto& [key, text] : external.settings)
    config.insert(config.begin(), {key, text, state.method});
  // --seed names the random choices of a method that makes any.
  if (common.seed && find_field(method.fields, "sample-seed"))
    config.insert(config.begin(), {"sample-seed", std::to_string(*common.seed), "--seed"});
  const Settings settings = resolve(config, method.fields);
  if (state.print_config) {
    fmt::print("{}", config_yaml(method.fields, settings));
    return exit_done;
  }
  if (state.target.empty() || state.source.empty())
    throw std::invalid_argument("register: expected TARGET and SOURCE");
  const Pose T_guess = pose_argument(state.guess);
  std::optional<Pose> truth;
  if (!state.truth.empty()) truth = pose_argument(state.truth);
  std::optional<Eigen::Vector3d> axis;
  if (!state.axis.empty()) axis = axis_argument(state.axis);
  if (!state.out.empty()) find_cloud_format(state.out);

  const CloudFile target = load(state.target);
  const CloudFile source = load(state.source);
  const RegistrationResult result = method.run(target.cloud, source.cloud, T_guess, settings);
  std::optional<PoseError> error;
  if (truth) error = pose_error(*truth, result.T_target_source);

  if (!state.out.empty()) {
    PointCloud aligned;
    for (const Eigen::Vector3d& point : source.cloud.points)
      aligned.points.push_back(result.T_target_source * point);
    write_cloud(state.out, aligned);
  }
  if (state.json == "-") {
    fmt::print("{}", result_json(method.name, result, error, axis));
    return exit_done;
  }
  if (!state.json.empty()) write_file(state.json, result_json(method.name, result, error, axis));
  fmt::print("{}", result_text(method.name, result, error, axis));
  return exit_done;
}

}  // namespace

Command register_command() {
  const auto state = std::make_shared<State>();
  std::string extensions;
  for (const CloudFormat& format : cloud_formats()) extensions += " " + format.extension;
  return {
      .name = "register",
      .summary = "find the pose of one scan in another",
      .examples =
          "  minescan register data/scans/0000.ply data/scans/0001.ply --method icp\n"
          "  minescan register a.pcd b.pcd --guess 1.8,0.7,0,0,0,0.34,0.94 --json -\n"
          "  minescan register a.ply b.ply --guess guess.txt --truth truth.txt --out moved.ply\n"
          "  minescan register a.ply b.ply --method my_icp.yaml\n"
          "  minescan register a.ply b.ply --set cell-size=2 --set sample-ratio=0.5\n"
          "Settings: minescan list methods\n",
      .arguments =
          {{"TARGET", "FILE", "the scan that stays:" + extensions, false, &state->target},
           {"SOURCE", "FILE", "the scan that is moved", false, &state->source},
           {"--method", "NAME", "see minescan list methods, or a program's FILE.yaml; default ndt",
            false, &state->method},
           {"--guess", "POSE",
            "start pose, source to target: a file with a 4 x 4 matrix, or tx,ty,tz,qx,qy,qz,qw; "
            "default the identity",
            false, &state->guess},
           {"--truth", "POSE", "the exact pose: its distance from the result is told", false,
            &state->truth},
           {"--json", "FILE", "write the result as JSON; - for standard output", false,
            &state->json},
           {"--axis", "X,Y,Z",
            "direction of the tunnel in the target's frame: names what is held least", false,
            &state->axis},
           {"--out", "FILE", "write the source moved into the target's frame", false, &state->out},
           {"--print-config", "", "write the method's resolved options instead", false,
            &state->print_config}},
      .run = [state](const Common& common) { return run(*state, common); }};
}

}  // namespace minescan
