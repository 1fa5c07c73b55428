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

/// One line of a table: a label with its unit, and a cell for each column, `-` if it has no value.
struct TableRow {
  std::string label;
  std::vector<std::string> cells;
};
/// Rows below the names of the columns, aligned to the right. Columns that do not fit next to the
/// others in a line of 100 characters go into a table below.
std::string RightAlignedTable(const std::vector<std::string>& names,
                              const std::vector<TableRow>& rows);
/// The label of a row, then its cells.
std::vector<std::string> CellsOf(const TableRow& row);
/// The rows as a table of Markdown, `corner` above their labels.
std::string MarkdownTable(const std::string& corner, const std::vector<std::string>& names,
                          const std::vector<TableRow>& rows);

}  // namespace alidade::internal
