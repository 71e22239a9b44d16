// SPDX-License-Identifier: MIT
// The table of scenes.
#include <map>
#include <string>

#include "core/table.h"
#include "scenes/exact.h"
#include "scenes/foreign.h"
#include "scenes/mine.h"
#include "scenes/room_and_pillar.h"
#include "scenes/scene.h"

namespace minescan {
namespace {

/// A mine as its own data, with the size of its triangles.
struct MineOptions {
  MeshOptions mesh = {};
  Mine mine = {};
};
template <class Visitor>
void fields(MineOptions& o, Visitor&& field) {
  fields(o.mesh, field);
  fields(o.mine, field);
}

struct GeneratedOptions {
  MeshOptions mesh = {.edge_length = 0.1};
  RoomAndPillarOptions mine = {};
};
template <class Visitor>
void fields(GeneratedOptions& o, Visitor&& field) {
  fields(o.mesh, field);
  fields(o.mine, field);
}

/// A scene whose options do not depend on what is given.
template <class Options>
SceneKind row(const std::string& name, const std::string& description,
              Scene (*make)(const Options&, std::uint64_t)) {
  return {.name = name,
          .description = description,
          .fields = [](const Settings&) { return fields_of(Options{}); },
          .make =
              [make](const Settings& settings, std::uint64_t seed) {
                return make(with_settings(Options{}, settings), seed);
              }};
}

/// A mine to which drifts, pillars and things may be added.
SceneKind mine_row(const std::string& name, const std::string& description, const Mine& mine) {
  const auto options = [mine](const Settings& given) {
    return MineOptions{.mine = with_names(mine, given)};
  };
  return {.name = name,
          .description = description,
          .fields = [options](const Settings& given) { return fields_of(options(given)); },
          .make =
              [options, name](const Settings& settings, std::uint64_t seed) {
                const MineOptions o = with_settings(options(settings), settings);
                return scene_of(name, o.mine, o.mesh, seed);
              }};
}

SceneKind foreign_row(const std::string& name, const std::string& description) {
  return {
      .name = name,
      .description = description,
      .fields =
          [](const Settings& given) { return fields_of(with_names(ForeignOptions{}, given)); },
      .make =
          [](const Settings& settings, std::uint64_t) {
            return make_foreign(with_settings(with_names(ForeignOptions{}, settings), settings));
          }};
}

// The end of a tunnel with a side passage, as in the paper's junction scan. Sizes are assumed such
// that a scan spans about 10 x 30 m (paper, section 5.1) under a roof 6 m high. A scanner stands at
// about (0, 0, 2).
Mine junction() {
  Mine mine;
  mine.drifts["main"] = {.line = {{-18, 0, 0}, {12, 0, 0}}, .end = End::concrete};
  mine.drifts["passage"] = {.line = {{5, 0, 0}, {5, 17, 0}}, .width = 8};
  mine.things["lights"] = {
      .kind = "light", .drift = "main", .from = 4.5, .to = 22.5, .every = 6, .offset = 1};
  return mine;
}

// A plain tunnel, as in the paper's tunnel scans: only bumps and light fixtures hold two scans in
// place along it. Sizes assumed; its ends are out of reach of scanners at (-2, 0, 2) and (2, 0, 2).
Mine tunnel() {
  Mine mine;
  mine.drifts["main"] = {.line = {{-40, 0, 0}, {44, 0, 0}}};
  mine.things["lights"] = {
      .kind = "light", .drift = "main", .from = 3.5, .to = 78.5, .every = 7.5, .offset = 1};
  return mine;
}

// Two tunnels and their links, about 330 m round in a map of about 55 x 155 m (paper, section 5.1);
// the north tunnel was driven from both ends, and the crews met with a lateral offset (its figure
// 11). How the length is shared out, the links in the middle and the side passages are assumed.
Mine kvarntorp_loop() {
  Mine mine;
  mine.drifts["south"] = {.line = {{-5, 0, 0}, {148, 0, 0}}};
  mine.drifts["north-west"] = {.line = {{-5, 21, 0}, {40, 21.5, 0}, {76, 21, 0}}};
  mine.drifts["north-east"] = {.line = {{68, 24, 0}, {110, 23.5, 0}, {148, 24, 0}}};
  mine.drifts["link-west"] = {.line = {{0, -5, 0}, {0, 26, 0}}};
  mine.drifts["link-east"] = {.line = {{143, -5, 0}, {143, 29, 0}}, .end = End::concrete};
  mine.drifts["link-1"] = {.line = {{48, 0, 0}, {48, 22, 0}}, .width = 8};
  mine.drifts["link-2"] = {.line = {{96, 0, 0}, {96, 22, 0}}, .width = 8};
  mine.drifts["passage-south-1"] = {
      .off = "south", .at = 35, .side = Side::right, .length = 10, .width = 8};
  mine.drifts["passage-south-2"] = {
      .off = "south", .at = 110, .side = Side::right, .length = 10, .width = 8};
  mine.drifts["passage-north-1"] = {
      .off = "north-west", .at = 30, .side = Side::left, .length = 11, .width = 8};
  mine.drifts["passage-north-2"] = {
      .off = "north-east", .at = 60, .side = Side::left, .length = 10, .width = 8};
  mine.drifts["niche"] = {
      .off = "south", .at = 72, .side = Side::right, .length = 3, .width = 4, .height = 3};
  // Things of two runs must not meet: the north tunnels overlap from 68 to 76 m.
  const std::map<std::string, double> lit_to = {
      {"south", 0}, {"north-west", 70}, {"north-east", 0}};
  for (const auto& [drift, to] : lit_to) {
    mine.things["lights-" + drift] = {
        .kind = "light", .drift = drift, .from = 6, .to = to, .every = 10};
    mine.things["bolts-" + drift] = {
        .kind = "bolts", .drift = drift, .from = 4, .to = to, .every = 3};
  }
  mine.things["pipe"] = {.kind = "pipe", .drift = "south", .from = 12, .side = Side::left};
  mine.things["cable"] = {.kind = "cable", .drift = "south", .from = 12, .side = Side::right};
  mine.things["duct"] = {.kind = "duct", .drift = "north-east", .from = 12, .offset = 1.5};
  mine.things["sign"] = {.kind = "sign", .drift = "south", .from = 20, .to = 20};
  mine.things["loader"] = {
      .kind = "vehicle", .drift = "passage-south-2", .from = 6, .to = 6, .offset = 0};
  return mine;
}

Scene make_room_and_pillar(const GeneratedOptions& o, std::uint64_t seed) {
  return scene_of("room-and-pillar", room_and_pillar(o.mine, seed), o.mesh, seed);
}

}  // namespace

const std::vector<SceneKind>& scenes() {
  static const std::vector<SceneKind> list = {
      mine_row("junction", "end of a tunnel: concrete face, side passage", junction()),
      mine_row("tunnel", "plain tunnel: bumps and light fixtures only", tunnel()),
      mine_row("kvarntorp-loop", "two tunnels and their links, 330 m round", kvarntorp_loop()),
      row("room-and-pillar", "a grid of drifts, of any size, generated", make_room_and_pillar),
      mine_row("mine", "a mine of your own: drifts, pillars and things by name", Mine{}),
      foreign_row("mesh", "triangles from .ply, .obj and .stl files"),
      row("box", "empty box with flat faces: exact", make_box),
      row("cylinder", "round tunnel with flat ends: exact", make_cylinder),
      row("corridor", "two straight legs with flat faces: exact", make_corridor),
      row("incised-planes", "flat floor with two crossed grooves: exact", make_incised_planes),
  };
  return list;
}

const SceneKind& find_scene(const std::string& name) { return find_row(scenes(), "scene", name); }

}  // namespace minescan
