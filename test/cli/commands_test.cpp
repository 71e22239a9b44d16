// SPDX-License-Identifier: MIT
// What users and scripts rely on: files, output and exit codes of every command.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/program.h"

namespace minescan {
namespace {

using Json = nlohmann::json;

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

// Rows of a result table by their ids; columns that hold measured times left out.
std::set<std::string> rows_without_times(const std::filesystem::path& folder,
                                         const std::string& db) {
  const ProgramResult csv = run_minescan({"export", db, "--csv", "-"}, folder);
  EXPECT_EQ(csv.exit_code, 0) << csv.errors;
  std::set<std::string> rows;
  std::vector<std::size_t> dropped;
  std::string head;
  for (std::size_t at = 0; at < csv.output.size();) {
    const std::size_t end = csv.output.find('\n', at);
    const std::string line = csv.output.substr(at, end - at);
    at = end + 1;
    // Fields in quotes hold commas and doubled quotes.
    std::vector<std::string> fields(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted)
        fields.emplace_back();
      else
        fields.back() += c;
    }
    std::string kept;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (head.empty() && (fields[i].ends_with("_s") || fields[i] == "run")) dropped.push_back(i);
      if (std::find(dropped.begin(), dropped.end(), i) == dropped.end()) kept += fields[i] + "|";
    }
    if (head.empty())
      head = kept;
    else
      rows.insert(kept);
  }
  EXPECT_EQ(dropped.size(), 5u) << "target_s, source_s, align_s, cpu_s and run";
  return rows;
}

TEST(Program, HelpsAndSaysItsVersion) {
  const ScratchFolder folder;
  EXPECT_EQ(run_minescan({"--version"}, folder).exit_code, 0);
  EXPECT_EQ(run_minescan({"--version"}, folder).output.substr(0, 9), "minescan ");
  const ProgramResult help = run_minescan({"--help"}, folder);
  EXPECT_EQ(help.exit_code, 0);
  for (const char* command : {"list", "scene", "survey", "register", "sweep", "merge", "export",
                              "report", "baseline", "check", "validate", "paper"}) {
    EXPECT_NE(help.output.find(command), std::string::npos) << command;
    const ProgramResult own = run_minescan({command, "--help"}, folder);
    EXPECT_EQ(own.exit_code, 0) << command;
    EXPECT_NE(own.output.find("Examples:"), std::string::npos) << command;
  }
}

TEST(List, ShowsEveryTable) {
  const ScratchFolder folder;
  const ProgramResult all = run_minescan({"list", "--json"}, folder);
  ASSERT_EQ(all.exit_code, 0) << all.errors;
  const Json json = Json::parse(all.output);
  for (const char* table :
       {"scenes", "scanners", "surveys", "methods", "metrics", "studies", "formats"}) {
    ASSERT_TRUE(json.contains(table)) << table;
    EXPECT_FALSE(json[table].empty()) << table;
    for (const Json& row : json[table]) EXPECT_NE(row["description"], "") << row["name"];
    EXPECT_EQ(run_minescan({"list", table}, folder).exit_code, 0) << table;
  }
  EXPECT_EQ(run_minescan({"list", "nonsense"}, folder).exit_code, 2);
}

TEST(Scene, WritesTheMeshAndItsConfiguration) {
  const ScratchFolder folder;
  for (const char* extension : {".ply", ".obj", ".stl"}) {
    const std::string file = std::string("junction") + extension;
    const ProgramResult result =
        run_minescan({"scene", "junction", "--set", "edge-length=0.5", "--out", file}, folder);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_GT(std::filesystem::file_size(folder / file), 10'000u);
  }
  // The configuration that is printed gives the same mesh, and can be edited.
  const ProgramResult config = run_minescan(
      {"scene", "junction", "--set", "edge-length=0.5", "--seed", "7", "--print-config"}, folder);
  ASSERT_EQ(config.exit_code, 0) << config.errors;
  write_text(folder / "mine.yaml", config.output);
  ASSERT_EQ(run_minescan({"scene", "mine.yaml", "--out", "a.ply"}, folder).exit_code, 0);
  ASSERT_EQ(run_minescan(
                {"scene", "junction", "--set", "edge-length=0.5", "--seed", "7", "--out", "b.ply"},
                folder)
                .exit_code,
            0);
  EXPECT_EQ(content(folder / "a.ply"), content(folder / "b.ply"));
  EXPECT_NE(content(folder / "a.ply"), content(folder / "junction.ply"))
      << "the seed changes nothing";
}

// A mine in a dozen lines.
const char* small_mine =
    "scene: mine\n"
    "edge-length: 0.4\n"
    "drifts:\n"
    "  main:  {line: [0 0, 20 0, 30 6 -0.5], width: 6, height: 4, arch: 1, end: concrete}\n"
    "  niche: {off: main, at: 8, side: left, length: 3, width: 3, height: 2.5}\n"
    "pillars:\n"
    "  p: {at: [14 0], length: 2, width: 1}\n"
    "things:\n"
    "  lights: {kind: light, drift: main, from: 4, to: 9, every: 5}\n"
    "wall-rms: 0.05\n"
    "floor-class: C\n";

TEST(Scene, IsAMineOfYourOwn) {
  const ScratchFolder folder;
  write_text(folder / "mine.yaml", small_mine);
  const ProgramResult made = run_minescan(
      {"scene", "mine.yaml", "--out", "a.ply", "--picture", "a.png", "--json", "a.json", "--check"},
      folder);
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  EXPECT_EQ(content(folder / "a.png").substr(1, 3), "PNG");
  const Json json = Json::parse(content(folder / "a.json"));
  EXPECT_TRUE(json["closed"].get<bool>());
  EXPECT_EQ(json["components"], 3) << "the rock and two lights";
  // The pillar is a hole through the rock's surface: 2 * 3 - 2.
  EXPECT_EQ(json["euler_characteristic"], 4);
  EXPECT_EQ(json["warnings"], Json::array());

  // What --print-config says makes the same mine.
  const ProgramResult printed = run_minescan({"scene", "mine.yaml", "--print-config"}, folder);
  ASSERT_EQ(printed.exit_code, 0) << printed.errors;
  EXPECT_NE(printed.output.find("line: 0 0 0, 20 0 0, 30 6 -0.5"), std::string::npos)
      << printed.output;
  write_text(folder / "again.yaml", printed.output);
  const ProgramResult again = run_minescan({"scene", "again.yaml", "--out", "b.ply"}, folder);
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(content(folder / "a.ply"), content(folder / "b.ply"));

  // Fewer triangles of the same mine.
  const ProgramResult fewer =
      run_minescan({"scene", "mine.yaml", "--decimate", "0.5", "--json", "-", "--check"}, folder);
  ASSERT_EQ(fewer.exit_code, 0) << fewer.errors;
  const Json less = Json::parse(fewer.output);
  EXPECT_TRUE(less["closed"].get<bool>());
  EXPECT_NEAR(less["triangles"].get<double>(), json["triangles"].get<double>() / 2,
              0.02 * json["triangles"].get<double>());
}

TEST(Scene, IsAnyMesh) {
  const ScratchFolder folder;
  ASSERT_EQ(run_minescan({"scene", "box", "--set", "edge-length=1", "--out", "box.obj"}, folder)
                .exit_code,
            0);
  const ProgramResult whole = run_minescan({"scene", "box.obj", "--json", "-"}, folder);
  ASSERT_EQ(whole.exit_code, 0) << whole.errors;
  EXPECT_TRUE(Json::parse(whole.output)["closed"].get<bool>());

  // Without its last triangle, rays may leave: that is said in the data.
  std::string text = content(folder / "box.obj");
  text.erase(text.rfind("\nf ") + 1);
  write_text(folder / "open.obj", text);
  const ProgramResult open = run_minescan({"scene", "open.obj", "--json", "-"}, folder);
  ASSERT_EQ(open.exit_code, 0) << open.errors;
  const Json json = Json::parse(open.output);
  EXPECT_FALSE(json["closed"].get<bool>());
  EXPECT_EQ(json["boundary_edges"], 3);
  EXPECT_EQ(json["warnings"].size(), 1U);

  // It can be scanned all the same, and the data set says what was scanned.
  const ProgramResult survey =
      run_minescan({"survey", "junction", "--set", "scene.name=open.obj", "--set",
                    "scene.parts.file.material=concrete", "--set", "stations.0.planes=20", "--set",
                    "stations.1.planes=20", "--out", "data"},
                   folder);
  ASSERT_EQ(survey.exit_code, 0) << survey.errors;
  EXPECT_EQ(Json::parse(content(folder / "data/scene.json")), json);
  EXPECT_NE(content(folder / "data/survey.yaml").find("file: open.obj"), std::string::npos);
}

TEST(Survey, WritesADataSetThatRegistersAndSweeps) {
  const ScratchFolder folder;
  const ProgramResult survey =
      run_minescan(joined({"survey", "junction", "--out", "data"}, small_survey()), folder);
  ASSERT_EQ(survey.exit_code, 0) << survey.errors;
  EXPECT_EQ(survey.errors, "");
  for (const char* file : {"survey.yaml", "truth.tum", "odometry.tum", "pairs.csv",
                           "scans/0000.ply", "scans/0001.ply"})
    EXPECT_TRUE(std::filesystem::exists(folder / "data" / file)) << file;
  EXPECT_EQ(lines(content(folder / "data/truth.tum")), 3u);
  EXPECT_EQ(lines(content(folder / "data/pairs.csv")), 2u);

  // The written configuration makes the same bytes, with another number of threads too.
  write_text(folder / "again.yaml", content(folder / "data/survey.yaml"));
  ASSERT_EQ(
      run_minescan({"survey", "again.yaml", "--out", "again", "--threads", "1"}, folder).exit_code,
      0);
  for (const char* file :
       {"truth.tum", "odometry.tum", "pairs.csv", "scans/0000.ply", "scans/0001.ply"})
    EXPECT_EQ(content(folder / "data" / file), content(folder / "again" / file)) << file;

  const ProgramResult registered = run_minescan(
      {"register", "data/scans/0000.ply", "data/scans/0001.ply", "--method", "icp", "--guess",
       "0.3,0,0,0,0,0,1", "--truth", "0,0,0,0,0,0,1", "--json", "-", "--out", "moved.ply"},
      folder);
  ASSERT_EQ(registered.exit_code, 0) << registered.errors;
  const Json json = Json::parse(registered.output);
  for (const char* key : {"method", "status", "T_target_source", "iterations", "evaluations",
                          "score", "target_points", "source_points", "used_points", "empty_points",
                          "outside_points", "directions", "time_s", "cpu_s", "target_bytes",
                          "covariance", "translation_error_m", "rotation_error_rad"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["status"], "converged");
  // A good result of the paper's section 5.2.2.
  EXPECT_LT(json["translation_error_m"].get<double>(), 0.1);
  EXPECT_TRUE(std::filesystem::exists(folder / "moved.ply"));

  const ProgramResult sweep = run_minescan(
      {"sweep", "gate", "--set", "survey=data", "--trials", "2", "--out", "r.db"}, folder);
  EXPECT_EQ(sweep.exit_code, 0) << sweep.errors;

  // An existing folder is refused, and what is no survey is not replaced even when forced.
  EXPECT_EQ(run_minescan({"survey", "junction", "--out", "data"}, folder).exit_code, 1);
  std::filesystem::create_directory(folder / "mine");
  write_text(folder / "mine/thesis.tex", "years of work");
  EXPECT_EQ(run_minescan(joined({"survey", "junction", "--out", "mine", "--force"}, small_survey()),
                         folder)
                .exit_code,
            1);
  EXPECT_EQ(content(folder / "mine/thesis.tex"), "years of work");
}

TEST(Register, TellsWhatHoldsThePose) {
  const ScratchFolder folder;
  ASSERT_EQ(run_minescan(joined({"survey", "junction", "--out", "data"}, small_survey()), folder)
                .exit_code,
            0);
  const std::vector<std::string> command = {"register", "data/scans/0000.ply",
                                            "data/scans/0001.ply", "--axis", "1,0,0"};
  const ProgramResult text = run_minescan(command, folder);
  EXPECT_NE(text.output.find("held least: "), std::string::npos) << text.output;
  const Json json = Json::parse(run_minescan(joined(command, {"--json", "-"}), folder).output);
  for (const char* key : {"evaluations", "empty_points", "outside_points"})
    EXPECT_TRUE(json.contains(key)) << key;
  ASSERT_EQ(json["directions"].size(), 6u);
  EXPECT_LT(json["directions"][0]["hold"], json["directions"][5]["hold"]);
  EXPECT_FALSE(json["directions"][0]["name"].get<std::string>().empty());
  for (const char* axis : {"1,0", "0,0,1", "a,b,c"})
    EXPECT_EQ(
        run_minescan({"register", "data/scans/0000.ply", "data/scans/0001.ply", "--axis", axis},
                     folder)
            .exit_code,
        2)
        << axis;
}

TEST(Sweep, TakesProgramsAndSeveralSurveys) {
  const ScratchFolder folder;
  for (const char* name : {"one", "two"})
    ASSERT_EQ(run_minescan(joined({"survey", "junction", "--out", name}, small_survey()), folder)
                  .exit_code,
              0);
  write_text(folder / "stay.yaml", "name: stay\ncommand: [cat, '{guess}']\n");
  write_text(folder / "crash.yaml", "name: crash\ncommand: ['false']\n");
  const std::vector<std::string> study = {"sweep",    "gate", "--set", "survey=one, two:0",
                                          "--trials", "2",    "--set", "methods=ndt,stay.yaml"};
  ASSERT_EQ(run_minescan(joined(study, {"--out", "r.db"}), folder).exit_code, 0);
  const ProgramResult table = run_minescan({"export", "r.db", "--markdown", "-"}, folder);
  for (const char* row :
       {"| one/0 | ndt |", "| one/0 | stay |", "| two/0 | ndt |", "| two/0 | stay |"})
    EXPECT_NE(table.output.find(row), std::string::npos) << row << " in\n" << table.output;

  // What it prints can be given back, and finds everything done.
  const ProgramResult config = run_minescan(joined(study, {"--print-config"}), folder);
  ASSERT_EQ(config.exit_code, 0) << config.errors;
  write_text(folder / "again.yaml", config.output);
  const ProgramResult again = run_minescan({"sweep", "again.yaml", "--out", "r.db"}, folder);
  EXPECT_EQ(again.exit_code, 0) << again.errors << config.output;
  EXPECT_NE(again.output.find("8 were there, 0 run now"), std::string::npos) << again.output;

  // A program that fails is its trials' affair; the others are run.
  const ProgramResult crash = run_minescan({"sweep", "gate", "--set", "survey=one", "--trials", "2",
                                            "--set", "methods=ndt,crash.yaml", "--out", "c.db"},
                                           folder);
  EXPECT_EQ(crash.exit_code, 1);
  EXPECT_NE(crash.output.find("4 run now, 2 of them threw"), std::string::npos) << crash.output;
  EXPECT_EQ(run_minescan(
                {"register", "one/scans/0000.ply", "one/scans/0001.ply", "--method", "crash.yaml"},
                folder)
                .exit_code,
            1);
  for (const char* survey : {"survey=one:7", "survey=one:x", "survey=one,nothing"})
    EXPECT_EQ(run_minescan({"sweep", "gate", "--set", survey, "--out", "n.db"}, folder).exit_code,
              2)
        << survey;
  EXPECT_EQ(run_minescan({"export", "r.db"}, folder).exit_code, 2);
}

// A scanner of one's own is a row and what differs from it, for stations that are there and new
// ones.
TEST(Survey, TakesAScannerFromAFile) {
  const ScratchFolder folder;
  write_text(folder / "mine.yaml", "scanner: ideal-yawing\nplane-beams: 30\nplanes: 20\n");
  const ProgramResult survey =
      run_minescan({"survey", "junction", "--set", "scene.edge-length=0.3", "--set",
                    "stations.0.scanner=mine.yaml", "--set", "stations.1.scanner=mine.yaml",
                    "--set", "stations.1.planes=10", "--set", "stations.2.scanner=mine.yaml",
                    "--set", "stations.2.pose=1,0,2,0,0,0,1", "--out", "data"},
                   folder);
  ASSERT_EQ(survey.exit_code, 0) << survey.errors;
  for (const char* line : {"0000.ply: 600 points of 600 beams", "0001.ply: 300 points of 300 beams",
                           "0002.ply: 600 points of 600 beams"})
    EXPECT_NE(survey.output.find(line), std::string::npos) << survey.output;
  // The folder says it all, without the file.
  EXPECT_NE(content(folder / "data/survey.yaml").find("plane-beams: 30"), std::string::npos);
  write_text(folder / "mine.yaml", "plane-beams: 30\n");
  const ProgramResult bad = run_minescan(
      {"survey", "junction", "--set", "stations.0.scanner=mine.yaml", "--out", "a"}, folder);
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.errors.find("mine.yaml: expected a key 'scanner'"), std::string::npos)
      << bad.errors;
}

// The clouds of every format register like the data set itself.
TEST(Survey, WritesForOtherProgramsToo) {
  const ScratchFolder folder;
  EXPECT_EQ(run_minescan({"survey", "junction", "--out", "a", "--format", "pcd,nonsense"}, folder)
                .exit_code,
            2);
  EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  std::string formats;
  const Json list = Json::parse(run_minescan({"list", "formats", "--json"}, folder).output);
  for (const Json& row : list["formats"])
    if (const std::string name = row["name"]; name[0] != '.')
      formats += (formats.empty() ? "" : ",") + name;
  EXPECT_EQ(formats, "pcd,las,npy,uos,uosr,kitti,benchmark");
  const ProgramResult survey = run_minescan(
      joined({"survey", "junction", "--out", "data", "--format", formats}, small_survey()), folder);
  ASSERT_EQ(survey.exit_code, 0) << survey.errors;
  for (const char* file : {"kitti/poses.txt", "kitti/times.txt", "benchmark/junction_local.txt",
                           "uos/scan001.pose", "npy/columns.txt"})
    EXPECT_TRUE(std::filesystem::exists(folder / "data" / file)) << file;
  for (const auto& [target, source] :
       {std::pair{"pcd/0000.pcd", "pcd/0001.pcd"}, std::pair{"las/0000.las", "las/0001.las"},
        std::pair{"npy/0000.npy", "npy/0001.npy"}, std::pair{"uos/scan000.3d", "uosr/scan001.3d"},
        std::pair{"kitti/velodyne/000000.bin", "scans/0001.ply"},
        std::pair{"benchmark/0000.pcd", "benchmark/0001.pcd"}}) {
    const ProgramResult registered = run_minescan(
        {"register", std::string("data/") + target, std::string("data/") + source, "--method",
         "icp", "--guess", "0.3,0,0,0,0,0,1", "--truth", "0,0,0,0,0,0,1", "--json", "-"},
        folder);
    ASSERT_EQ(registered.exit_code, 0) << registered.errors;
    // A good result of the paper's section 5.2.2.
    EXPECT_LT(Json::parse(registered.output)["translation_error_m"].get<double>(), 0.1) << target;
  }
}

TEST(Sweep, GivesTheSamePosesForAnyThreadsShardsAndResumes) {
  const ScratchFolder folder;
  const auto sweep = [&](const std::vector<std::string>& more) {
    return run_minescan(
        joined({"sweep", "fig16", "--trials", "5", "--axis", "initial-translation=0.5,1"},
               joined(small_study(), more)),
        folder);
  };
  ASSERT_EQ(sweep({"--out", "a.db", "--threads", "1"}).exit_code, 0);
  ASSERT_EQ(sweep({"--out", "b.db", "--threads", "2"}).exit_code, 0);
  const std::set<std::string> expected = rows_without_times(folder, "a.db");
  EXPECT_EQ(expected.size(), 2u * 2 * 5) << "levels, methods, starts";
  EXPECT_EQ(rows_without_times(folder, "b.db"), expected);

  ASSERT_EQ(sweep({"--out", "1.db", "--shard", "1/2"}).exit_code, 0);
  ASSERT_EQ(sweep({"--out", "2.db", "--shard", "2/2"}).exit_code, 0);
  ASSERT_EQ(run_minescan({"merge", "c.db", "1.db", "2.db"}, folder).exit_code, 0);
  EXPECT_EQ(rows_without_times(folder, "c.db"), expected);

  // A second run finds everything done.
  const ProgramResult again = sweep({"--out", "a.db"});
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_NE(again.output.find("20 were there, 0 run now"), std::string::npos) << again.output;
}

TEST(Sweep, GoesOnAfterAKill) {
  const ScratchFolder folder;
  const std::vector<std::string> command = joined(
      {"sweep", "fig16", "--trials", "600", "--axis", "initial-translation=1"}, small_study());
  ASSERT_EQ(run_minescan(joined(command, {"--out", "whole.db"}), folder).exit_code, 0);
  // Rows are written about once a second; while they are, there is a journal beside the table.
  const std::uintmax_t some_rows = std::filesystem::file_size(folder / "whole.db") / 10;
  const bool killed = run_and_kill(joined(command, {"--out", "part.db"}), folder, [&] {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(folder / "part.db", error);
    return !error && size > some_rows && !std::filesystem::exists(folder / "part.db-journal");
  });
  ASSERT_TRUE(killed) << "the sweep ended before it could be killed";
  const std::size_t kept = rows_without_times(folder, "part.db").size();
  EXPECT_GT(kept, 0u);
  EXPECT_LT(kept, 1200u) << "there was nothing left to resume";
  ASSERT_EQ(run_minescan(joined(command, {"--out", "part.db"}), folder).exit_code, 0);
  EXPECT_EQ(rows_without_times(folder, "part.db"), rows_without_times(folder, "whole.db"));
}

TEST(Report, IsOnePageWithoutNetwork) {
  const ScratchFolder folder;
  ASSERT_EQ(run_minescan(joined({"sweep", "gate", "--trials", "3", "--out", "r.db"}, small_study()),
                         folder)
                .exit_code,
            0);
  const ProgramResult report = run_minescan({"report", "r.db", "--out", "page", "--svg"}, folder);
  ASSERT_EQ(report.exit_code, 0) << report.errors;
  EXPECT_NE(report.output.find("page/index.html"), std::string::npos);
  const std::string page = content(folder / "page/index.html");
  EXPECT_GT(page.size(), 100'000u);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("<link"), std::string::npos);
  std::size_t figures = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder / "page"))
    if (file.path().extension() == ".svg") ++figures;
  EXPECT_EQ(figures, 3u) << "translation, rotation, time";
}

TEST(Check, TellsBetterFromWorseByItsExitCode) {
  const ScratchFolder folder;
  const auto sweep = [&](const std::string& db, const std::vector<std::string>& more) {
    return run_minescan(joined({"sweep", "gate", "--trials", "20", "--out", db},
                               joined(small_study(), more)),
                        folder)
        .exit_code;
  };
  const auto check = [&](const std::string& db) {
    return run_minescan({"check", db, "--baseline", "base.json"}, folder);
  };
  ASSERT_EQ(sweep("base.db", {}), 0);
  EXPECT_EQ(run_minescan({"baseline", "base.db", "--out", "base.json"}, folder).exit_code, 2)
      << "a reason is required";
  ASSERT_EQ(run_minescan({"baseline", "base.db", "--out", "base.json", "--reason", "first"}, folder)
                .exit_code,
            0);
  EXPECT_EQ(check("base.db").exit_code, 0);

  // Other trials are no evidence.
  ASSERT_EQ(sweep("other.db", {"--seed", "2"}), 0);
  EXPECT_EQ(check("other.db").exit_code, 4);
  EXPECT_EQ(run_minescan({"check", "base.db", "--baseline", "none.json"}, folder).exit_code, 4);

  const ProgramResult files =
      run_minescan({"check", "base.db", "--baseline", "base.json", "--junit", "c.xml", "--markdown",
                    "c.md", "--json", "c.json"},
                   folder);
  EXPECT_EQ(files.exit_code, 0) << files.errors;
  EXPECT_NE(content(folder / "c.xml").find("<testsuite"), std::string::npos);
  EXPECT_TRUE(Json::accept(content(folder / "c.json")));
  EXPECT_NE(content(folder / "c.md"), "");
}

}  // namespace
}  // namespace minescan
