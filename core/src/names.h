// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "config_tree.h"

namespace alidade::internal {

/// Refuses a name that is not one word in columns (`target.depth`), metric keys
/// (`rmse:target.depth@near`) and tables. `of` says of what, as in `a sensor`.
inline void ExpectName(const std::string& name, const Node& at, const std::string& of) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  if (!name.empty() && std::all_of(name.begin(), name.end(), fits)) return;
  at.Fail(Quoted(name) + " cannot name " + of, "letters, digits, _ and -");
}

/// The `name` of each.
template <class Range>
std::vector<std::string> NamesOf(const Range& named) {
  std::vector<std::string> names;
  for (const auto& one : named) names.push_back(one.name);
  return names;
}

}  // namespace alidade::internal
