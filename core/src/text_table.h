// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

using TextRow = std::vector<std::string>;

/// Rows as lines of left-aligned columns, two blanks apart, `indent` blanks in front. A column that
/// is empty in every row but the first is left out.
std::string TextTable(const std::vector<TextRow>& rows, std::size_t indent = 0);

/// `| a | b |`, a line of a table of Markdown, without what would end a cell.
std::string MarkdownRow(const TextRow& cells);

/// `text` without what LaTeX would obey.
std::string LatexText(const std::string& text);
/// `a & b \\`, a line of a tabular, each cell as LatexText.
std::string LatexRow(const TextRow& cells);

/// `a, b, c`
std::string Join(const std::vector<std::string>& parts, const char* separator = ", ");

}  // namespace alidade::internal
