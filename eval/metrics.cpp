// SPDX-License-Identifier: MIT
#include "eval/metrics.h"

#include "core/table.h"

namespace minescan {

const std::vector<Metric>& metrics() {
  // The limits are those of section 5.2.2 of the paper.
  static const std::vector<Metric> table = {
      {"translation_error_m", "distance between estimated and true position",
       "Translation error [m]", 0.10, 0.20, [](const Outcome& o) { return o.error.translation; }},
      {"rotation_error_rad", "angle between estimated and true orientation", "Rotation error [rad]",
       0.005, 0.010, [](const Outcome& o) { return o.error.rotation; }},
      {"time_s", "wall time of preparing both clouds and aligning them", "Time [s]", 0, 0,
       [](const Outcome& o) {
         return o.result.time.target + o.result.time.source + o.result.time.align;
       }},
      {"axial_error_m", "signed position error along the line from target to source scanner",
       "Axial error [m]", 0, 0, [](const Outcome& o) { return o.axial_error; }},
      {"iterations", "iterations until the method stopped", "Iterations", 0, 0,
       [](const Outcome& o) { return static_cast<double>(o.result.iterations); }},
      {"cpu_s", "processor time of preparing both clouds and aligning them", "Processor time [s]",
       0, 0, [](const Outcome& o) { return o.result.cpu; }},
      {"target_bytes", "memory of the prepared target", "Memory [bytes]", 0, 0,
       [](const Outcome& o) { return static_cast<double>(o.result.target_bytes); }},
  };
  return table;
}

const Metric& find_metric(const std::string& name) { return find_row(metrics(), "metric", name); }

}  // namespace minescan
