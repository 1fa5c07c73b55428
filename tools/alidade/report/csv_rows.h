// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"

namespace alidade::internal {

inline constexpr std::size_t kAllRows = static_cast<std::size_t>(-1);

/// Rows of a CSV file of a run folder, read one by one. A last row without a line end is omitted:
/// the run was interrupted while it was written, or is writing it now.
class CsvRows {
 public:
  /// Reads the header of `file`. The table is empty if the file does not exist. `last_rows`: only
  /// the last rows are read, whose cells must not contain line ends. Error: kIo.
  explicit CsvRows(const std::filesystem::path& file, std::size_t last_rows = kAllRows);

  const std::vector<std::string>& names() const { return names_; }
  std::optional<std::size_t> Find(std::string_view name) const;
  /// Reads the next row. Returns false at the end. Errors: kBadData with file and line; kIo.
  bool Next();
  /// Returns the texts of the row, which stay valid until the next row is read.
  const std::vector<std::string_view>& cells() const { return cells_; }
  /// Returns the index of the row.
  std::size_t row() const { return count_ - 1; }

 private:
  void SkipToLast(std::size_t rows);
  bool ReadRow();
  void ParseRow();

  std::filesystem::path file_;
  std::ifstream stream_;
  std::vector<std::string> names_;
  std::string text_;
  std::deque<std::string> unquoted_;  ///< contents of the quoted cells of the row
  std::vector<std::string_view> cells_;
  std::size_t count_ = 0;
};

/// Returns the time in a cell, or kNoTimestamp if the cell does not contain a time.
Timestamp TimeOf(std::string_view cell);

}  // namespace alidade::internal
