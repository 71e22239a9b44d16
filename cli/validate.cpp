// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "cli/command.h"
#include "cli/progress.h"
#include "cli/validate_mines.h"
#include "cli/validation_page.h"
#include "core/output_file.h"
#include "core/text.h"
#include "formats/png.h"
#include "sim/validation.h"

namespace minescan {
namespace {

void write_picture(const std::filesystem::path& folder, const std::string& name,
                   const Picture& picture) {
  write_file(folder / name, print_png(picture.width, picture.height, picture.rgb));
}

int run(const std::string& out, const Common& common) {
  if (!common.set.empty())
    throw std::invalid_argument("validate: takes no --set; it measures the scanners as they are");
  const std::uint64_t seed = common.seed.value_or(1);
  OutputFolder output(out, false);
  const std::filesystem::path& folder = output.temporary_path();

  std::vector<Finding> findings;
  std::vector<PagePicture> pictures;
  std::size_t done = 0;
  Progress progress("measuring", validation_rows().size() + rock_rows().size() + scanners().size(),
                    common.quiet);
  for (const auto* rows : {&validation_rows(), &rock_rows()})
    for (const ValidationRow& row : *rows) {
      findings.push_back({row.expected, row.measure(seed)});
      progress.update(++done);
    }
  scan_presets(seed, [&](const PresetScan& preset) {
    findings.insert(findings.end(), preset.findings.begin(), preset.findings.end());
    const std::string where = preset.scanner + " in " + preset.scene;
    pictures.push_back({preset.scanner + "-points.png", where + ": the measured points"});
    write_picture(folder, pictures.back().file, preset.points);
    if (preset.grid.width > 0) {
      pictures.push_back(
          {preset.scanner + "-grid.png", where + ": amplitude and range, beam by beam"});
      write_picture(folder, pictures.back().file, preset.grid);
    }
    progress.update(++done);
  });

  write_file(folder / "validation.json", findings_json(findings, seed));
  write_file(folder / "index.html", findings_page(findings, pictures, seed));
  output.commit();
  fmt::print("{}", findings_text(findings));
  std::vector<std::string> failed;
  for (const Finding& f : findings)
    if (verdict(f) == Verdict::fail) failed.push_back(f.expected.name);
  if (!failed.empty())
    throw std::runtime_error("validate: not as published: " + join(failed, "; "));
  return exit_done;
}

}  // namespace

Command validate_command() {
  const auto out = std::make_shared<std::string>();
  return {.name = "validate",
          .summary = "measure simulated scanners, beside what is published of real ones",
          .examples =
              "  minescan validate --out validation\n"
              "  minescan validate --out validation-2 --seed 2\n"
              "Writes index.html, validation.json and pictures; ends with 1 if a figure is not as\n"
              "published.\n",
          .arguments = {{"--out", "DIR", "the folder to write", true, out.get()}},
          .run = [out](const Common& common) { return run(*out, common); }};
}

}  // namespace minescan
