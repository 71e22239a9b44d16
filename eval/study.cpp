// SPDX-License-Identifier: MIT
#include "eval/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "core/table.h"
#include "core/text.h"

namespace minescan {
namespace {

const std::string translation_axis = "initial-translation";
const std::string rotation_axis = "initial-rotation";

std::vector<const Method*> methods_of(const Study& study, const std::vector<Method>& methods) {
  std::vector<const Method*> found;
  std::set<std::string> seen;
  if (study.methods == std::vector<std::string>{"all"}) {
    for (const Method& method : methods) found.push_back(&method);
    return found;
  }
  for (const std::string& name : study.methods) {
    const Method& method = find_row(methods, "method", name);
    if (!seen.insert(name).second)
      throw std::invalid_argument(fmt::format("method '{}' is there twice", name));
    found.push_back(&method);
  }
  if (found.empty()) throw std::invalid_argument("a study needs at least one method");
  return found;
}

// The field of the study that an axis may vary, or null.
const Field* start_field(const std::string& name) {
  static const std::vector<Field> own = fields_of(Study{});
  return name == translation_axis || name == rotation_axis ? find_field(own, name) : nullptr;
}

// What an axis may be called: the start errors, and the number options that all methods have.
std::vector<std::string> axis_names(const std::vector<const Method*>& methods) {
  std::vector<std::string> names = {translation_axis, rotation_axis};
  for (const Field& field : methods.front()->fields)
    if (field.number && std::all_of(methods.begin(), methods.end(), [&](const Method* m) {
          return find_field(m->fields, field.name) != nullptr;
        }))
      names.push_back(field.name);
  return names;
}

std::string canonical(const Field& field, const std::string& text) {
  try {
    return field.canonical(text);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(
        fmt::format("{}: {}{}", field.name, error.what(),
                    field.unit.empty() ? "" : fmt::format(" (unit: {})", field.unit)));
  }
}

void check_axis(const Axis& axis, const std::vector<const Method*>& methods) {
  const std::vector<std::string> known = axis_names(methods);
  if (std::find(known.begin(), known.end(), axis.name) == known.end())
    throw std::invalid_argument(unknown_name("axis", axis.name, known));
  if (axis.values.empty())
    throw std::invalid_argument(fmt::format("axis '{}' has no values", axis.name));
  std::set<double> seen;
  for (const double value : axis.values) {
    if (!seen.insert(value).second)
      throw std::invalid_argument(
          fmt::format("axis '{}' has the value {} twice", axis.name, number_text(value)));
    if (const Field* own = start_field(axis.name))
      canonical(*own, number_text(value));
    else
      for (const Method* method : methods)
        canonical(*find_field(method->fields, axis.name), number_text(value));
  }
}

// Puts one setting of the study into those of a method if it is meant for it: true if it was.
bool apply(const std::string& name, const std::string& text, const Method& method,
           Settings& settings) {
  const bool named = name.starts_with(method.name + ".");
  const Field* field =
      find_field(method.fields, named ? name.substr(method.name.size() + 1) : name);
  if (!field) return false;
  const std::string value = canonical(*field, text);
  if (value == field->value)
    settings.erase(field->name);
  else
    settings[field->name] = value;
  return true;
}

// What a method is run with at every point: general settings first, those for it alone over them.
Settings settings_for(const Study& study, const Method& method) {
  Settings settings;
  for (const bool named : {false, true})
    for (const auto& [name, text] : study.settings)
      if (name.starts_with(method.name + ".") == named) apply(name, text, method, settings);
  return settings;
}

void check_setting(const std::string& name, const std::string& text,
                   const std::vector<const Method*>& methods) {
  bool known = false;
  std::set<std::string> names;
  for (const Method* method : methods) {
    Settings ignored;
    known = apply(name, text, *method, ignored) || known;
    for (const Field& field : method->fields) names.insert(field.name);
  }
  if (!known)
    throw std::invalid_argument(unknown_name("option", name, {names.begin(), names.end()}));
}

// The next combination of axis values, the last axis fastest; false after the last one.
bool advance(std::vector<std::size_t>& at, const std::vector<Axis>& axes) {
  for (std::size_t i = axes.size(); i-- > 0;) {
    if (++at[i] < axes[i].values.size()) return true;
    at[i] = 0;
  }
  return false;
}

void set_axis(Trial& trial, const std::string& name, double value, const Method& method) {
  trial.axes[name] = value;
  if (name == translation_axis)
    trial.initial_translation = value;
  else if (name == rotation_axis)
    trial.initial_rotation = value;
  else
    apply(name, number_text(value), method, trial.settings);
}

}  // namespace

const std::vector<Study>& studies() {
  // The levels of the figures can be read from the paper's plots only roughly: assumed.
  static const std::vector<Study> table = {
      {.name = "fig16",
       .description = "error of the start position on JUNCTION (figure 16 of the paper)",
       .axes = {{translation_axis, {0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4}}},
       .initial_rotation = 0},
      {.name = "fig17",
       .description = "error of the start orientation on JUNCTION (figure 17 of the paper)",
       .axes = {{rotation_axis, {0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6}}},
       .initial_translation = 0},
      // 30 trials: by `minescan check --self-test`, errors that grow by half or failures of half of
      // the trials are found 19 times of 20; with 12 trials it would be one time in three, or
      // never.
      {.name = "gate",
       .description = "a small study for continuous integration: the baseline on JUNCTION",
       .trials = 30},
      // Pair 12 of the loop is one on its straight part.
      {.name = "methods",
       .description = "every method on the baseline of JUNCTION, TUNNEL and a pair of the loop",
       .survey = "junction, tunnel, kvarntorp-loop:12",
       .methods = {"all"},
       .trials = 30},
      {.name = "robust-parts",
       .description = "what the parts of method robust are good for, on JUNCTION and TUNNEL",
       .survey = "junction, tunnel",
       .methods = {"robust"},
       .axes = {{"bodies", {1, 0}}, {"turns", {1, 0}}, {"slides", {6, 0}}},
       .trials = 50,
       .initial_translation = 2,
       .initial_rotation = 0.3},
  };
  return table;
}

const Study& find_study(const std::string& name) { return find_row(studies(), "study", name); }

void check_study(const Study& study, const std::vector<Method>& methods) {
  if (study.name.empty()) throw std::invalid_argument("a study needs a name");
  if (study.trials < 1) throw std::invalid_argument("a study needs at least one trial");
  const std::vector<const Method*> used = methods_of(study, methods);
  std::set<std::string> seen;
  for (const Axis& axis : study.axes) {
    check_axis(axis, used);
    if (!seen.insert(axis.name).second)
      throw std::invalid_argument(fmt::format("axis '{}' is there twice", axis.name));
  }
  for (const auto& [name, text] : study.settings) check_setting(name, text, used);
}

Study with_config(Study base, const Config& config, const std::vector<Method>& methods) {
  const auto with_place = [](const ConfigEntry& entry, const std::function<void()>& work) {
    try {
      work();
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", entry.where, error.what()));
    }
  };
  // The methods decide which axes and settings there are, so the study's own fields come first.
  Config own, open;
  for (const ConfigEntry& entry : config) {
    const bool is_open = entry.key.starts_with("axes.") || entry.key.starts_with("settings.") ||
                         entry.key.starts_with("survey-settings.");
    (is_open ? open : own).push_back(entry);
  }
  std::vector<Field> known = fields_of(base);
  Settings settings = resolve(own, known);
  base = with_settings(base, settings);
  for (const ConfigEntry& entry : own)
    if (entry.key == "methods") with_place(entry, [&] { methods_of(base, methods); });
  const std::vector<const Method*> used = methods_of(base, methods);

  for (const ConfigEntry& entry : open) {
    const std::string key = entry.key.substr(entry.key.find('.') + 1);
    with_place(entry, [&] {
      if (entry.key.starts_with("axes.")) {
        Axis axis{.name = key, .values = parse_numbers(entry.text)};
        const auto old = std::find_if(base.axes.begin(), base.axes.end(),
                                      [&](const Axis& a) { return a.name == key; });
        if (!axis.values.empty()) check_axis(axis, used);
        if (old == base.axes.end())
          base.axes.push_back(std::move(axis));
        else
          *old = std::move(axis);
      } else if (entry.key.starts_with("settings.")) {
        check_setting(key, entry.text, used);
        base.settings[key] = entry.text;
      } else {
        base.survey_settings[key] = entry.text;
      }
    });
  }
  std::erase_if(base.axes, [](const Axis& axis) { return axis.values.empty(); });
  check_study(base, methods);
  return base;
}

std::string study_yaml(const Study& study) {
  std::vector<Field> list = fields_of(study);
  const auto add = [&](const std::string& name, const std::string& value, const std::string& help) {
    list.push_back(
        {.name = name, .expected = "see minescan list methods", .help = help, .value = value});
  };
  for (const Axis& axis : study.axes)
    add("axes." + axis.name, value_text(axis.values), "what is varied");
  for (const auto& [name, value] : study.settings)
    add("settings." + name, value, "option of methods");
  for (const auto& [name, value] : study.survey_settings)
    add("survey-settings." + name, value, "option of the survey");
  return config_yaml(list, {});
}

std::vector<Trial> trials(const Study& study, const std::vector<ScanPair>& pairs,
                          const std::vector<Method>& methods, std::uint64_t seed) {
  check_study(study, methods);
  const std::vector<const Method*> used = methods_of(study, methods);
  std::vector<Trial> list;
  for (const ScanPair& pair : pairs) {
    std::vector<std::size_t> at(study.axes.size(), 0);
    do {
      for (const Method* method : used) {
        Trial trial{.study = study.name,
                    .pair = pair.name,
                    .origin = pair.origin,
                    .method = method->name,
                    .settings = settings_for(study, *method),
                    .initial_translation = study.initial_translation,
                    .initial_rotation = study.initial_rotation,
                    .starts = study.trials,
                    .seed = seed};
        for (std::size_t i = 0; i < study.axes.size(); ++i)
          set_axis(trial, study.axes[i].name, study.axes[i].values[at[i]], *method);
        for (trial.start = 0; trial.start < study.trials; ++trial.start) list.push_back(trial);
      }
    } while (advance(at, study.axes));
  }
  return list;
}

}  // namespace minescan
