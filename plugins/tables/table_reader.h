// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/io/line_reader.h"
#include "table_calibration.h"
#include "table_layout.h"
#include "table_row.h"

namespace alidade {

/// Returns the time from `earlier` to `later` in ns, which can exceed the range of a Timestamp.
inline std::uint64_t TimeBetween(Timestamp earlier, Timestamp later) {
  return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
}

/// Reader of the rows of one table, in constant memory. It reads a row only when Read() is called.
class TableReader {
 public:
  /// Opens the table at `path` and reads its header. `path_node` is the node of the config with the
  /// path. Comments above the header are recorded in `calibration`. If `any_order` is true, times
  /// may repeat or decrease.
  TableReader(TableLayout layout, const std::filesystem::path& path, const Node& path_node,
              bool any_order, TableCalibration& calibration);

  const std::string& name() const { return reader_.name(); }
  const TableLayout& layout() const { return layout_; }
  /// Returns the total number of rows, or -1 if it is unknown.
  std::int64_t size() const { return size_; }

  /// Reads the next row. Returns false at the end. Errors: kBadData, kIo, kStopped.
  bool Read();
  /// Returns true if the row that Read() read last was not released yet.
  bool has_row() const { return has_row_; }
  bool is_at_end() const { return is_at_end_; }
  /// Returns true if ReleaseRow() was called.
  bool has_begun() const { return rows_ > 0; }
  /// Returns the last row. It is valid until the next call of Read().
  const TableRow& row() const { return row_; }
  /// Returns the time of the last row.
  Timestamp timestamp() const { return timestamp_; }
  /// Returns true if `blind_after` drops the streams of `blind` in this row.
  bool is_blind() const { return rows_ >= first_blind_row_; }
  /// Marks the last row as used.
  void ReleaseRow();

  /// Returns the earliest time of the next measurement, if times increase.
  Timestamp EarliestNext() const;

 private:
  struct Header {
    std::vector<std::string> names;
    std::string reference;  ///< place that names the columns, such as `line 1`
    bool is_line;           ///< false if the first line is a row
  };

  bool NextLine();
  void ReadHeader(TableCalibration& calibration);
  Header HeaderWith(char separator, std::string_view comment, int comment_line);
  char DetectSeparator(std::string_view comment, int comment_line);
  void CountRows(bool any_order);
  Timestamp ReadTimestamp() const;
  void CheckOrder(Timestamp timestamp) const;
  bool IsBeyondGap(Timestamp timestamp);

  TableLayout layout_;
  LineReader reader_;
  TableRow row_;
  Timestamp max_delay_ = 0;
  bool any_order_;
  std::size_t column_count_ = 0;
  std::string reference_;    ///< place that names the columns, such as `line 1`
  int first_line_ = 0;       ///< number of the line that ended the search for the header
  bool holds_line_ = false;  ///< true if that line is a row, which was not read yet
  std::string_view line_;

  bool has_row_ = false, is_at_end_ = false;
  Timestamp timestamp_ = 0;  ///< time of the last row
  std::int64_t rows_ = 0;    ///< number of released rows
  std::int64_t size_ = -1, first_blind_row_ = INT64_MAX;
  Timestamp newest_ = kNoTimestamp;  ///< latest time of the released rows
  int newest_line_ = 0;
  int skipped_ = 0;  ///< number of rows beyond the gap since the last row
};

}  // namespace alidade
