// SPDX-License-Identifier: MIT
// NumPy's array files.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace minescan {

/// A .npy file (version 1.0, C order, little-endian float64) that holds the rows x columns numbers
/// of `values`, row by row. Throws std::invalid_argument if there are more or fewer.
std::string print_npy_matrix(std::size_t rows, std::size_t columns, std::span<const double> values);

}  // namespace minescan
