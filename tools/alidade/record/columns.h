// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "alidade/io/csv_file.h"

namespace alidade::internal {

/// A column of a csv file of a run folder.
struct Column {
  std::string name;
  std::string unit;          ///< "" if it has none, or if it depends on the row
  std::string quantity;      ///< of the ColumnInfo that it belongs to
  std::string subject = {};  ///< its block, sensor or estimator; "" if it has none
};

/// An entry of the table of a file: one column, or several of one quantity. `Layout` determines
/// the columns, `Row` their cells.
template <class Layout, class Row>
struct ColumnInfo {
  const char* quantity;  ///< the name of the column, if it is only one
  const char* unit;      ///< that of the column, if it is only one; else for the documentation
  const char* meaning;   ///< for the documentation, in Markdown
  void (*write)(const Layout& layout, const Row& row, CsvFile& file);
  std::vector<Column> (*columns)(const Layout& layout) = nullptr;  ///< null: it is only one
  const char* names = "";  ///< of the columns, for the documentation, if there are several
};

/// Appends the columns of a table.
template <class Layout, class Row, std::size_t n>
void AppendColumns(const std::array<ColumnInfo<Layout, Row>, n>& table, const Layout& layout,
                   std::vector<Column>& columns) {
  for (const ColumnInfo<Layout, Row>& info : table) {
    if (info.columns == nullptr) {
      columns.push_back({info.quantity, info.unit, info.quantity});
      continue;
    }
    for (Column& column : info.columns(layout)) {
      column.quantity = info.quantity;
      columns.push_back(std::move(column));
    }
  }
}

/// Writes the cells of a table for one row, without the end of the row.
template <class Layout, class Row, std::size_t n>
void WriteCells(const std::array<ColumnInfo<Layout, Row>, n>& table, const Layout& layout,
                const Row& row, CsvFile& file) {
  for (const ColumnInfo<Layout, Row>& info : table) info.write(layout, row, file);
}

/// The columns of all csv files of a run folder, by file: `columns.json`.
using RunColumns = std::map<std::string, std::vector<Column>>;

/// Creates a csv file with these columns and adds them to `run_columns`. Errors: kCannotCreate,
/// kIo.
CsvFile CreateCsv(const OutputFolder& folder, const std::string& name, std::vector<Column> columns,
                  RunColumns& run_columns);

/// The text of `columns.json`: FILE: [{name, unit, quantity, subject}, ...]; the keys `unit` and
/// `subject` are omitted if they are "".
std::string ColumnsJson(const RunColumns& run_columns);

}  // namespace alidade::internal
