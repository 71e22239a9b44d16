// SPDX-License-Identifier: MIT
// Parts that go by names in a configuration: "drifts.main.width" names a drift "main".
#pragma once

#include <map>
#include <string>

#include "core/fields.h"

namespace minescan {

/// Adds to `parts`, at its defaults, each that a key of `given` names under `prefix` ("drifts.").
template <class Part>
void add_named_parts(std::map<std::string, Part>& parts, const std::string& prefix,
                     const Settings& given) {
  for (const auto& [key, unused] : given) {
    if (!key.starts_with(prefix)) continue;
    const std::size_t dot = key.find('.', prefix.size());
    if (dot != std::string::npos && dot > prefix.size())
      parts.try_emplace(key.substr(prefix.size(), dot - prefix.size()));
  }
}

}  // namespace minescan
