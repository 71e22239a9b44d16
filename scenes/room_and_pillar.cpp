// SPDX-License-Identifier: MIT
#include "scenes/room_and_pillar.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/gradient_noise.h"
#include "core/random.h"
#include "core/text.h"

namespace minescan {
namespace {

enum class Along { row, column };

/// The grid's pieces of drift from each crossing to the next, and which of them are driven.
class Grid {
 public:
  Grid(const RoomAndPillarOptions& options, std::uint64_t seed)
      : o_(options), seed_(derived_seed(seed, "gaps")), group_(crossings()) {
    std::iota(group_.begin(), group_.end(), std::size_t{0});
    // Kruskal's tree keeps all crossings within reach: the border comes first, then the pieces that
    // are driven anyway, and of the others those that are needed.
    std::vector<Piece> pieces;
    for (int row = 0; row < o_.rows; ++row)
      for (int column = 0; column < o_.columns; ++column) {
        if (column + 1 < o_.columns) pieces.push_back({Along::row, column, row});
        if (row + 1 < o_.rows) pieces.push_back({Along::column, column, row});
      }
    std::stable_sort(pieces.begin(), pieces.end(),
                     [this](const Piece& a, const Piece& b) { return order(a) < order(b); });
    driven_.resize(2 * crossings(), false);
    for (const Piece& piece : pieces) {
      const bool tree = join(piece);
      driven_[index(piece)] = tree || order(piece) < 1 - o_.gaps;
    }
  }

  bool driven(Along along, int column, int row) const {
    return driven_[index({along, column, row})];
  }

 private:
  struct Piece {
    Along along;
    int column, row;  // where it begins
  };

  std::size_t crossings() const { return static_cast<std::size_t>(o_.rows) * o_.columns; }
  std::size_t node(int column, int row) const {
    return static_cast<std::size_t>(row) * o_.columns + column;
  }
  std::size_t index(const Piece& p) const {
    return 2 * node(p.column, p.row) + (p.along == Along::row ? 0 : 1);
  }

  /// Negative on the border, else uniform in [0, 1).
  double order(const Piece& p) const {
    const bool border = p.along == Along::row ? p.row == 0 || p.row == o_.rows - 1
                                              : p.column == 0 || p.column == o_.columns - 1;
    if (border) return -1;
    return lattice_uniform(p.column, p.row, p.along == Along::row ? 0 : 1, seed_);
  }

  std::size_t root(std::size_t n) {
    while (group_[n] != n) n = group_[n] = group_[group_[n]];
    return n;
  }
  /// Whether the piece was needed to join its ends.
  bool join(const Piece& p) {
    const bool row = p.along == Along::row;
    const std::size_t a = root(node(p.column, p.row));
    const std::size_t b = root(node(p.column + (row ? 1 : 0), p.row + (row ? 0 : 1)));
    group_[a] = b;
    return a != b;
  }

  const RoomAndPillarOptions& o_;
  std::uint64_t seed_;
  std::vector<std::size_t> group_;
  std::vector<bool> driven_;
};

/// Names sort as numbers do, for the order of drifts is that of their names.
std::string numbered(const char* name, int line, int part) {
  std::string text = name;
  for (const int n : {line, part}) {
    const std::string digits = std::to_string(n);
    text.append(1, '-').append(digits.size() < 3 ? 3 - digits.size() : 0, '0').append(digits);
  }
  return text;
}

/// Lights and bolts along a drift, and in the first row what a mine needs besides. Crossings belong
/// to the rows, so that nothing meets there.
void furnish(Mine& mine, const std::string& name, const Drift& drift,
             const RoomAndPillarOptions& o) {
  const auto put = [&](const std::string& what, ThingRun run) {
    run.drift = name;
    mine.things[what + "-" + name] = run;
  };
  if (name.starts_with("row")) {
    put("lights", {.kind = "light", .from = 4, .every = 10});
    put("bolts", {.kind = "bolts", .from = 2, .every = 3});
    if (!name.starts_with("row-000")) return;
    put("pipe", {.kind = "pipe", .from = 1, .side = Side::right});
    put("cable", {.kind = "cable", .from = 1, .side = Side::left});
    put("duct", {.kind = "duct", .from = 1, .side = Side::right, .offset = 1.5});
    return;
  }
  double at = 0;
  for (std::size_t i = 0; i + 1 < drift.line.size(); ++i) {
    const double leg = (drift.line[i + 1] - drift.line[i]).head<2>().norm();
    // Between the walls of the rows at both ends, with a metre to spare.
    const double from = at + o.width / 2 + o.jitter + 1, to = at + leg - o.width / 2 - o.jitter - 1;
    const std::string part = std::to_string(i);
    if (to > from) {
      put("lights-" + part, {.kind = "light", .from = (from + to) / 2, .to = (from + to) / 2});
      put("bolts-" + part, {.kind = "bolts", .from = from, .to = to, .every = 3});
    }
    at += leg;
  }
}

}  // namespace

Eigen::Vector3d crossing(const RoomAndPillarOptions& o, std::uint64_t seed, int column, int row) {
  const std::uint64_t jitter = derived_seed(seed, "crossings");
  const auto shift = [&](int axis) {
    return o.jitter * (2 * lattice_uniform(column, row, axis, jitter) - 1);
  };
  const double x = column * o.spacing + shift(0), y = row * o.spacing + shift(1);
  return {x, y, o.dip * x};
}

Mine room_and_pillar(const RoomAndPillarOptions& o, std::uint64_t seed) {
  if (!(o.spacing >= o.width + 2 * o.jitter + 2))
    throw std::invalid_argument("spacing = " + number_text(o.spacing) + " m: expected at least " +
                                number_text(o.width + 2 * o.jitter + 2) +
                                " m, the width of a drift, twice the jitter and 2 m of rock");
  const Grid grid(o, seed);
  Mine mine;
  mine.rock = o.rock;
  mine.furnished = o.furnished;
  const Drift plain{.width = o.width, .height = o.height};
  // A face half a drift beyond the last crossing squares the corner.
  const double beyond = o.width / 2;
  const std::uint64_t stub_seed = derived_seed(seed, "dead ends");

  // Straight runs of driven pieces are one drift each.
  const auto add_line = [&](Along along, int line, int count) {
    const bool row = along == Along::row;
    const Eigen::Vector3d ahead = row ? Eigen::Vector3d(1, 0, o.dip) : Eigen::Vector3d(0, 1, 0);
    const auto at = [&](int k) {
      return row ? crossing(o, seed, k, line) : crossing(o, seed, line, k);
    };
    const auto begun = [&](int k, int side) {
      return lattice_uniform(line, k, (row ? 0 : 2) + side, stub_seed) < o.dead_ends;
    };
    Drift drift = plain;
    if (!row) drift.cross_slope = -o.dip;  // left of a column is where x is less
    int parts = 0;
    const auto finish = [&] {
      if (drift.line.size() > 1)
        mine.drifts[numbered(row ? "row" : "column", line, parts++)] = drift;
      drift.line.clear();
    };
    for (int k = 0; k < count; ++k) {
      const bool on = k + 1 < count && grid.driven(along, row ? k : line, row ? line : k);
      if (on && drift.line.empty()) {
        // From the border a dead end may lead outwards, for most of a pillar's length.
        const bool stub = k == 0 && begun(0, 0);
        drift.line.push_back(at(k) - (stub ? 0.8 * o.spacing : beyond) * ahead);
        drift.line.push_back(at(k));
      }
      if (on) {
        drift.line.push_back(at(k + 1));
        continue;
      }
      if (drift.line.empty()) continue;
      const bool stub = k + 1 == count && begun(count, 1);
      drift.line.push_back(at(k) + (stub ? 0.8 * o.spacing : beyond) * ahead);
      finish();
    }
  };
  for (int row = 0; row < o.rows; ++row) add_line(Along::row, row, o.columns);
  for (int column = 0; column < o.columns; ++column) add_line(Along::column, column, o.rows);

  for (const auto& [name, drift] : mine.drifts) furnish(mine, name, drift, o);
  return mine;
}

}  // namespace minescan
