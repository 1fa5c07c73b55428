// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/report/row_selection.h"

namespace alidade::internal {

/// Selected rows of a CSV file of a run folder. Cells are identified by the name of their column
/// and the index of their row.
class CsvColumns {
 public:
  /// Reads `file`. The result has no columns if the file does not exist. Errors: kBadData with file
  /// and line, kIo.
  explicit CsvColumns(const std::filesystem::path& file, const RowSelection& selection = {});
  CsvColumns(const CsvColumns&) = delete;
  CsvColumns& operator=(const CsvColumns&) = delete;

  std::size_t rows() const { return lines_.size(); }
  const std::vector<std::string>& names() const { return names_; }

  /// Returns the texts of a column; empty if the column is missing.
  std::vector<std::string_view> Texts(std::string_view name) const;
  /// Returns the numbers of a column. An empty cell becomes NaN. The result has NaN in each row if
  /// the column is missing. Error: kBadData.
  std::vector<double> Numbers(std::string_view name) const;
  /// Returns the timestamps of a column. An empty cell becomes kNoTimestamp. Error: kBadData.
  std::vector<Timestamp> Times(std::string_view name = "t_s") const;
  /// Removes all rows except `count` rows from row `first` on.
  void Keep(std::size_t first, std::size_t count);

 private:
  std::optional<std::size_t> Find(std::string_view name) const;

  std::filesystem::path file_;
  std::vector<std::string> names_;
  std::vector<std::uint32_t> lines_;  ///< index of each selected row in the file
  std::string text_;                  ///< texts of all cells, row by row
  std::vector<std::size_t> ends_;     ///< end of each cell in `text_`
};

/// Returns the elements of `values` at `indices`.
template <class Value>
std::vector<Value> Select(const std::vector<Value>& values,
                          const std::vector<std::uint32_t>& indices) {
  std::vector<Value> selected;
  selected.reserve(indices.size());
  for (const std::uint32_t index : indices) selected.push_back(values[index]);
  return selected;
}

}  // namespace alidade::internal
