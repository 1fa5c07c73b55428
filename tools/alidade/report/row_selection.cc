// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/row_selection.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <utility>

namespace alidade::internal {
namespace {

/// Names the group of a row.
class GroupKey {
 public:
  GroupKey(const CsvRows& table, const std::vector<std::string>& columns) {
    for (const std::string& name : columns) {
      if (const auto column = table.Find(name)) columns_.push_back(*column);
    }
  }
  std::string Of(const CsvRows& table) const {
    std::string key;
    for (const std::size_t column : columns_) (key += table.cells()[column]) += '\n';
    return key;
  }

 private:
  std::vector<std::size_t> columns_;
};

/// Returns the indices of the columns whose names start with `prefix`.
std::vector<std::size_t> ColumnsWith(const CsvRows& table, const std::string& prefix) {
  std::vector<std::size_t> columns;
  for (std::size_t i = 0; i < table.names().size() && !prefix.empty(); ++i) {
    if (table.names()[i].starts_with(prefix)) columns.push_back(i);
  }
  return columns;
}

double LargestNumber(const CsvRows& table, const std::vector<std::size_t>& columns) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const std::size_t column : columns) {
    const std::string_view text = table.cells()[column];
    double number = largest;
    std::from_chars(text.data(), text.data() + text.size(), number);
    if (number > largest) largest = number;
  }
  return largest;
}

/// State of a group while its rows are selected.
struct Group {
  std::size_t count = 0;   ///< all rows
  std::size_t length = 1;  ///< rows of a sequence
  std::size_t next = 0;    ///< index of the next row in the group
  double importance = 0.0;
  std::vector<std::uint32_t> selected = {};

  void Add(std::size_t row, double row_importance) {
    const bool is_first = next++ % length == 0;
    if (!is_first && !(row_importance > importance)) return;
    if (!is_first) selected.pop_back();
    selected.push_back(static_cast<std::uint32_t>(row));
    importance = row_importance;
  }
};

}  // namespace

RowSelection SelectRows(const std::filesystem::path& file, const std::vector<std::string>& group,
                        const std::string& importance, std::size_t max_rows) {
  std::map<std::string, Group> groups;
  bool is_long = false;
  CsvRows counted(file);
  const GroupKey key(counted, group);
  while (counted.Next()) is_long = ++groups[key.Of(counted)].count > max_rows || is_long;
  if (!is_long) return {};
  for (auto& [name, entry] : groups) entry.length = (entry.count + max_rows - 1) / max_rows;

  CsvRows table(file);
  const std::vector<std::size_t> columns = ColumnsWith(table, importance);
  while (table.Next()) groups[key.Of(table)].Add(table.row(), LargestNumber(table, columns));
  std::vector<std::uint32_t> rows;
  for (const auto& [name, entry] : groups) {
    rows.insert(rows.end(), entry.selected.begin(), entry.selected.end());
  }
  std::ranges::sort(rows);
  return {.rows = std::move(rows)};
}

RowSelection SelectTimes(const std::filesystem::path& file, const std::vector<Timestamp>& times) {
  std::vector<std::uint32_t> rows;
  CsvRows table(file);
  const auto time = table.Find("t_s");
  std::size_t count = 0;
  for (; time && table.Next(); ++count) {
    const bool is_selected = std::ranges::binary_search(times, TimeOf(table.cells()[*time]));
    if (is_selected) rows.push_back(static_cast<std::uint32_t>(table.row()));
  }
  if (count <= kMaxRows) return {};
  return {.rows = std::move(rows)};
}

}  // namespace alidade::internal
