// SPDX-License-Identifier: MIT
// What test/formats/foreign.py and foreign.mjs compare other programs' readers and writers with:
//
//   foreign write DIR   the files of every data-set format and of every cloud format (as cloud.ply,
//                       ...) for example scans 0 (one return per beam) and 1 (up to two), and 0.txt
//                       and 1.txt: the columns of print_scan as text under a line of their names
//   foreign read FILE   prints the points of a cloud, "x y z" per line
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "core/output_file.h"
#include "core/text.h"
#include "formats/cloud_file.h"
#include "formats/data_set_formats.h"
#include "formats/scan_columns.h"
#include "test/formats/example_scan.h"

namespace minescan {
namespace {

std::string text_of(const Scan& scan) {
  const std::vector<ScanColumn> columns = scan_columns(scan);
  std::string text;
  for (const ScanColumn& column : columns) text += std::string(column.name) + " ";
  text += "\n";
  for (std::size_t i = 0; i < scan.cloud.points.size(); ++i) {
    for (const ScanColumn& column : columns) {
      char bytes[sizeof(double)];
      column.write(scan, i, bytes);
      text += number_text(load_number(bytes, column.type, false)) + " ";
    }
    text += "\n";
  }
  return text;
}

void write(const std::filesystem::path& folder) {
  std::filesystem::remove_all(folder);
  for (std::size_t k = 0; k < 2; ++k) {
    const Scan scan = example_scan(k == 1);
    for (const DataSetFormat& format : data_set_formats())
      for (const DataSetFile& file : format.scan_files(k, scan)) {
        std::filesystem::create_directories((folder / file.path).parent_path());
        write_file(folder / file.path, file.bytes);
      }
    std::filesystem::create_directories(folder / "scans");
    write_file(folder / scan_file(k), print_scan(scan));
    write_file(folder / (std::to_string(k) + ".txt"), text_of(scan));
  }
  for (const CloudFormat& format : cloud_formats())
    write_cloud(folder / ("cloud" + format.extension), example_scan(false).cloud);
}

void read(const std::filesystem::path& file) {
  for (const Eigen::Vector3d& p : read_cloud(file).cloud.points)
    std::printf("%.17g %.17g %.17g\n", p.x(), p.y(), p.z());
}

}  // namespace
}  // namespace minescan

int main(int count, char** words) {
  try {
    if (count != 3) throw std::invalid_argument("usage: foreign write DIR | foreign read FILE");
    std::string(words[1]) == "write" ? minescan::write(words[2]) : minescan::read(words[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "foreign: %s\n", error.what());
    return 1;
  }
}
