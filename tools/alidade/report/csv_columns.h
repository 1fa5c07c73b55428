// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"

namespace alidade::internal {

/// CSV file of a run folder, or its last rows. Cells are identified by the name of their column and
/// the index of their row. A last row without a line end is omitted: the run was interrupted while
/// it was written, or is writing it now.
class CsvColumns {
 public:
  static constexpr std::size_t kAllRows = static_cast<std::size_t>(-1);
  /// Reads the last `last_rows` rows of `file`. The result has no columns if the file does not
  /// exist. Errors: kBadData with file and line, kIo.
  explicit CsvColumns(const std::filesystem::path& file, std::size_t last_rows = kAllRows);

  std::size_t rows() const { return width() == 0 ? 0 : cells_.size() / width(); }
  const std::vector<std::string_view>& names() const { return names_; }
  bool Has(std::string_view name) const { return Find(name).has_value(); }

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
  std::size_t width() const { return names_.size(); }
  std::optional<std::size_t> Find(std::string_view name) const;
  void Parse();
  /// Parses the cell that starts at `position`, and moves `position` to the separator behind it.
  std::string_view ParseCell(std::size_t& position);
  [[noreturn]] void Fail(std::size_t row, const std::string& problem) const;

  std::filesystem::path file_;
  std::unique_ptr<std::string> text_ = std::make_unique<std::string>();  ///< text of the file
  std::vector<std::unique_ptr<std::string>> unquoted_;  ///< contents of quoted cells
  std::vector<std::string_view> names_, cells_;         ///< the header, and all cells row by row
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
