// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/error.h"
#include "table_layout.h"

namespace alidade {

/// Row of a table: the cells of one line. The line must outlive the row.
class TableRow {
 public:
  /// `missing` are the texts of cells that mark a missing value.
  TableRow(std::string file, std::vector<std::string> missing)
      : file_(std::move(file)), missing_(std::move(missing)) {}

  /// Splits a line into cells. The separator ' ' stands for any blanks and tabs.
  void Split(std::string_view line, int number, char separator);

  std::size_t size() const { return cells_.size(); }
  int number() const { return number_; }
  /// Returns the text of a cell without blanks and quotes around it.
  std::string_view Text(const TableColumn& column) const;
  /// Returns true if the cell marks a missing value.
  bool IsMissing(const TableColumn& column) const;
  /// Returns the number in a cell. Errors: kBadData; if `may_miss` is true, the message explains
  /// how to mark a missing value.
  double Number(const TableColumn& column, bool may_miss = true) const;

  /// Throws an Error kBadData with the place and the text of a cell, such as `'abc' is not a
  /// number`.
  [[noreturn]] void Fail(const TableColumn& column, const std::string& problem,
                         std::string_view expected = "a finite number") const;
  /// Throws an Error kBadData unless the row has `count` cells. `reference` is the place that
  /// determines this number, such as `line 1`.
  void ExpectSize(std::size_t count, const std::string& reference, bool is_unterminated) const;

 private:
  std::size_t ColumnNumber(std::size_t index) const;
  std::string MissingWith(std::string_view text) const;

  std::string file_;
  std::vector<std::string> missing_;
  std::string_view line_;
  int number_ = 0;
  std::vector<std::string_view> cells_;  ///< not trimmed
};

}  // namespace alidade
