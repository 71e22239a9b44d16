// SPDX-License-Identifier: MIT
#include "core/config.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

namespace minescan {
namespace {

std::string place(const std::string& name, const YAML::Mark& mark) {
  return fmt::format("{}:{}", name, mark.line + 1);
}

// A list may hold lists (poses); those inside keep their commas.
std::string sequence_text(const YAML::Node& node, const std::string& name) {
  std::vector<std::string> parts;
  for (const YAML::Node& item : node) {
    if (!item.IsScalar())
      throw std::invalid_argument(
          fmt::format("{}: expected a list of numbers or names", place(name, item.Mark())));
    parts.push_back(item.Scalar());
  }
  return join(parts, ", ");
}

void flatten(const YAML::Node& node, const std::string& prefix, const std::string& name,
             Config& config) {
  std::set<std::string> seen;
  for (const auto& item : node) {
    const std::string where = place(name, item.first.Mark());
    if (!item.first.IsScalar())
      throw std::invalid_argument(fmt::format("{}: expected a key of plain text", where));
    const std::string key = prefix + item.first.Scalar();
    if (!seen.insert(key).second)
      throw std::invalid_argument(fmt::format("{}: key '{}' is there twice", where, key));
    switch (item.second.Type()) {
      case YAML::NodeType::Map:
        flatten(item.second, key + ".", name, config);
        break;
      case YAML::NodeType::Sequence:
        config.push_back({key, sequence_text(item.second, name), where});
        break;
      case YAML::NodeType::Scalar:
        config.push_back({key, item.second.Scalar(), where});
        break;
      default:
        throw std::invalid_argument(fmt::format("{}: key '{}' has no value", where, key));
    }
  }
}

}  // namespace

Config parse_config(const std::string& yaml, const std::string& name) {
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument(
        fmt::format("{}: not YAML: {}", place(name, error.mark), error.msg));
  }
  if (!root.IsMap())
    throw std::invalid_argument(fmt::format("{}: expected 'key: value' lines", name));
  Config config;
  flatten(root, "", name, config);
  return config;
}

Config read_config(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path))
    throw std::runtime_error(path.string() + ": cannot be read");
  // A configuration is a page of text; a scan given by mistake is not worth parsing.
  constexpr std::uintmax_t limit = 1 << 20;
  if (std::filesystem::file_size(path) > limit)
    throw std::invalid_argument(path.string() + ": expected a configuration of less than 1 MiB");
  const std::string yaml{std::istreambuf_iterator<char>(file), {}};
  return parse_config(yaml, path.string());
}

ConfigEntry parse_assignment(std::string_view text, const std::string& option) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0)
    throw std::invalid_argument(fmt::format("{}: expected key=value, found '{}'", option, text));
  return {std::string(trimmed(text.substr(0, equals))),
          std::string(trimmed(text.substr(equals + 1))), option};
}

std::string take(Config& config, std::string_view key, const std::string& fallback) {
  std::string text = fallback;
  for (const ConfigEntry& entry : config)
    if (entry.key == key) text = entry.text;
  std::erase_if(config, [&](const ConfigEntry& entry) { return entry.key == key; });
  return text;
}

Settings resolve(const Config& config, const std::vector<Field>& known) {
  Settings settings;
  for (const ConfigEntry& entry : config) {
    const Field* field = find_field(known, entry.key);
    if (!field) {
      std::vector<std::string> names;
      for (const Field& f : known) names.push_back(f.name);
      throw std::invalid_argument(
          fmt::format("{}: {}", entry.where, unknown_name("key", entry.key, names)));
    }
    try {
      settings[entry.key] = field->canonical(entry.text);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(
          fmt::format("{}: {}: {}{}", entry.where, entry.key, error.what(),
                      field->unit.empty() ? "" : fmt::format(" (unit: {})", field->unit)));
    }
    if (settings[entry.key] == field->value) settings.erase(entry.key);
  }
  return settings;
}

std::string config_yaml(const std::vector<Field>& known, const Settings& settings) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  std::vector<std::string> open;  // the maps we are in
  for (const Field& field : known) {
    std::vector<std::string> path = split(field.name, '.');
    const std::string leaf = path.back();
    path.pop_back();
    std::size_t shared = 0;
    while (shared < std::min(path.size(), open.size()) && path[shared] == open[shared]) ++shared;
    for (; open.size() > shared; open.pop_back()) out << YAML::EndMap;
    for (; open.size() < path.size(); open.push_back(path[open.size()]))
      out << YAML::Key << path[open.size()] << YAML::Value << YAML::BeginMap;
    const auto found = settings.find(field.name);
    out << YAML::Key << leaf << YAML::Value
        << (found == settings.end() ? field.value : found->second)
        << YAML::Comment(fmt::format("{}{}{}; {}", field.help, field.unit.empty() ? "" : ", ",
                                     field.unit, field.expected));
  }
  for (; !open.empty(); open.pop_back()) out << YAML::EndMap;
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace minescan
