// SPDX-License-Identifier: MIT
#include "core/table.h"
#include "scenes/box.h"
#include "scenes/junction.h"
#include "scenes/scene.h"
#include "scenes/tunnel.h"

namespace minescan {
namespace {

template <class Options>
SceneKind row(const std::string& name, const std::string& description,
              Scene (*make)(const Options&, std::uint64_t)) {
  return {.name = name,
          .description = description,
          .fields = fields_of(Options{}),
          .make = [make](const Settings& settings, std::uint64_t seed) {
            return make(with_settings(Options{}, settings), seed);
          }};
}

}  // namespace

const std::vector<SceneKind>& scenes() {
  static const std::vector<SceneKind> list = {
      row("junction", "end of a tunnel: concrete face, side passage", make_junction),
      row("tunnel", "plain tunnel: bumps and light fixtures only", make_tunnel),
      row("box", "empty box with flat faces, for tests", make_box),
  };
  return list;
}

const SceneKind& find_scene(const std::string& name) { return find_row(scenes(), "scene", name); }

}  // namespace minescan
