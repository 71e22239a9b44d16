// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "reports/assets.h"
#include "reports/figures.h"
#include "reports/report.h"
#include "test/reports/made_up.h"

namespace minescan {
namespace {

const std::string hostile = "</script><script>alert(1)</script><!-- & \" \xff";

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size())
    ++found;
  return found;
}

/// What a browser takes for the data: up to the first end of the element.
nlohmann::json data_of(const std::string& page) {
  const std::string open = "id=\"report-data\">";
  const std::size_t begin = page.find(open) + open.size();
  return nlohmann::json::parse(page.substr(begin, page.find("</", begin) - begin));
}

TEST(Page, DataReadBack) {
  const RunInfo run{.version = "0.1.0", .command_line = "minescan sweep fig16", .threads = 2};
  const nlohmann::json data = data_of(
      report_page({.outcomes = {outcome("fig16", "ndt", 0.0625), outcome("fig16", "icp", 0.3)},
                   .runs = {run}}));
  EXPECT_EQ(data["runs"][0]["commandLine"], "minescan sweep fig16");
  const nlohmann::json& study = data["studies"][0];
  EXPECT_EQ(study["name"], "fig16");
  EXPECT_EQ(study["series"][1]["name"], "ndt");
  EXPECT_EQ(study["figures"][0]["series"][1]["boxes"][0]["median"], 0.0625);
  EXPECT_EQ(study["figures"][0]["series"][1]["boxes"][0]["good"], 1);
}

TEST(Page, NamesCannotLeaveTheirPlace) {
  const std::string harmless = report_page({.outcomes = {outcome("s", "ndt", 0.1)}});
  Outcome row = outcome(hostile, hostile, 0.1);
  row.trial.pair = hostile;
  row.trial.settings = {{hostile, hostile}};
  row.message = hostile;
  const std::string page =
      report_page({.outcomes = {row},
                   .runs = {{.version = hostile, .command_line = hostile, .machine = hostile}}});
  for (const char* part : {"<script", "</script", "<!--"})
    EXPECT_EQ(count(page, part), count(harmless, part)) << part;
  EXPECT_EQ(
      data_of(page)["studies"][0]["name"],
      "</script><script>alert(1)</script><!-- & \" \xEF\xBF\xBD");  // the stray byte is replaced
}

TEST(Page, FetchesNothing) {
  const std::string page = report_page({.outcomes = {outcome("s", "ndt", 0.1)}});
  const std::string head = page.substr(0, page.find("</head>"));
  EXPECT_NE(head.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(head.find("unsafe-inline' http"), std::string::npos);
  EXPECT_EQ(head.find("url("), std::string::npos);
  EXPECT_EQ(head.find("@import"), std::string::npos);
  for (const char* tag : {"<link", "<img", "<iframe", "<base"})
    EXPECT_EQ(head.find(tag), std::string::npos);
  // Elements of the document: everything but the two scripts.
  EXPECT_EQ(count(page, "<script src"), 0u);
  EXPECT_EQ(count(page, " src=\"http"), 0u);
  EXPECT_EQ(count(page, " href=\"http"), 0u);
}

// An end tag inside a script would cut it short.
TEST(Page, ScriptsStandInTheDocumentWhole) {
  EXPECT_EQ(page_script().find("</script"), std::string_view::npos);
  EXPECT_EQ(page_script().find("<!--"), std::string_view::npos);
  EXPECT_EQ(page_style().find("</"), std::string_view::npos);
  EXPECT_GT(page_script().size(), 100'000u);
}

TEST(Page, NamesTheLicencesOfWhatItContains) {
  for (const std::string_view script : {page_script(), render_script()}) {
    EXPECT_NE(script.find("University of Washington Interactive Data Lab"), std::string_view::npos);
    EXPECT_NE(script.find("Mike Bostock"), std::string_view::npos);
  }
}

TEST(Page, NothingRunIsAPageThatSaysSo) {
  const std::string page = report_page({});
  EXPECT_TRUE(data_of(page)["studies"].empty());
  EXPECT_NE(page.find("Nothing was run"), std::string::npos);
}

TEST(Page, IsTheSameEveryTime) {
  const ReportInput input{.outcomes = {outcome("s", "ndt", 0.1), outcome("t", "icp", 0.1)}};
  EXPECT_EQ(report_page(input), report_page(input));
}

}  // namespace
}  // namespace minescan
