// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

using TextRow = std::vector<std::string>;

/// Formats rows as left-aligned columns, separated by two blanks and indented by `indent`. Omits a
/// column that is empty below the first row.
std::string TextTable(const std::vector<TextRow>& rows, std::size_t indent = 0);

/// Returns a row of a Markdown table, `| a | b |`, with special characters escaped.
std::string MarkdownRow(const TextRow& cells);

/// Returns `text` with LaTeX's special characters escaped.
std::string LatexText(const std::string& text);
/// Returns a row of a LaTeX tabular, `a & b \\`, with special characters escaped.
std::string LatexRow(const TextRow& cells);

/// Row of a table: a label with its unit, and a cell for each column, `-` for a missing value.
struct TableRow {
  std::string label;
  std::vector<std::string> cells;
};
/// Formats rows below the names of the columns, aligned to the right. Columns that do not fit into
/// 100 characters continue in a table below.
std::string RightAlignedTable(const std::vector<std::string>& names,
                              const std::vector<TableRow>& rows);
/// Returns the label of a row, followed by its cells.
std::vector<std::string> CellsOf(const TableRow& row);
/// Formats rows as a Markdown table, with `corner` above the labels.
std::string MarkdownTable(const std::string& corner, const std::vector<std::string>& names,
                          const std::vector<TableRow>& rows);

}  // namespace alidade::internal
