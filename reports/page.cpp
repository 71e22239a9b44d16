// SPDX-License-Identifier: MIT
#include <string>
#include <string_view>

#include "reports/assets.h"
#include "reports/figures.h"
#include "reports/report.h"

namespace minescan {
namespace {

/// JSON that may stand inside <script>: no name can end the element or begin a comment in it.
std::string inside_script(std::string_view json) {
  std::string safe;
  safe.reserve(json.size());
  for (const char c : json) {
    // These stand inside strings only, where \u is the same character.
    if (c == '<')
      safe += "\\u003c";
    else if (c == '>')
      safe += "\\u003e";
    else if (c == '&')
      safe += "\\u0026";
    else
      safe += c;
  }
  return safe;
}

}  // namespace

std::string report_page(const ReportInput& input) {
  // The policy lets the page load nothing, from nowhere. Vega compiles its expressions at run time,
  // hence unsafe-eval; none of them holds text from the data.
  std::string page =
      "<!doctype html>\n"
      "<html lang=\"en\">\n"
      "<head>\n"
      "<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>minescan: scan registration report</title>\n"
      "<style>\n";
  page += page_style();
  page +=
      "</style>\n"
      "</head>\n"
      "<body>\n"
      "<main id=\"report\"><noscript>The figures are drawn by JavaScript, which is switched off "
      "here.</noscript></main>\n"
      "<script type=\"application/json\" id=\"report-data\">";
  page += inside_script(figures_json(make_figures(input.outcomes), input.runs));
  page += "</script>\n<script>\n";
  page += page_script();
  page +=
      "</script>\n"
      "</body>\n"
      "</html>\n";
  return page;
}

}  // namespace minescan
