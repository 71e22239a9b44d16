// SPDX-License-Identifier: MIT
#include "formats/registration_benchmark.h"

#include <fmt/format.h>

#include <iterator>
#include <stdexcept>

namespace minescan {

std::filesystem::path benchmark_cloud(std::size_t index) { return fmt::format("{:04}.pcd", index); }

std::string print_benchmark_problems(const std::vector<DataSetPair>& pairs,
                                     const std::vector<Pose>& T_world_scanner) {
  std::string text = "id source target overlap t1 t2 t3 t4 t5 t6 t7 t8 t9 t10 t11 t12\n";
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const DataSetPair& pair = pairs[k];
    fmt::format_to(std::back_inserter(text), "{:04} {} {} {:.2f}", k,
                   benchmark_cloud(pair.source).string(), benchmark_cloud(pair.target).string(),
                   pair.overlap);
    const Pose misplaced =
        T_world_scanner.at(pair.target) * pair.guess * T_world_scanner.at(pair.source).inverse();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        fmt::format_to(std::back_inserter(text), " {}", misplaced(row, column));
    text += '\n';
  }
  return text;
}

double benchmark_error(const std::vector<Eigen::Vector3d>& source, const Pose& truth,
                       const Pose& estimate) {
  if (source.empty()) throw std::invalid_argument("benchmark_error: expected points, found none");
  const auto count = static_cast<double>(source.size());
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : source) centroid += p / count;
  double sum = 0;
  for (const Eigen::Vector3d& p : source)
    sum += (estimate * p - truth * p).norm() / (p - centroid).norm();
  return sum / count;
}

}  // namespace minescan
