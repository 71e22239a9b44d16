// SPDX-License-Identifier: MIT
// Tables of what users choose by name: each row has a `name`.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.h"

namespace minescan {

/// The row called `name`. Throws std::invalid_argument "unknown <what> '...'; known: ...".
template <class Row>
const Row& find_row(const std::vector<Row>& rows, std::string_view what, const std::string& name) {
  std::vector<std::string> known;
  for (const Row& row : rows) {
    if (row.name == name) return row;
    known.push_back(row.name);
  }
  throw std::invalid_argument(unknown_name(what, name, known));
}

}  // namespace minescan
