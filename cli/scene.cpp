// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <memory>

#include "cli/command.h"
#include "cli/scene_config.h"
#include "scenes/half_edge.h"

namespace minescan {

Command scene_command() {
  struct State {
    std::string scene, out;
    bool print_config = false;
  };
  const auto state = std::make_shared<State>();
  return {
      .name = "scene",
      .summary = "build a mine and write its mesh",
      .examples =
          "  minescan scene junction --out junction.ply\n"
          "  minescan scene tunnel --set edge-length=0.1 --seed 7 --out tunnel.obj\n"
          "  minescan scene junction --print-config > mine.yaml\n"
          "  minescan scene mine.yaml --out mine.stl\n"
          "Settings: minescan list scenes\n",
      .arguments = {{"SCENE", "NAME|FILE.yaml", "see minescan list scenes", true, &state->scene},
                    {"--out", "FILE", ".ply, .obj or .stl", false, &state->out},
                    {"--print-config", "", "write the resolved YAML instead", false,
                     &state->print_config}},
      .run = [state](const Common& common) -> int {
        const SceneConfig config =
            load_scene_config(state->scene, set_entries(common), common.seed);
        if (state->print_config) {
          fmt::print("{}", scene_config_yaml(config));
          return exit_done;
        }
        if (state->out.empty()) throw std::invalid_argument("scene: --out is required");
        const Scene scene = find_scene(config.name).make(config.settings, config.seed);
        write_mesh(scene.mesh, state->out);
        fmt::print("{}: {} vertices, {} triangles\n", state->out, scene.mesh.vertices.size(),
                   scene.mesh.triangles.size());
        return exit_done;
      }};
}

}  // namespace minescan
