// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>

/// Files that ought to be the same, line by line.
namespace alidade::internal {

/// The first place where two files differ.
struct RowDifference {
  std::int64_t line = 0, column = 0;  ///< from 1
  std::string before, now;            ///< the cell there, or the start of it; "": no text
  bool only_line_end = false;         ///< the last line end of one of them is all there is

  /// `now '0.51', was '0.5'`, `other bytes`, or `line end`
  std::string Text() const;
};

struct RowComparison {
  std::optional<RowDifference> difference;  ///< in the rows that both have
  std::int64_t rows = 0;                    ///< that both have and are equal
  bool before_goes_on = false;              ///< it has more rows, the same ones up to there
  bool now_goes_on = false;
};

RowComparison CompareRows(std::istream& before, std::istream& now);
/// A file that is not there has no rows. Error: kIo where one cannot be read.
RowComparison CompareRows(const std::filesystem::path& before, const std::filesystem::path& now);

}  // namespace alidade::internal
