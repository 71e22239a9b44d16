// SPDX-License-Identifier: MIT
#include "cli/validation_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "core/fields.h"

namespace minescan {
namespace {

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

std::string measured_text(const Finding& f) {
  return with_unit(fmt::format("{:.4g}", f.measured), f.expected.unit);
}

std::string accepted_text(const Finding& f) {
  if (!f.expected.accepted) return "";
  const Interval& accepted = *f.expected.accepted;
  const std::string low = fmt::format("{:.4g}", accepted.low);
  const std::string high = fmt::format("{:.4g}", accepted.high);
  // Six digits where four do not tell the ends apart.
  return with_unit(accepted.low == accepted.high ? low
                   : low == high ? fmt::format("{:.6g} to {:.6g}", accepted.low, accepted.high)
                                 : low + " to " + high,
                   f.expected.unit);
}

std::size_t count(const std::vector<Finding>& findings, Verdict wanted) {
  return static_cast<std::size_t>(std::count_if(
      findings.begin(), findings.end(), [&](const Finding& f) { return verdict(f) == wanted; }));
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

}  // namespace

std::string findings_text(const std::vector<Finding>& findings) {
  std::size_t name_width = 0;
  for (const Finding& f : findings) name_width = std::max(name_width, f.expected.name.size());
  std::string text;
  for (const Finding& f : findings)
    text += fmt::format("{:8}  {:{}}  {:>12}  {}\n", value_text(verdict(f)), f.expected.name,
                        name_width, measured_text(f),
                        f.expected.accepted ? "accepted " + accepted_text(f) : "");
  return text;
}

std::string findings_json(const std::vector<Finding>& findings, std::uint64_t seed) {
  nlohmann::ordered_json json = {{"version", version()},
                                 {"seed", seed},
                                 {"passed", count(findings, Verdict::pass)},
                                 {"failed", count(findings, Verdict::fail)},
                                 {"reported", count(findings, Verdict::reported)},
                                 {"findings", nlohmann::ordered_json::array()}};
  for (const Finding& f : findings) {
    nlohmann::ordered_json row = {{"name", f.expected.name},
                                  {"what", f.expected.what},
                                  {"measured", f.measured},
                                  {"low", nullptr},
                                  {"high", nullptr},
                                  {"unit", f.expected.unit},
                                  {"source", f.expected.source},
                                  {"verdict", value_text(verdict(f))}};
    if (f.expected.accepted) {
      row["low"] = f.expected.accepted->low;
      row["high"] = f.expected.accepted->high;
    }
    json["findings"].push_back(std::move(row));
  }
  return json.dump(2) + "\n";
}

std::string findings_page(const std::vector<Finding>& findings,
                          const std::vector<PagePicture>& pictures, std::uint64_t seed) {
  std::string page = fmt::format(
      R"(<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Simulated scanners, measured</title>
<style>
body {{ font: 15px/1.4 sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em; color: #222; }}
table {{ border-collapse: collapse; width: 100%; }}
th, td {{ text-align: left; vertical-align: top; padding: .3em .6em; border-bottom: 1px solid #ddd; }}
td.number {{ text-align: right; white-space: nowrap; }}
td small {{ color: #555; }}
.pass {{ background: #d7f0d7; }}
.fail {{ background: #f6c9c4; font-weight: bold; }}
.reported {{ background: #eee; }}
figure {{ margin: 2em 0; }}
img {{ max-width: 100%; display: block; }}
</style>
<h1>Simulated scanners, measured</h1>
<p>minescan {}, seed {}: {} figures within what is accepted, {} not, {} with nothing to compare with.</p>
<table>
<tr><th>verdict<th>what<th>measured<th>accepted<th>source
)",
      escaped(std::string(version())), seed, count(findings, Verdict::pass),
      count(findings, Verdict::fail), count(findings, Verdict::reported));
  for (const Finding& f : findings) {
    const std::string verdict_text = value_text(verdict(f));
    page += fmt::format(
        "<tr><td class=\"{}\">{}<td>{}<br><small>{}</small><td class=\"number\">{}"
        "<td class=\"number\">{}<td>{}\n",
        verdict_text, verdict_text, escaped(f.expected.name), escaped(f.expected.what),
        escaped(measured_text(f)), escaped(accepted_text(f)), escaped(f.expected.source));
  }
  page += "</table>\n";
  for (const PagePicture& p : pictures)
    page += fmt::format(
        "<figure><figcaption>{}</figcaption><img src=\"{}\" alt=\"{}\" "
        "loading=\"lazy\"></figure>\n",
        escaped(p.caption), escaped(p.file), escaped(p.caption));
  page += "</html>\n";
  return page;
}

}  // namespace minescan
