// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "alidade/io/csv_file.h"

namespace alidade::internal {

/// Column of a csv file in a run folder.
struct Column {
  std::string name;
  std::string unit;          ///< "" if there is no unit, or if the unit depends on the row
  std::string quantity;      ///< ColumnInfo::quantity of the entry in the table
  std::string subject = {};  ///< block, sensor or estimator of the column; may be empty
};

/// Entry in the column table of a file: a single column, or several columns of one quantity. A
/// `Layout` determines the columns. A `Row` determines the cells.
template <class Layout, class Row>
struct ColumnInfo {
  const char* quantity;  ///< quantity; also the name of a single column
  const char* unit;      ///< unit of a single column; for several columns, only documentation
  const char* meaning;   ///< meaning, for the documentation, in Markdown
  void (*write)(const Layout& layout, const Row& row, CsvFile& file);
  std::vector<Column> (*columns)(const Layout& layout) = nullptr;  ///< null: a single column
  const char* names = "";  ///< names of several columns, for the documentation
};

/// Appends the columns of a table.
template <class Layout, class Row, std::size_t kCount>
void AppendColumns(const std::array<ColumnInfo<Layout, Row>, kCount>& table, const Layout& layout,
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

/// Writes the cells of a table for one row. Does not end the row.
template <class Layout, class Row, std::size_t kCount>
void WriteCells(const std::array<ColumnInfo<Layout, Row>, kCount>& table, const Layout& layout,
                const Row& row, CsvFile& file) {
  for (const ColumnInfo<Layout, Row>& info : table) info.write(layout, row, file);
}

/// Columns of each csv file of a run folder. The key is the name of the file. `columns.json`
/// contains this map.
using RunColumns = std::map<std::string, std::vector<Column>>;

/// Creates a csv file with `columns`, and adds these columns to `run_columns`. Errors:
/// kCannotCreate, kIo.
CsvFile CreateCsv(const OutputFolder& folder, const std::string& name, std::vector<Column> columns,
                  RunColumns& run_columns);

/// Returns the text of `columns.json`. Its entries are FILE: [{name, unit, quantity, subject},
/// ...]. The keys `unit` and `subject` are omitted if their values are empty.
std::string ColumnsJson(const RunColumns& run_columns);

}  // namespace alidade::internal
