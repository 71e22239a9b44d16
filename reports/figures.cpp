// SPDX-License-Identifier: MIT
#include "reports/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "core/text.h"
#include "eval/metrics.h"
#include "eval/study.h"
#include "reports/axis_label.h"

namespace minescan {
namespace {

// A linear axis shows two decades; where errors of good and of failed trials are further apart, the
// boxes of the good ones would be lines on the x axis (assumed).
constexpr double largest_linear_ratio = 100;
constexpr std::size_t most_messages = 10;
constexpr std::size_t distinct_colours = 7;  // of the palette in web/src/spec.mjs
constexpr const char* metric_names[] = {"translation_error_m", "rotation_error_rad", "time_s"};

using Rows = std::vector<const Outcome*>;
using Axes = std::map<std::string, double>;
using Level = std::optional<double>;  // none: the trial does not have this axis

/// What makes two trials of a study belong to one series.
struct SeriesKey {
  std::string method = {};
  std::map<std::string, Level> axes = {};  // other than x, where they differ within the method
  Settings settings = {};                  // where they differ within the method
  auto operator<=>(const SeriesKey&) const = default;
};

std::string data_set(const std::string& pair) { return pair.substr(0, pair.find('/')); }

template <class Key>
std::map<Key, Rows> grouped(const Rows& rows, const std::function<Key(const Outcome&)>& key) {
  std::map<Key, Rows> groups;
  for (const Outcome* row : rows) groups[key(*row)].push_back(row);
  return groups;
}

Level axis_value(const Outcome& row, const std::string& axis) {
  const auto found = row.trial.axes.find(axis);
  return found == row.trial.axes.end() ? Level() : Level(found->second);
}

std::set<std::string> axis_names(const Rows& rows) {
  std::set<std::string> names;
  for (const Outcome* row : rows)
    for (const auto& [name, value] : row->trial.axes) names.insert(name);
  return names;
}

/// The axis with most values, or empty if none takes two.
std::string x_axis(const Rows& rows) {
  std::string best;
  std::size_t most = 1;
  for (const std::string& axis : axis_names(rows)) {
    std::set<double> values;
    for (const Outcome* row : rows)
      if (const Level value = axis_value(*row, axis)) values.insert(*value);
    if (values.size() <= most) continue;
    best = axis;
    most = values.size();
  }
  return best;
}

std::optional<std::string> setting(const Outcome& row, const std::string& name) {
  const auto found = row.trial.settings.find(name);
  if (found == row.trial.settings.end()) return std::nullopt;
  return found->second;
}

/// Whether the axes of a trial say what the setting is: cell-size in a sweep over cell-size.
bool follows_axes(const Rows& rows, const std::string& name) {
  std::map<Axes, std::optional<std::string>> seen;
  for (const Outcome* row : rows) {
    const std::optional<std::string> value = setting(*row, name);
    if (seen.try_emplace(row->trial.axes, value).first->second != value) return false;
  }
  return true;
}

template <class Value>
bool varies(const Rows& rows, const Value& value_of) {
  return std::ranges::any_of(
      rows, [&](const Outcome* row) { return value_of(*row) != value_of(*rows.front()); });
}

/// Names of what tells the trials of one method apart, x aside.
struct Distinctions {
  std::vector<std::string> axes = {};
  std::vector<std::string> settings = {};
};

Distinctions distinctions(const Rows& rows, const std::string& x) {
  Distinctions found;
  for (const std::string& axis : axis_names(rows))
    if (axis != x && varies(rows, [&](const Outcome& row) { return axis_value(row, axis); }))
      found.axes.push_back(axis);
  std::set<std::string> names;
  for (const Outcome* row : rows)
    for (const auto& [name, value] : row->trial.settings) names.insert(name);
  for (const std::string& name : names)
    if (varies(rows, [&](const Outcome& row) { return setting(row, name); }) &&
        !follows_axes(rows, name))
      found.settings.push_back(name);
  return found;
}

std::map<SeriesKey, Rows> series_of(const Rows& rows, const std::string& x) {
  std::map<SeriesKey, Rows> series;
  const auto by_method =
      grouped<std::string>(rows, [](const Outcome& row) { return row.trial.method; });
  for (const auto& [method, of_method] : by_method) {
    const Distinctions differing = distinctions(of_method, x);
    for (const Outcome* row : of_method) {
      SeriesKey key{.method = method};
      for (const std::string& axis : differing.axes) key.axes[axis] = axis_value(*row, axis);
      for (const std::string& name : differing.settings)
        key.settings[name] = setting(*row, name).value_or("default");
      series[key].push_back(row);
    }
  }
  return series;
}

std::string level_text(const Level& level) { return level ? number_text(*level) : "default"; }

std::string series_name(const SeriesKey& key) {
  std::string name = key.method;
  for (const auto& [axis, value] : key.axes)
    name += fmt::format(", {} {}", axis, level_text(value));
  for (const auto& [option, value] : key.settings) name += fmt::format(", {} {}", option, value);
  return name;
}

/// Every setting of the rows once; one that takes several values lists none.
std::string settings_text(const Rows& rows) {
  std::map<std::string, std::optional<std::string>> values;
  for (const Outcome* row : rows)
    for (const auto& [name, value] : row->trial.settings) values[name] = value;
  std::vector<std::string> parts;
  for (const auto& value : values) {
    const std::string& name = value.first;
    const bool several = varies(rows, [&](const Outcome& row) { return setting(row, name); });
    parts.push_back(fmt::format("{} = {}", name, several ? "varied" : *value.second));
  }
  return join(parts, ", ");
}

/// Whether the metric has a value: a trial that threw has no result to measure.
bool measured(const Outcome& row, const Metric& metric) {
  return row.message.empty() && row.result.status != Status::not_run &&
         std::isfinite(metric.value(row));
}

FigureBox make_box(const Rows& rows, const Metric& metric) {
  FigureBox box{.trials = rows.size()};
  std::vector<double> values;
  for (const Outcome* row : rows) {
    if (measured(*row, metric)) values.push_back(metric.value(*row));
    const Quality found = quality(*row);
    if (found == Quality::good) ++box.good;
    if (found != Quality::failed) ++box.acceptable;
  }
  if (!values.empty()) box.statistics = box_statistics(std::move(values));
  box.good_interval = wilson_interval(box.good, box.trials);
  box.acceptable_interval = wilson_interval(box.acceptable, box.trials);
  return box;
}

bool needs_logarithm(const Figure& figure) {
  std::vector<double> drawn = {figure.good, figure.acceptable};
  for (const FigureSeries& series : figure.series)
    for (const FigureBox& box : series.boxes)
      for (const double value : {box.statistics.minimum, box.statistics.lower_quartile,
                                 box.statistics.median, box.statistics.maximum})
        drawn.push_back(value);
  std::erase_if(drawn, [](double value) { return !(value > 0); });
  if (drawn.empty()) return false;
  const auto [low, high] = std::ranges::minmax(drawn);
  return high > largest_linear_ratio * low;
}

/// "m" of "Translation error [m]".
std::string unit_of(const std::string& label) {
  const std::size_t open = label.rfind('['), close = label.rfind(']');
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  return label.substr(open + 1, close - open - 1);
}

Figure make_figure(const std::string& place, const Rows& rows, const std::string& x,
                   const std::map<SeriesKey, Rows>& series, const Metric& metric) {
  const std::set<const Outcome*> here(rows.begin(), rows.end());
  const std::string metric_title(
      trimmed(std::string_view(metric.label).substr(0, metric.label.find('['))));
  Figure figure{.name = file_stem(place + "-" + metric.name),
                .title = metric_title + ", " + place,
                .x_label = x.empty() ? std::string() : axis_label(x),
                .y_label = metric.label,
                .unit = unit_of(metric.label),
                .good = metric.good,
                .acceptable = metric.acceptable};
  std::map<Level, std::size_t> levels;
  for (const Outcome* row : rows) levels[axis_value(*row, x)] = 0;
  for (auto& [level, index] : levels) {
    index = figure.levels.size();
    figure.levels.push_back(x.empty() ? std::string() : level_text(level));
  }
  std::size_t index = 0;
  for (const auto& [key, all] : series) {
    FigureSeries one{.series = index++};
    Rows of_series;
    std::ranges::copy_if(all, std::back_inserter(of_series),
                         [&](const Outcome* row) { return here.contains(row); });
    const auto by_level =
        grouped<Level>(of_series, [&](const Outcome& row) { return axis_value(row, x); });
    for (const auto& [level, at_level] : by_level) {
      one.boxes.push_back(make_box(at_level, metric));
      one.boxes.back().level = levels.at(level);
    }
    if (!one.boxes.empty()) figure.series.push_back(std::move(one));
  }
  figure.logarithmic = needs_logarithm(figure);
  return figure;
}

StudyFigures make_study(const std::string& name, const Rows& rows) {
  StudyFigures study{.name = name, .trials = rows.size()};
  std::set<std::string> pairs, messages;
  std::set<std::uint64_t> seeds;
  std::set<double> translations, rotations;
  for (const Outcome* row : rows) {
    pairs.insert(row->trial.pair);
    seeds.insert(row->trial.seed);
    translations.insert(row->trial.initial_translation);
    rotations.insert(row->trial.initial_rotation);
    if (!row->message.empty()) messages.insert(row->trial.method + ": " + row->message);
  }
  const auto known = std::ranges::find(studies(), name, &Study::name);
  if (known != studies().end()) study.description = known->description;
  study.pairs.assign(pairs.begin(), pairs.end());
  study.seeds.assign(seeds.begin(), seeds.end());
  study.initial_translation = {*translations.begin(), *translations.rbegin()};
  study.initial_rotation = {*rotations.begin(), *rotations.rbegin()};
  for (const std::string& message : messages)
    if (study.messages.size() < most_messages) study.messages.push_back(message);

  const std::string x = x_axis(rows);
  const std::map<SeriesKey, Rows> series = series_of(rows, x);
  for (const auto& [key, of_series] : series) {
    Series one{.name = series_name(key),
               .method = key.method,
               .settings = settings_text(of_series),
               .trials = of_series.size()};
    for (const Outcome* row : of_series)
      ++one.statuses.at(static_cast<std::size_t>(row->result.status));
    study.series.push_back(std::move(one));
  }
  const auto by_data_set =
      grouped<std::string>(rows, [](const Outcome& row) { return data_set(row.trial.pair); });
  for (const auto& [set, of_set] : by_data_set)
    for (const char* metric : metric_names)
      study.figures.push_back(
          make_figure(by_data_set.size() == 1 ? name : fmt::format("{}, {}", name, set), of_set, x,
                      series, find_metric(metric)));
  return study;
}

/// Gives each name one number for the whole report. Names that stand beside each other in a study
/// get different ones; the first few, which are told apart best, are used evenly.
void assign_colours(std::vector<StudyFigures>& studies) {
  std::map<std::string, std::size_t> colours;
  std::array<std::size_t, distinct_colours> uses = {};
  const auto neighbours = [&](const std::string& name) {
    std::set<std::size_t> taken;
    for (const StudyFigures& study : studies) {
      if (std::ranges::find(study.series, name, &Series::name) == study.series.end()) continue;
      for (const Series& other : study.series)
        if (const auto found = colours.find(other.name); found != colours.end())
          taken.insert(found->second);
    }
    return taken;
  };
  for (StudyFigures& study : studies)
    for (Series& series : study.series) {
      if (!colours.contains(series.name)) {
        const std::set<std::size_t> taken = neighbours(series.name);
        std::size_t best = 0;
        while (taken.contains(best)) ++best;
        for (std::size_t i = best + 1; i < uses.size(); ++i)
          if (!taken.contains(i) && uses[i] < uses[best]) best = i;
        if (best < uses.size()) ++uses[best];
        colours[series.name] = best;
      }
      series.colour = colours[series.name];
    }
}

/// Two studies may differ only in what a file name cannot hold.
void make_names_unique(std::vector<StudyFigures>& studies) {
  std::set<std::string> used;
  for (StudyFigures& study : studies)
    for (Figure& figure : study.figures) {
      const std::string wanted = figure.name;
      for (int i = 2; !used.insert(figure.name).second; ++i)
        figure.name = fmt::format("{}-{}", wanted, i);
    }
}

}  // namespace

std::vector<StudyFigures> make_figures(const std::vector<Outcome>& outcomes) {
  std::map<std::string, Rows> by_study;
  for (const Outcome& outcome : outcomes) by_study[outcome.trial.study].push_back(&outcome);
  std::vector<StudyFigures> studies;
  for (const auto& [name, rows] : by_study) studies.push_back(make_study(name, rows));
  assign_colours(studies);
  make_names_unique(studies);
  return studies;
}

}  // namespace minescan
