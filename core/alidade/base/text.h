// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace alidade::internal {

/// Joins texts with a separator, for example to `a, b, c`.
std::string Join(const std::vector<std::string>& parts, const char* separator = ", ");

/// Returns the noun with its indefinite article: `a source`, `an estimator`.
std::string WithArticle(const std::string& noun);

/// Returns `text` with its ASCII letters in lower case, in any locale.
std::string LowerCase(std::string_view text);

/// Returns `text` as one word of a shell command.
std::string ShellWord(const std::string& text);

/// Returns the member `name` of each element.
template <class Range>
std::vector<std::string> NamesOf(const Range& elements) {
  std::vector<std::string> names;
  for (const auto& element : elements) names.push_back(element.name);
  return names;
}

}  // namespace alidade::internal
