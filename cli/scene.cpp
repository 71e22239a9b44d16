// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <numbers>
#include <utility>

#include "cli/command.h"
#include "cli/scene_config.h"
#include "cli/station_casters.h"
#include "core/output_file.h"
#include "core/text.h"
#include "formats/png.h"
#include "scenes/half_edge.h"
#include "scenes/scene_mesh.h"
#include "sim/picture.h"

namespace minescan {
namespace {

const char* const usual_width = "1200";                // pixels
const Range picture_widths = between(100, 8000);       // pixels
constexpr double view_field = std::numbers::pi / 2.2;  // rad, about that of a wide-angle lens

struct State {
  std::string scene, out, picture, json, decimate, width = usual_width;
  bool print_config = false, check = false;
};

// The number that an option gives; errors name the option.
double number_of(const char* option, const std::string& text, const Range& range, bool whole) {
  double number = 0;
  read_named(option, text, [&] { number = read_number(text, range, whole); });
  return number;
}

// Asked before the work begins.
void check_names(const State& state) {
  if (state.out.empty() && state.picture.empty() && state.json.empty())
    throw std::invalid_argument("scene: expected --out, --picture or --json");
  if (!state.out.empty()) check_mesh_name(state.out);
  if (!state.picture.empty() && std::filesystem::path(state.picture).extension() != ".png")
    throw std::invalid_argument(state.picture + ": expected a name ending in .png");
  for (const std::string& file : {state.out, state.picture, state.json}) {
    const std::filesystem::path folder = std::filesystem::path(file).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder))
      throw std::runtime_error(file + ": cannot be written: there is no folder " + folder.string());
  }
}

int run(const State& state, const Common& common) {
  const SceneConfig config = load_scene_config(state.scene, set_entries(common), common.seed);
  if (state.print_config) {
    fmt::print("{}", scene_config_yaml(config));
    return exit_done;
  }
  check_names(state);
  const double decimate_to =
      state.decimate.empty() ? 1 : number_of("--decimate", state.decimate, ratio, false);
  const int width = static_cast<int>(number_of("--width", state.width, picture_widths, true));
  const Scene scene = find_scene(config.name).make(config.settings, config.seed);
  TriangleMesh mesh = mesh_of(scene);
  if (decimate_to < 1) mesh = decimated(mesh, decimate_to);

  if (!state.out.empty()) {
    write_mesh(mesh, state.out);
    fmt::print("{}: {} vertices, {} triangles\n", state.out, mesh.vertices.size(),
               mesh.triangles.size());
  }
  if (!state.json.empty()) {
    // What decimation leaves is not closed by construction.
    const std::string json = mesh_json(scene, mesh, state.check || decimate_to < 1);
    if (state.json == "-")
      fmt::print("{}", json);
    else
      write_file(state.json, json);
  }
  if (!state.picture.empty()) {
    const RayCaster caster(std::move(mesh));
    const Picture picture =
        stacked(plan_picture(caster, width),
                inside_picture(caster, scene.T_world_view, view_field, width, width / 2));
    write_file(state.picture, print_png(picture.width, picture.height, picture.rgb));
    fmt::print("{}: {} x {} pixels\n", state.picture, picture.width, picture.height);
  }
  return exit_done;
}

}  // namespace

Command scene_command() {
  const auto state = std::make_shared<State>();
  return {
      .name = "scene",
      .summary = "build a mine; write its mesh, pictures of it, or what the mesh is like",
      .examples =
          "  minescan scene junction --out junction.ply\n"
          "  minescan scene kvarntorp-loop --picture loop.png\n"
          "  minescan scene tunnel --set edge-length=0.1 --seed 7 --decimate 0.2 --out tunnel.obj\n"
          "  minescan scene room-and-pillar --set rows=3 --set gaps=0.4 --picture rooms.png\n"
          "  minescan scene junction --print-config > mine.yaml\n"
          "  minescan scene mine.yaml --out mine.stl\n"
          "  minescan scene scanned.obj --json -            is it closed? where is it not?\n"
          "A mine of your own (or: --set drifts.NAME.line=...; then --picture shows it):\n"
          "  scene: mine\n"
          "  drifts:\n"
          "    main:  {line: [0 0, 40 0, 60 8 -0.5], width: 8, height: 5, arch: 1, end: concrete}\n"
          "    niche: {off: main, at: 20, side: left, length: 3, width: 4, height: 3}\n"
          "  things:\n"
          "    lights: {kind: light, drift: main, from: 5, every: 10}\n"
          "Settings: minescan list scenes\n",
      .arguments =
          {{"SCENE", "NAME|FILE.yaml|MESH", "see minescan list scenes; or .ply, .obj, .stl", true,
            &state->scene},
           {"--out", "FILE", "the mesh: .ply, .obj or .stl", false, &state->out},
           {"--picture", "FILE.png", "its plan, and a view inside", false, &state->picture},
           {"--width", "PIXELS", "of the picture; 1200", false, &state->width},
           {"--json", "FILE|-", "counts, whether it is closed, warnings", false, &state->json},
           {"--check", "", "with --json: check the mesh of any scene, not only of a file", false,
            &state->check},
           {"--decimate", "RATIO", "keep this part of the triangles, where they matter most", false,
            &state->decimate},
           {"--print-config", "", "write the resolved YAML instead", false, &state->print_config}},
      .run = [state](const Common& common) { return run(*state, common); }};
}

}  // namespace minescan
