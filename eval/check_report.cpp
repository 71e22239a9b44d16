// SPDX-License-Identifier: MIT
#include "eval/check_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace minescan {
namespace {

std::string question_text(Question question) {
  switch (question) {
    case Question::translation_error:
      return "translation error";
    case Question::rotation_error:
      return "rotation error";
    case Question::failures:
      return "failures";
  }
  return {};
}

std::string state(const CheckTest& t) {
  return t.regression ? "WORSE" : t.too_few ? "too few" : "ok";
}

// What was found, in words that need no column heads.
std::string finding(const CheckTest& t) {
  if (t.question == Question::failures)
    return fmt::format("{:.1f} % -> {:.1f} % ({} new, {} mended)", 100 * t.before, 100 * t.now,
                       t.worse, t.better);
  return fmt::format("median {:.3g} -> {:.3g} {}, typical ratio {:.3f} [{:.3f}, {:.3f}]", t.before,
                     t.now, t.question == Question::translation_error ? "m" : "rad", t.effect,
                     t.interval.low, t.interval.high);
}

std::string p_text(const CheckTest& t) {
  return t.p_adjusted < 1e-4 ? "p < 0.0001" : fmt::format("p = {:.4f}", t.p_adjusted);
}

std::string limit_text(const LimitResult& l) {
  const std::string what = l.limit.metric == "failure_rate"
                               ? l.limit.metric
                               : fmt::format("{} q{:.2f}", l.limit.metric, l.limit.quantile);
  return fmt::format("{}{}: {} = {:.4g} over {} rows, limit {:.4g} ({})", l.limit.method,
                     l.limit.pair.empty() ? "" : ", " + l.limit.pair, what, l.measured, l.rows,
                     l.limit.max, l.limit.reason);
}

std::string details(const CheckResult& r) {
  return fmt::format(
      "{} trials in both, {} changed (by up to {:.3g} m and {:.3g} rad), {} missing, {} new; "
      "groups by {}",
      r.common, r.changed, r.largest_move, r.largest_turn, r.missing, r.extra, r.grouping);
}

// Tests that alarm first, otherwise as they are.
std::vector<CheckTest> alarms_first(std::vector<CheckTest> tests) {
  std::stable_partition(tests.begin(), tests.end(),
                        [](const CheckTest& t) { return t.regression; });
  return tests;
}

std::string xml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\n':
      case '\t':
        escaped += ' ';
        break;
      // XML 1.0 has no way to write other control characters.
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
  }
  return escaped;
}

std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|' || c == '\\' || c == '`' || c == '*' || c == '_') escaped += '\\';
    if (c == '<')
      escaped += "&lt;";
    else
      escaped += c == '\n' || c == '\r' ? ' ' : c;
  }
  return escaped;
}

}  // namespace

std::string check_text(const CheckResult& result) {
  std::string text = fmt::format("{}\n{}\n", result.summary, details(result));
  for (const CheckTest& t : alarms_first(result.tests))
    text += fmt::format("{:<8} {}: {}: {}, {}\n", state(t), t.group, question_text(t.question),
                        finding(t), p_text(t));
  for (const LimitResult& l : result.limits)
    text += fmt::format("{:<8} {}\n", l.holds ? "ok" : "BROKEN", limit_text(l));
  return text;
}

std::string check_json(const CheckResult& result) {
  using Json = nlohmann::ordered_json;
  Json tests = Json::array(), limits = Json::array();
  for (const CheckTest& t : result.tests) {
    Json test = {{"group", t.group},           {"question", value_text(t.question)},
                 {"trials", t.trials},         {"changed", t.changed},
                 {"before", t.before},         {"now", t.now},
                 {"effect", t.effect},         {"worse", t.worse},
                 {"better", t.better},         {"p", t.p},
                 {"p_adjusted", t.p_adjusted}, {"regression", t.regression},
                 {"too_few", t.too_few}};
    if (t.question != Question::failures) test["interval"] = {t.interval.low, t.interval.high};
    tests.push_back(std::move(test));
  }
  for (const LimitResult& l : result.limits)
    limits.push_back({{"name", l.limit.name},
                      {"metric", l.limit.metric},
                      {"method", l.limit.method},
                      {"pair", l.limit.pair},
                      {"quantile", l.limit.quantile},
                      {"max", l.limit.max},
                      {"reason", l.limit.reason},
                      {"rows", l.rows},
                      {"measured", l.measured},
                      {"holds", l.holds}});
  const Json json = {{"verdict", value_text(result.verdict)},
                     {"summary", result.summary},
                     {"grouping", result.grouping},
                     {"common", result.common},
                     {"missing", result.missing},
                     {"extra", result.extra},
                     {"changed", result.changed},
                     {"largest_move_m", result.largest_move},
                     {"largest_turn_rad", result.largest_turn},
                     {"needed", result.needed},
                     {"tests", tests},
                     {"limits", limits}};
  return json.dump(2) + "\n";
}

std::string check_markdown(const CheckResult& result) {
  std::string text = fmt::format("**{}**\n\n{}\n", cell(result.summary), cell(details(result)));
  if (!result.tests.empty()) {
    text += "\n| | group | question | found | p (Holm) |\n|---|---|---|---|---|\n";
    for (const CheckTest& t : alarms_first(result.tests))
      text += fmt::format("| {} | {} | {} | {} | {} |\n", state(t), cell(t.group),
                          question_text(t.question), finding(t), cell(p_text(t)));
  }
  if (!result.limits.empty()) {
    text += "\n| | limit | measured |\n|---|---|---|\n";
    for (const LimitResult& l : result.limits)
      text += fmt::format("| {} | {} | {} |\n", l.holds ? "ok" : "BROKEN", cell(l.limit.name),
                          cell(limit_text(l)));
  }
  return text;
}

std::string check_junit(const CheckResult& result) {
  std::size_t cases = 0, failures = 0, errors = 0;
  std::string body;
  const auto add = [&](const std::string& group, const std::string& name,
                       const std::string& inner) {
    ++cases;
    body += fmt::format("    <testcase classname=\"{}\" name=\"{}\">{}</testcase>\n", xml(group),
                        xml(name), inner);
  };
  const auto failed = [&](const char* tag, std::size_t& count, const std::string& message) {
    ++count;
    return fmt::format("<{} message=\"{}\"/>", tag, xml(message));
  };
  const bool incomplete = result.common == 0 || result.missing > 0;
  add("trials", "all trials of the baseline are there",
      incomplete ? failed("error", errors, details(result)) : "");
  for (const CheckTest& t : result.tests) {
    const std::string found = fmt::format("{}, {}", finding(t), p_text(t));
    std::string inner;
    if (t.regression)
      inner = failed("failure", failures, found);
    else if (t.too_few)
      inner = failed("error", errors,
                     fmt::format("{} trials, a verdict needs {}", t.trials, result.needed));
    add(t.group, question_text(t.question), inner);
  }
  for (const LimitResult& l : result.limits)
    add("limits", l.limit.name, l.holds ? "" : failed("failure", failures, limit_text(l)));
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  <testsuite name=\"minescan "
      "check\" "
      "tests=\"{}\" failures=\"{}\" errors=\"{}\">\n{}  </testsuite>\n</testsuites>\n",
      cases, failures, errors, body);
}

}  // namespace minescan
