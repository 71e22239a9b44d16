// SPDX-License-Identifier: MIT
// Whatever is wrong gets one clear line, the right exit code, and leaves nothing half-written.
#include <gtest/gtest.h>

#include <algorithm>

#include "cli/program.h"

namespace minescan {
namespace {

struct Case {
  std::vector<std::string> arguments;
  int exit_code;
  std::string says;  // part of the line
};

void expect_refused(const Case& c, const ScratchFolder& folder) {
  const std::vector<std::string> before = folder.names();
  const ProgramResult result = run_minescan(c.arguments, folder);
  std::string command;
  for (const std::string& a : c.arguments) command += a + " ";
  EXPECT_EQ(result.exit_code, c.exit_code) << command << result.errors;
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << command << "\n"
                                                                             << result.errors;
  EXPECT_NE(result.errors.find(c.says), std::string::npos) << command << "\n" << result.errors;
  EXPECT_EQ(result.output, "") << command;
  EXPECT_EQ(folder.names(), before) << command << "left something behind";
}

TEST(BadInput, OfNames) {
  const ScratchFolder folder;
  for (const Case& c : std::vector<Case>{
           {{}, 2, "subcommand"},
           {{"dig"}, 2, "unknown command 'dig'; known: list, "},
           {{"scene", "cave", "--out", "a.ply"}, 2, "unknown scene 'cave'; known: "},
           {{"scene", "junction", "--out", "a.txt"}, 2, ".stl"},
           {{"scene", "junction"}, 2, "expected --out, --picture or --json"},
           {{"scene", "junction", "--picture", "a.jpg"},
            2,
            "a.jpg: expected a name ending in .png"},
           {{"scene", "junction", "--out", "a.ply", "--decimate", "2"},
            2,
            "--decimate = '2': expected a number in (0, 1]"},
           {{"scene", "junction", "--picture", "a.png", "--width", "9"}, 2, "--width = '9'"},
           {{"scene", "junction", "--out", "a.ply", "--colour", "red"}, 2, "--colour"},
           {{"survey", "cave", "--out", "a"}, 2, "unknown survey 'cave'; known: "},
           {{"sweep", "cave", "--out", "a.db"}, 2, "unknown study 'cave'; known: "},
           {{"sweep", "fig16", "--set", "methods=icp,magic", "--out", "a.db"}, 2, "magic"},
           {{"register", "a.ply", "b.ply", "--method", "magic"},
            2,
            "unknown method 'magic'; known: "},
           {{"scene", "junction", "--set", "edge=1", "--out", "a.ply"},
            2,
            "--set: unknown key 'edge'; known: "},
           {{"scene", "junction", "--set", "edge-length", "--out", "a.ply"},
            2,
            "expected key=value"},
           {{"scene", "none.yaml", "--out", "a.ply"}, 1, "none.yaml: cannot be read"},
           {{"validate"}, 2, "--out"},
           {{"validate", "--out", "a", "--quick"}, 2, "--quick"},
           {{"validate", "--out", "a", "--set", "seed=2"}, 2, "validate: takes no --set"},
           {{"list", "--threads", "0"}, 2, "--threads"},
           {{"list", "--seed", "one"}, 2, "--seed"},
       })
    expect_refused(c, folder);
}

TEST(BadInput, OfFoldersThatAreThere) {
  const ScratchFolder folder;
  write_text(folder / "a.txt", "mine");
  std::filesystem::create_directory(folder / "b");
  for (const std::string name : {"a.txt", "b"})
    expect_refused({{"validate", "--out", name}, 1, name}, folder);
  EXPECT_EQ(content(folder / "a.txt"), "mine");
}

TEST(BadInput, OfSizes) {
  const ScratchFolder folder;
  for (const char* size : {"0", "-1", "1e9", "1e-9", "nan", "inf", "big", ""}) {
    const std::string text = size;
    expect_refused(
        {{"scene", "junction", "--set", "edge-length=" + text, "--out", "a.ply"}, 2, "edge-length"},
        folder);
    expect_refused({{"survey", "junction", "--set", "scene.edge-length=" + text, "--out", "a"},
                    2,
                    "edge-length"},
                   folder);
    expect_refused(
        {{"survey", "junction", "--set", "stations.0.planes=" + text, "--out", "a"}, 2, "planes"},
        folder);
    expect_refused({{"sweep", "fig16", "--trials", text, "--out", "a.db"}, 2, "trials"}, folder);
    expect_refused({{"sweep", "fig16", "--set", "settings.ndt.cell-size=" + text, "--out", "a.db"},
                    2,
                    "cell-size"},
                   folder);
  }
}

TEST(BadInput, OfConfigurations) {
  const ScratchFolder folder;
  const auto refuse = [&](const std::string& yaml, const std::string& says) {
    write_text(folder / "a.yaml", yaml);
    expect_refused({{"scene", "a.yaml", "--out", "a.ply"}, 2, says}, folder);
  };
  refuse("", "a.yaml: expected 'key: value' lines");
  refuse("scene: junction\nedge-length: -1\n", "a.yaml:2: edge-length: expected a number");
  refuse("scene: junction\n\nlenght: 5\n", "a.yaml:3: unknown key 'lenght'; known: ");
  refuse("scene: cave\n", "unknown scene 'cave'");
  refuse("edge-length: 1\n", "expected a key 'scene'");
  refuse("scene: [junction\n", "not YAML");
  refuse(std::string("\x80\x02\x00\xff", 4), "a.yaml");
}

TEST(BadInput, OfMines) {
  const ScratchFolder folder;
  const auto refuse = [&](const std::string& drifts, const std::string& says) {
    write_text(folder / "a.yaml", "scene: mine\nedge-length: 0.5\n" + drifts);
    expect_refused({{"scene", "a.yaml", "--out", "a.ply"}, 2, says}, folder);
  };
  refuse("", "mine: expected at least one drift");
  refuse("drifts:\n  a: {width: 5}\n", "drift 'a': expected a line of 2 points or more");
  refuse("drifts:\n  a: {line: [0 0, 9 0], width: 0}\n",
         "a.yaml:4: drifts.a.width: expected a number in [1, 50], found '0' (unit: m)");
  refuse("drifts:\n  a: {line: [0 0, 9 x]}\n", "a.yaml:4: drifts.a.line: expected");
  refuse("drifts:\n  a: {line: [0 0, 9 0], wdith: 4}\n", "unknown key 'drifts.a.wdith'; known: ");
  refuse("drifts:\n  a: {off: a}\n", "drift 'a': leaves itself");
  refuse("drifts:\n  a: {line: [0 0, 9 0, 0 1]}\n", "drift 'a': turns back on itself");
  refuse("drifts:\n  a: {line: [0 0, 40 0]}\n  b: {line: [20 -20 1, 20 20 1]}\n",
         "drift 'a': meets 'b' near (20, 0) on another level");
  refuse("drifts:\n  a: {line: [0 0, 40 0]}\nthings:\n  l: {kind: lamp, drift: a}\n",
         "unknown thing 'lamp'; known: ");
  refuse("drifts:\n  a: {line: [0 0, 40 0]}\nthings:\n  l: {drift: b}\n", "'b'");
  expect_refused({{"scene", "room-and-pillar", "--set", "edge-length=0.01", "--set", "columns=40",
                   "--out", "a.ply"},
                  2,
                  "GiB of memory; expected at most"},
                 folder);
  expect_refused({{"survey", "room-and-pillar", "--set", "scene.edge-length=0.01", "--out", "a"},
                  2,
                  "MiB: use longer edges"},
                 folder);
}

TEST(BadInput, OfMeshes) {
  const ScratchFolder folder;
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  write_text(folder / "good.obj", triangle);
  write_text(folder / "nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_text(folder / "index.obj", "v 0 0 0\nf 1 2 3\n");
  write_text(folder / "empty.ply", "");
  write_text(folder / "truncated.ply",
             "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float "
             "x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int "
             "vertex_indices\nend_header\n1234");
  write_text(folder / "rubbish.stl", std::string(200, '\xa5'));
  for (const std::string file :
       {"nan.obj", "index.obj", "empty.ply", "truncated.ply", "rubbish.stl", "missing.ply"})
    expect_refused({{"scene", file, "--json", "a.json"}, 1, file}, folder);
  expect_refused({{"scene", "good.obj", "--set", "parts.file.material=jelly", "--json", "a.json"},
                  2,
                  "unknown material 'jelly'; known: "},
                 folder);
  expect_refused({{"scene", "good.obj", "--set", "groups.rock=steel", "--json", "a.json"},
                  2,
                  "unknown group 'rock'"},
                 folder);
}

TEST(BadInput, OfClouds) {
  const ScratchFolder folder;
  write_text(folder / "good.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 0 1\n0 1 1\n1 1 1\n");
  const std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 100\nproperty float x\nproperty float "
      "y\nproperty float z\nend_header\n";
  write_text(folder / "empty.ply", "");
  write_text(folder / "truncated.ply", ply + "1234");
  write_text(folder / "garbage.ply", std::string("\xde\xad\xbe\xef\x00\x01\x02", 7));
  write_text(folder / "garbage.pcd", std::string(5000, '\xa5'));
  write_text(folder / "nan.xyz", "nan nan nan\nnan 0 0\n");
  write_text(folder / "none.xyz", "# nothing\n");
  const auto refuse = [&](const std::string& file, int exit_code, const std::string& says) {
    expect_refused(
        {{"register", "good.xyz", file, "--json", "a.json", "--out", "a.ply"}, exit_code, says},
        folder);
    expect_refused(
        {{"register", file, "good.xyz", "--json", "a.json", "--out", "a.ply"}, exit_code, says},
        folder);
  };
  refuse("empty.ply", 1, "empty.ply:");
  refuse("truncated.ply", 1, "truncated.ply: expected 100 elements vertex of 12 bytes");
  refuse("garbage.ply", 1, "garbage.ply:1: expected 'ply'");
  refuse("garbage.pcd", 1, "garbage.pcd:1:");
  refuse("nan.xyz", 1, "nan.xyz: none of its 2 points has three finite coordinates");
  refuse("none.xyz", 1, "none.xyz: expected points, found none");
  refuse("missing.ply", 1, "missing.ply: cannot be read");
  refuse("good.doc", 2, "unknown format '.doc'; known: .ply, .pcd, .xyz");
  expect_refused({{"register", "good.xyz", "good.xyz", "--guess", "1,2"}, 2, "expected a pose"},
                 folder);
  expect_refused({{"register", "good.xyz", "good.xyz", "--guess", "good.xyz"}, 1, "good.xyz: "},
                 folder);
}

TEST(BadInput, OfPlacesToWriteTo) {
  const ScratchFolder folder;
  write_text(folder / "file", "x");
  write_text(folder / "rubbish.db", std::string(9000, 'x'));
  for (const Case& c : std::vector<Case>{
           {{"scene", "junction", "--set", "edge-length=1", "--out", "no/a.ply"}, 1, "no/a.ply"},
           {{"survey", "junction", "--out", "file"}, 1, "file"},
           {joined({"survey", "junction", "--out", "/proc/a"}, small_survey()), 1, "/proc/a"},
           {{"sweep", "gate", "--out", "no/a.db"}, 1, "no/a.db"},
           {{"sweep", "gate", "--out", "rubbish.db"}, 1, "rubbish.db"},
           {{"export", "missing.db", "--csv", "a.csv"}, 1, "missing.db"},
           {{"export", "rubbish.db", "--csv", "a.csv"}, 1, "rubbish.db"},
           {{"report", "rubbish.db", "--out", "page"}, 1, "rubbish.db"},
           {{"baseline", "rubbish.db", "--out", "b.json", "--reason", "x"}, 1, "rubbish.db"},
           {{"merge", "out.db", "rubbish.db"}, 1, "rubbish.db"},
           {{"paper", "--out", "file"}, 1, "file"},
       })
    expect_refused(c, folder);
  EXPECT_EQ(content(folder / "rubbish.db"), std::string(9000, 'x'));
}

}  // namespace
}  // namespace minescan
