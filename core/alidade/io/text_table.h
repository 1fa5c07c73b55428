// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace alidade::internal {

using TextRow = std::vector<std::string>;

/// Formats rows as left-aligned columns, separated by two blanks and indented by `indent`. Omits a
/// column that is empty below the first row.
std::string TextTable(const std::vector<TextRow>& rows, std::size_t indent = 0);

/// Row of a table: a label with its unit, and one cell for each column. `-` is a missing value.
struct TableRow {
  std::string label;
  std::vector<std::string> cells;
};

/// Table of texts and numbers, with a header.
struct Table {
  TextRow header;
  std::vector<TextRow> rows;
  std::size_t text_columns = 1;  ///< number of leading columns that are left-aligned
};
/// Returns the table of `rows`. Its header consists of `corner`, above the labels, and the column
/// `names`.
Table MakeTable(const std::vector<std::string>& names, const std::vector<TableRow>& rows,
                const std::string& corner = "");

enum class TableFormat {
  kText,      ///< only the first column is left-aligned; a wide table is split into several parts
  kMarkdown,  ///< special characters are escaped
  kLatex,     ///< a `tabular` environment, which needs no package; special characters are escaped
};
std::string FormatTable(const Table& table, TableFormat format);

/// Returns `text` with LaTeX's special characters escaped.
std::string LatexText(const std::string& text);

}  // namespace alidade::internal
