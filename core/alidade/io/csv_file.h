// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/io/output_folder.h"

namespace alidade::internal {

/// CSV file that is written cell by cell, with commas and line feeds. A number is written with the
/// fewest digits that parse to the same value. A text is quoted if RFC 4180 requires quotes.
class CsvFile {
 public:
  /// Creates the file with its header. Errors: kCannotCreate, kIo.
  CsvFile(const OutputFolder& folder, const std::string& name,
          const std::vector<std::string>& header);

  CsvFile& Time(Timestamp timestamp);  ///< appends an empty cell for kNoTimestamp
  CsvFile& Number(double value);
  CsvFile& Integer(std::int64_t value);
  /// Appends the id of a landmark. A negative id means no landmark; the cell is then empty.
  CsvFile& Landmark(std::int64_t id);
  CsvFile& Text(std::string_view value);
  CsvFile& Empty(std::size_t cells = 1);
  /// Appends `count` values and then `width` - `count` empty cells.
  CsvFile& Numbers(const double* values, std::size_t count, std::size_t width);
  /// Ends the row, which must have one cell for each column. Error: kIo.
  void EndRow();
  void Close();

  /// Returns the number of rows below the header.
  std::int64_t rows() const { return rows_; }

 private:
  void Separate();

  std::unique_ptr<OutputFile> file_;
  std::string row_;
  std::size_t columns_, cells_ = 0;
  std::int64_t rows_ = 0;
};

/// Returns `text` as a CSV cell.
std::string CsvQuoted(std::string_view text);

}  // namespace alidade::internal
