// SPDX-License-Identifier: MIT
#pragma once

namespace minescan {

/// All numbers from `low` to `high`.
struct Interval {
  double low = 0;
  double high = 0;
};

}  // namespace minescan
