// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>

/// Line-by-line comparison of two files that are expected to be equal.
namespace alidade::internal {

/// First difference between two files.
struct RowDifference {
  std::int64_t line = 0, column = 0;  ///< position in the files, counted from 1
  /// Cell of each file at this position. A long cell is truncated. The text is empty if the cell is
  /// not printable text.
  std::string recorded, current;
  bool only_line_end = false;  ///< true: the files differ only in the last line end

  /// Describes the difference, as in `now '0.51', was '0.5'`, `the bytes differ` or `the line end
  /// differs`.
  std::string Text() const;
};

struct RowComparison {
  std::optional<RowDifference> difference;  ///< first difference in the rows that both files have
  std::int64_t rows = 0;                    ///< number of equal rows at the start of both files
  bool recorded_has_more = false;  ///< true: the recorded file has rows after the equal rows
  bool current_has_more = false;   ///< true: the current file has rows after the equal rows
};

/// Compares a recorded file with a current file, row by row, up to the first difference.
RowComparison CompareRows(std::istream& recorded, std::istream& current);
/// Compares two files, given their paths. A missing file counts as a file without rows. Error: kIo
/// if a file cannot be read.
RowComparison CompareRows(const std::filesystem::path& recorded,
                          const std::filesystem::path& current);

}  // namespace alidade::internal
