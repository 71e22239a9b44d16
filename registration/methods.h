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
  /// Registers `source` to `target` from T_guess, on the calling thread alone. Throws
  /// std::invalid_argument for an empty cloud, a coordinate that is not finite or a bad setting.
  std::function<RegistrationResult(const PointCloud& target, const PointCloud& source,
                                   const Pose& T_guess, const Settings& settings)>
      run = {};
};

/// All methods known by name.
const std::vector<Method>& methods();

/// The row called `name`. Throws std::invalid_argument with the known names.
const Method& find_method(const std::string& name);

}  // namespace minescan
