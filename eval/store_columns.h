// SPDX-License-Identifier: MIT
// The columns of a result table, each listed once: its tables, writing, reading and export are
// derived from these lists.
#pragma once

namespace minescan {

/// Calls visit(name, value) for every value of an outcome. The id stands before these columns, the
/// number of the run after them.
template <class Row, class Visit>
void columns(Row& o, Visit&& visit) {
  visit("study", o.trial.study);
  visit("pair", o.trial.pair);
  visit("origin", o.trial.origin);
  visit("method", o.trial.method);
  visit("settings", o.trial.settings);
  visit("axes", o.trial.axes);
  visit("initial_translation_m", o.trial.initial_translation);
  visit("initial_rotation_rad", o.trial.initial_rotation);
  visit("start", o.trial.start);
  visit("starts", o.trial.starts);
  visit("seed", o.trial.seed);
  visit("status", o.result.status);
  visit("translation_error_m", o.error.translation);
  visit("rotation_error_rad", o.error.rotation);
  visit("axial_error_m", o.axial_error);
  visit("iterations", o.result.iterations);
  visit("evaluations", o.result.evaluations);
  visit("score", o.result.score);
  visit("target_points", o.result.target_points);
  visit("source_points", o.result.source_points);
  visit("used_points", o.result.used_points);
  visit("empty_points", o.result.empty_points);
  visit("outside_points", o.result.outside_points);
  visit("target_s", o.result.time.target);
  visit("source_s", o.result.time.source);
  visit("align_s", o.result.time.align);
  visit("cpu_s", o.result.cpu);
  visit("target_bytes", o.result.target_bytes);
  visit("T_target_source", o.result.T_target_source.matrix());
  visit("covariance", o.result.covariance);
  visit("message", o.message);
}

/// The same for a row of table `runs`.
template <class Row, class Visit>
void run_columns(Row& run, Visit&& visit) {
  visit("version", run.version);
  visit("command_line", run.command_line);
  visit("machine", run.machine);
  visit("threads", run.threads);
  visit("started", run.started);
  visit("finished", run.finished);
}

}  // namespace minescan
