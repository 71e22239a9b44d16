// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "core/fields.h"
#include "core/text.h"
#include "eval/metrics.h"
#include "eval/study.h"
#include "formats/cloud_file.h"
#include "formats/data_set_formats.h"
#include "registration/methods.h"
#include "scenes/scene.h"
#include "sim/scanner.h"
#include "sim/survey.h"

namespace minescan {
namespace {

struct Item {
  std::string name;
  std::string description;
  std::vector<Field> fields = {};
};

struct Listing {
  std::string name;
  std::vector<Item> (*items)();
};

template <class Row>
Item item(const Row& row) {
  return {row.name, row.description};
}

// Keys that add a part to a scene, for any NAME that the user chooses.
const Settings named_parts = {{"drifts.NAME.line", ""}, {"pillars.NAME.at", ""},
                              {"things.NAME.kind", ""}, {"parts.NAME.file", ""},
                              {"groups.NAME", ""},      {"materials.NAME.reflectance", ""}};

// One row per thing that `minescan list` can show.
const Listing listings[] = {
    {"scenes",
     [] {
       std::vector<Item> items;
       for (const SceneKind& row : scenes())
         items.push_back({row.name, row.description, row.fields(named_parts)});
       return items;
     }},
    {"scanners",
     [] {
       std::vector<Item> items;
       for (const Scanner& row : scanners())
         items.push_back({row.name, row.description, fields_of(row)});
       return items;
     }},
    {"surveys",
     [] {
       std::vector<Item> items;
       for (const Survey& row : surveys()) items.push_back(item(row));
       return items;
     }},
    {"methods",
     [] {
       std::vector<Item> items;
       for (const Method& row : methods()) items.push_back({row.name, row.description, row.fields});
       return items;
     }},
    {"metrics",
     [] {
       std::vector<Item> items;
       for (const Metric& row : metrics()) items.push_back(item(row));
       return items;
     }},
    {"studies",
     [] {
       std::vector<Item> items;
       for (const Study& row : studies()) items.push_back(item(row));
       return items;
     }},
    {"formats",
     [] {
       std::vector<Item> items;
       for (const CloudFormat& row : cloud_formats())
         items.push_back({row.extension, row.description});
       for (const DataSetFormat& row : data_set_formats())
         items.push_back({row.name, "survey --format: " + row.description});
       return items;
     }},
};

nlohmann::ordered_json json_of(const Item& item) {
  nlohmann::ordered_json json = {{"name", item.name}, {"description", item.description}};
  for (const Field& field : item.fields)
    json["options"].push_back({{"name", field.name},
                               {"unit", field.unit},
                               {"expected", field.expected},
                               {"default", field.value},
                               {"help", field.help}});
  return json;
}

int run_list(const std::string& what, bool as_json) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  std::vector<std::string> known;
  bool found = false;
  for (const Listing& listing : listings) {
    known.push_back(listing.name);
    if (!what.empty() && what != listing.name) continue;
    found = true;
    if (as_json)
      json[listing.name] = nlohmann::ordered_json::array();
    else
      fmt::print("{}\n", listing.name);
    for (const Item& item : listing.items()) {
      if (as_json) {
        json[listing.name].push_back(json_of(item));
        continue;
      }
      fmt::print("  {:<16} {}\n", item.name, item.description);
      // The options only where one kind of thing was asked for: together they fill pages.
      if (!what.empty() && !item.fields.empty()) fmt::print("{}", fields_help(item.fields));
    }
  }
  if (!found) throw std::invalid_argument(unknown_name("listing", what, known));
  if (as_json) fmt::print("{}\n", json.dump(2));
  return exit_done;
}

}  // namespace

Command list_command() {
  struct State {
    std::string what;
    bool json = false;
  };
  const auto state = std::make_shared<State>();
  return {
      .name = "list",
      .summary = "show what can be chosen by name, with every option",
      .examples = "  minescan list\n  minescan list methods\n  minescan list scenes --json\n",
      .arguments = {{"WHAT", "", "scenes, scanners, surveys, methods, metrics, studies or formats",
                     false, &state->what},
                    {"--json", "", "as JSON", false, &state->json}},
      .run = [state](const Common&) { return run_list(state->what, state->json); }};
}

}  // namespace minescan
