// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/io/wrap_text.h"

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
/// Returns the table with rows and columns exchanged.
Table Transposed(const Table& table);

enum class TableFormat {
  kText,      ///< numbers are aligned at the decimal point
  kMarkdown,  ///< special characters are escaped
  kLatex,     ///< a `tabular` environment, which needs no package; special characters are escaped
};
/// Formats a table. `width` is the width of lines for kText. If the table is wider, it is split
/// into parts, and labels are wrapped if one column needs this. Headers that are wider than the
/// cells are always wrapped.
std::string FormatTable(const Table& table, TableFormat format,
                        std::size_t width = kDefaultTextWidth);

/// Returns `text` with LaTeX's special characters escaped.
std::string LatexText(const std::string& text);

}  // namespace alidade::internal
