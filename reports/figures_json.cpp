// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "reports/figures.h"

namespace minescan {
namespace {

// Keys stay in the order written, so that files can be read and compared.
using Json = nlohmann::ordered_json;

Json interval_json(const Interval& interval) { return Json::array({interval.low, interval.high}); }

Json box_json(const FigureBox& box) {
  const BoxStatistics& s = box.statistics;
  Json json = {{"level", box.level},
               {"trials", box.trials},
               {"n", s.count},
               {"good", box.good},
               {"acceptable", box.acceptable},
               {"goodInterval", interval_json(box.good_interval)},
               {"acceptableInterval", interval_json(box.acceptable_interval)}};
  if (s.count > 0) {
    json["min"] = s.minimum;
    json["q1"] = s.lower_quartile;
    json["median"] = s.median;
    json["q3"] = s.upper_quartile;
    json["max"] = s.maximum;
    json["medianInterval"] = interval_json(s.median_interval);
  }
  return json;
}

Json figure_json(const Figure& figure) {
  Json series = Json::array();
  for (const FigureSeries& one : figure.series) {
    Json boxes = Json::array();
    for (const FigureBox& box : one.boxes) boxes.push_back(box_json(box));
    series.push_back({{"series", one.series}, {"boxes", std::move(boxes)}});
  }
  return {{"name", figure.name},       {"title", figure.title},
          {"xLabel", figure.x_label},  {"yLabel", figure.y_label},
          {"unit", figure.unit},       {"levels", figure.levels},
          {"good", figure.good},       {"acceptable", figure.acceptable},
          {"log", figure.logarithmic}, {"series", std::move(series)}};
}

Json series_json(const Series& series) {
  Json statuses = Json::object();
  for (std::size_t i = 0; i < series.statuses.size(); ++i)
    statuses[std::string(names_of(Status{})[i])] = series.statuses[i];
  return {{"name", series.name},     {"method", series.method}, {"settings", series.settings},
          {"colour", series.colour}, {"trials", series.trials}, {"statuses", std::move(statuses)}};
}

Json study_json(const StudyFigures& study) {
  Json series = Json::array(), figures = Json::array();
  for (const Series& one : study.series) series.push_back(series_json(one));
  for (const Figure& one : study.figures) figures.push_back(figure_json(one));
  // Seeds as text: JavaScript's numbers hold 53 bits.
  Json seeds = Json::array();
  for (const std::uint64_t seed : study.seeds) seeds.push_back(std::to_string(seed));
  return {{"name", study.name},
          {"description", study.description},
          {"trials", study.trials},
          {"pairs", study.pairs},
          {"seeds", std::move(seeds)},
          {"initialTranslation", interval_json(study.initial_translation)},
          {"initialRotation", interval_json(study.initial_rotation)},
          {"messages", study.messages},
          {"series", std::move(series)},
          {"figures", std::move(figures)}};
}

}  // namespace

std::string figures_json(const std::vector<StudyFigures>& studies,
                         const std::vector<RunInfo>& runs) {
  Json json = {{"studies", Json::array()}, {"runs", Json::array()}};
  for (const StudyFigures& study : studies) json["studies"].push_back(study_json(study));
  for (const RunInfo& run : runs)
    json["runs"].push_back({{"version", run.version},
                            {"commandLine", run.command_line},
                            {"machine", run.machine},
                            {"threads", run.threads},
                            {"started", run.started},
                            {"finished", run.finished}});
  // Names and messages come from users and their programs: bytes that are not UTF-8 are replaced.
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace minescan
