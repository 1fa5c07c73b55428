// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

using TextRow = std::vector<std::string>;

/// Rows as lines of left-aligned columns, two blanks apart, `indent` blanks in front. A column that
/// is empty in every row but the first is left out.
std::string TextTable(const std::vector<TextRow>& rows, std::size_t indent = 0);

/// `a, b, c`
std::string Join(const std::vector<std::string>& parts, const char* separator = ", ");

}  // namespace alidade::internal
