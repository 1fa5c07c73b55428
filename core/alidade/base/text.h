// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

/// `a, b, c`
std::string Join(const std::vector<std::string>& parts, const char* separator = ", ");

/// `a source`, `an estimator`
std::string WithArticle(const std::string& noun);

/// The `name` of each.
template <class Range>
std::vector<std::string> NamesOf(const Range& named) {
  std::vector<std::string> names;
  for (const auto& one : named) names.push_back(one.name);
  return names;
}

}  // namespace alidade::internal
