// SPDX-License-Identifier: Apache-2.0
#include "known_table.h"

#include <string>
#include <string_view>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/io/text_cell.h"
#include "table_calibration.h"
#include "table_reader.h"

namespace alidade {
namespace {

/// Returns the number in a cell, or its text. Equal numbers are thus equal ids, such as 7 and 7.0.
KnownTable::Id ReadId(std::string_view text) {
  double number = 0.0;
  if (cell::ParseNumber(text, number) == nullptr) return number;
  return std::string(text);
}

/// Returns the layout of the table: one stream of the id and the known numbers, without times.
TableLayout LayoutOf(const KnownTable& table) {
  TableLayout layout{table.path, {}, {}, {}, {}, '\0', {""}, {}, 1.0};
  layout.time.rate_hz = 1.0;
  TableField& field = layout.streams.emplace_back();
  field.columns = table.columns;
  field.landmark = table.id;
  return layout;
}

}  // namespace

KnownTable ReadKnownTableKeys(const Node& node) {
  const Node id = node.At("id", "known", "the column of the ids, in both tables");
  return {node.At("path", "known", "a table, such as beacons.csv"),
          {id.Text(), id},
          ReadColumns(node.At("columns", "known", "the columns of the known numbers")),
          {},
          {}};
}

void ReadKnownTable(const std::filesystem::path& folder, KnownTable& table) {
  TableCalibration unused;
  TableReader reader(LayoutOf(table), folder / table.path.Text(), table.path, false, unused);
  table.file = reader.name();
  const TableField& field = reader.layout().streams.front();
  for (; reader.Read(); reader.ReleaseRow()) {
    const TableRow& row = reader.row();
    KnownTable::Row known{row.number(), {}};
    for (const TableColumn& column : field.columns) {
      known.numbers.push_back(row.Number(column, false));
    }
    const auto [first, is_new] =
        table.rows.emplace(ReadId(row.Text(*field.landmark)), std::move(known));
    if (!is_new) {
      row.Fail(*field.landmark, "is also the id of line " + std::to_string(first->second.line),
               "one row for each id");
    }
  }
}

std::vector<TableField> StreamsById(const TableField& stream) {
  std::vector<TableField> streams;
  for (const auto& [id, row] : stream.known_table->rows) {
    const double* const number = std::get_if<double>(&id);
    const std::string text =
        number != nullptr ? internal::NumberText(*number) : std::get<std::string>(id);
    TableField& field = streams.emplace_back(stream);
    field.info.name.replace(field.info.name.find('*'), 1, text);
    field.id = id;
  }
  return streams;
}

bool HasIdOf(const TableRow& reading, const TableField& stream) {
  if (!stream.id) return true;
  const TableColumn& column = stream.known_table->id;
  if (reading.IsMissing(column)) return false;
  static_cast<void>(KnownNumbers(reading, *stream.known_table));
  return ReadId(reading.Text(column)) == *stream.id;
}

const std::vector<double>& KnownNumbers(const TableRow& reading, const KnownTable& table) {
  const auto found = table.rows.find(ReadId(reading.Text(table.id)));
  if (found == table.rows.end()) {
    reading.Fail(table.id, "is not an id in " + table.file,
                 "a row with this id in that table, or readings selected by 'rows: {" +
                     table.id.name + ": [..]}'");
  }
  return found->second.numbers;
}

}  // namespace alidade
