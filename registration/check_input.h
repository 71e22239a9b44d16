// SPDX-License-Identifier: MIT
// What every method refuses before it starts.
#pragma once

#include <stdexcept>
#include <string>
#include <type_traits>

#include "core/cloud.h"
#include "core/fields.h"

namespace minescan {

/// Throws std::invalid_argument that names the cloud (and the point) if one is empty, has more than
/// 2^32 - 1 points or a coordinate that is not finite, or if the guess is not a finite pose.
void check_clouds(const PointCloud& target, const PointCloud& source, const Pose& T_guess);

/// Throws std::invalid_argument if a number of `options` is outside the range that its `fields`
/// state: options set in code are held to the same limits as those that come as text.
template <class Options>
void check_options(Options options) {
  fields(options, FieldVisitor{[]<class T>(const char* name, const T& v, const Range& range,
                                           const char*, const char*) {
           if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
             const std::string text = value_text(v);
             read_named(name, text, [&] { read_number(text, range, std::is_integral_v<T>); });
           }
         }});
}

}  // namespace minescan
