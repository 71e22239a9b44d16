// SPDX-License-Identifier: MIT
// A validation from outside: what it writes, and that all scanners are as published.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "cli/program.h"

namespace minescan {
namespace {

using Json = nlohmann::json;

TEST(Validate, FindsTheScannersAsPublished) {
  const ScratchFolder folder;
  const ProgramResult result = run_minescan({"validate", "--out", "found", "--quiet"}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"found"});

  const Json json = Json::parse(content(folder / "found/validation.json"));
  EXPECT_EQ(json["failed"], 0);
  EXPECT_EQ(json["seed"], 1);
  EXPECT_GE(json["passed"], 30);
  std::set<std::string> names;
  for (const Json& row : json["findings"]) {
    names.insert(row["name"]);
    EXPECT_TRUE(row["measured"].is_number()) << row;
    EXPECT_NE(row["source"], "") << row;
    EXPECT_EQ(row["low"].is_null(), row["verdict"] == "reported") << row;
    EXPECT_NE(result.output.find(row["name"]), std::string::npos) << row;
  }
  EXPECT_EQ(names.size(), json["findings"].size()) << "two findings of one name";
  EXPECT_EQ(json["findings"].size(), json["passed"].get<int>() + json["reported"].get<int>());

  const std::string page = content(folder / "found/index.html");
  const Json list = Json::parse(run_minescan({"list", "scanners", "--json"}, folder).output);
  for (const Json& scanner : list["scanners"]) {
    const std::string name = scanner["name"];
    EXPECT_TRUE(names.contains(name + " in junction: mixed pixels") ||
                names.contains(name + " in tunnel: mixed pixels") ||
                names.contains(name + " in kvarntorp-loop: mixed pixels"))
        << name;
    EXPECT_EQ(content(folder / ("found/" + name + "-points.png")).substr(1, 3), "PNG");
    EXPECT_NE(page.find("src=\"" + name + "-points.png\""), std::string::npos);
  }
  for (const char* outside : {"http://", "https://", "<script"})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
}

}  // namespace
}  // namespace minescan
