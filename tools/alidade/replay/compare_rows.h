// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>

/// Line-by-line comparison of two files that are expected to be equal.
namespace alidade::internal {

/// The first difference between two files.
struct RowDifference {
  std::int64_t line = 0, column = 0;  ///< both count from 1
  /// The cell at that position, or the start of it; "" if it is not printable text.
  std::string recorded, current;
  bool only_line_end = false;  ///< the files differ only in their last line end

  /// `now '0.51', was '0.5'`, `other bytes`, or `line end`
  std::string Text() const;
};

struct RowComparison {
  std::optional<RowDifference> difference;  ///< within the rows that both files have
  std::int64_t rows = 0;                    ///< number of equal rows at the start of both files
  bool recorded_has_more = false;           ///< the recorded file has rows after the equal ones
  bool current_has_more = false;            ///< the current file has rows after the equal ones
};

/// Compares a recorded file with a current one, row by row, up to the first difference.
RowComparison CompareRows(std::istream& recorded, std::istream& current);
/// Compares two files by path. A missing file has no rows. Error: kIo if a file cannot be read.
RowComparison CompareRows(const std::filesystem::path& recorded,
                          const std::filesystem::path& current);

}  // namespace alidade::internal
