// SPDX-License-Identifier: MIT
// Registration methods by name.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/cloud.h"
#include "core/fields.h"
#include "registration/result.h"

namespace minescan {

/// One row of the table of methods.
struct Method {
  std::string name = {};
  std::string description = {};
  std::vector<Field> fields = {};
  /// Registers `source` to `target` from T_guess. Long loops (ICP's searches for neighbours and
  /// normals) use several threads unless a OneThread lives (core/parallel.h); results are the same
  /// to the last bit. Throws std::invalid_argument for an empty cloud, a coordinate that is not
  /// finite or a bad setting.
  std::function<RegistrationResult(const PointCloud& target, const PointCloud& source,
                                   const Pose& T_guess, const Settings& settings)>
      run = {};
};

/// The row of a function with options, which has a function `fields` beside it (core/fields.h) and
/// starts from `defaults`: how the rows of methods() are made, and those of anyone else
/// (docs/own_method.md).
template <class Options>
Method method_row(const std::string& name, const std::string& description,
                  RegistrationResult (*function)(const PointCloud&, const PointCloud&, const Pose&,
                                                 const Options&),
                  const Options& defaults = {}) {
  return {.name = name,
          .description = description,
          .fields = fields_of(defaults),
          .run = [=](const PointCloud& target, const PointCloud& source, const Pose& T_guess,
                     const Settings& settings) {
            return function(target, source, T_guess, with_settings(defaults, settings));
          }};
}

/// All methods known by name.
const std::vector<Method>& methods();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Method& find_method(const std::string& name);

}  // namespace minescan
