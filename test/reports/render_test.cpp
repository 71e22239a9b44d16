// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/output_file.h"
#include "reports/report.h"
#include "test/reports/made_up.h"

namespace minescan {
namespace {

namespace fs = std::filesystem;

/// Sets a variable of the environment for one test.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* old = getenv(name)) old_ = old;
    setenv(name, value.c_str(), 1);
  }
  ~Environment() {
    if (old_)
      setenv(name_, old_->c_str(), 1);
    else
      unsetenv(name_);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::optional<std::string> old_ = {};
};

/// An empty folder of this test.
fs::path fresh_folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("minescan_render_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

ReportInput two_methods() {
  ReportInput input;
  for (const double x : {0.5, 1.0, 2.0})
    for (int i = 0; i < 5; ++i)
      for (const char* method : {"icp", "ndt"})
        input.outcomes.push_back(
            outcome_at("fig16", method, "initial-translation", x, 0.01 * x * (i + 1)));
  return input;
}

std::string error_of(const ReportInput& input) {
  try {
    report_figures(input);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Render, EveryFigureIsAnSvgWithItsText) {
  const std::vector<FigureFile> files = report_figures(two_methods());
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[0].name, "fig16-translation_error_m.svg");
  EXPECT_EQ(files[2].name, "fig16-time_s.svg");
  for (const char* text :
       {">icp</text>", ">ndt</text>", ">good: 0.1 m</text>", ">Translation error [m]",
        ">Initial translation error [m]</text>", "font-family=\"Helvetica, Arial"})
    EXPECT_NE(files[0].svg.find(text), std::string::npos) << text;
  EXPECT_TRUE(files[0].svg.starts_with("<svg")) << files[0].svg.substr(0, 60);
  // 3.5 inches at 96 px per inch: one column of a two-column page.
  EXPECT_NE(files[0].svg.find("width=\"336\""), std::string::npos) << files[0].svg.substr(0, 300);
  EXPECT_NE(files[0].svg.find("fill=\"white\""), std::string::npos);
}

TEST(Render, IsTheSameEveryTime) {
  EXPECT_EQ(report_figures(two_methods())[0].svg, report_figures(two_methods())[0].svg);
}

TEST(Render, LeavesNoFilesBehind) {
  const fs::path folder = fresh_folder("clean");
  const Environment temporary("TMPDIR", folder.string());
  report_figures(two_methods());
  EXPECT_TRUE(fs::is_empty(folder));
  {
    const Environment path("PATH", folder.string());
    EXPECT_THROW(report_figures(two_methods()), std::runtime_error);
  }
  EXPECT_TRUE(fs::is_empty(folder));
}

TEST(Render, NamesAreText) {
  Outcome row = outcome("<a&b>", "<img src=x>", 0.1);
  const std::string svg = report_figures({.outcomes = {row}})[0].svg;
  EXPECT_EQ(svg.find("<img"), std::string::npos);
  EXPECT_NE(svg.find("&lt;a&amp;b&gt;"), std::string::npos);
}

TEST(Render, DrawsWhatThereIs) {
  std::vector<Outcome> thrown(2, outcome("thrown", "ndt", 0));
  for (Outcome& row : thrown) row.message = "no points";
  EXPECT_EQ(report_figures({.outcomes = thrown}).size(), 3u);
  EXPECT_EQ(report_figures({.outcomes = {outcome("zero", "ndt", 0, 0)}}).size(), 3u);
  EXPECT_EQ(report_figures({.outcomes = {outcome_at("one", "ndt", "cell-size", 1, 0.1)}}).size(),
            3u);
}

TEST(Render, NothingRunNeedsNoNode) {
  const Environment path("PATH", fresh_folder("empty").string());
  EXPECT_TRUE(report_figures({}).empty());
}

TEST(Render, AMissingNodeIsSaid) {
  const Environment path("PATH", fresh_folder("missing").string());
  EXPECT_EQ(error_of(two_methods()),
            "figures as SVG need Node.js, but 'node' cannot be started: No such file or directory");
}

TEST(Render, AFailingNodeIsQuoted) {
  const fs::path folder = fresh_folder("failing");
  write_file(
      folder / "node",
      "#!/bin/sh\necho first; echo 'TypeError: it is broken' >&2; echo 'Node.js v0'; exit 3\n");
  fs::permissions(folder / "node", fs::perms::owner_all);
  const Environment path("PATH", folder.string());
  EXPECT_EQ(error_of(two_methods()),
            "rendering the figures: 'node' ended with status 3: TypeError: it is broken");
}

TEST(Render, AKilledNodeIsSaid) {
  const fs::path folder = fresh_folder("killed");
  write_file(folder / "node", "#!/bin/sh\nkill -9 $$\n");
  fs::permissions(folder / "node", fs::perms::owner_all);
  const Environment path("PATH", folder.string());
  EXPECT_EQ(error_of(two_methods()), "rendering the figures: 'node' ended with signal 9");
}

}  // namespace
}  // namespace minescan
