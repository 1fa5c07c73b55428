// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/base/timestamp.h"
#include "alidade/io/line_reader.h"
#include "alidade/io/text_cell.h"

namespace alidade {

/// Reader of a file of numbers. It reads row by row in constant memory, and skips blank lines and
/// lines that begin with `#`. In `NAME.partial`, the folder of an unfinished run, it also skips a
/// last row without a line end.
///
/// Errors       kBadData with file, line and column; the errors of LineReader.
class NumberRows {
 public:
  static constexpr char kCommaOrBlanks = '\0';

  /// The separator ' ' means any number of blanks. kCommaOrBlanks means commas in a row that
  /// contains a comma, and blanks in any other row. A comma at the end of such a row is ignored.
  NumberRows(const std::filesystem::path& path, const Place& place, const std::string& key,
             char separator = ',')
      : reader_(path, place, key), separator_(separator) {
    const auto is_partial = [](const auto& part) { return part.extension() == ".partial"; };
    may_be_incomplete_ = std::any_of(path.begin(), path.end(), is_partial);
  }

  const std::string& name() const { return reader_.name(); }
  int line() const { return reader_.number(); }
  /// Returns true if commas separate the cells of the row.
  bool has_commas() const { return line_.find(',') != std::string_view::npos; }
  std::size_t size() const { return cells_.size(); }
  std::string_view text(std::size_t i) const { return cell::Trim(cells_[i]); }

  /// Reads the next row. Returns false at the end.
  bool Next() {
    while (reader_.Next(line_)) {
      if (may_be_incomplete_ && reader_.is_unterminated()) return false;
      if (line_.find_first_not_of(" \t") == std::string_view::npos) continue;
      if (line_.starts_with('#')) continue;
      Split();
      return true;
    }
    return false;
  }
  /// Returns the index of the cell of a header row that contains `name`. Fails if the header does
  /// not contain it; the message contains `expected`, a description of the file.
  std::size_t ColumnOf(std::string_view name, std::string_view expected) const {
    for (std::size_t i = 0; i < size(); ++i) {
      if (text(i) == name) return i;
    }
    FailLine("the column '" + std::string(name) + "' is missing", expected);
  }
  /// Fails unless the row has `count` columns. The message contains `columns`, which describes
  /// the expected columns.
  void ExpectColumns(std::size_t count, const std::string& columns) const {
    if (cells_.size() == count) return;
    const bool is_short = cells_.size() < count;
    const std::size_t column = is_short ? line_.size() + 1 : Column(count);
    Fail(column, {},
         (is_short && reader_.is_unterminated() ? "the last line is cut short: it has "
                                                : "the row has ") +
             std::to_string(cells_.size()) + (cells_.size() == 1 ? " column" : " columns"),
         std::to_string(count) + ", " + columns);
  }
  /// Returns the finite number in column i. Messages use `name` as the name of the column.
  double Number(std::size_t i, const char* name) const {
    double value = 0.0;
    const char* const problem = cell::ParseNumber(text(i), value);
    if (problem != nullptr) FailCell(i, name, problem, "a finite number");
    return value;
  }
  /// Returns the whole number in column i, which must not be negative.
  std::int64_t Index(std::size_t i, const char* name) const {
    const std::string_view digits = text(i);
    std::int64_t value = 0;
    const char* const last = digits.data() + digits.size();
    const auto [end, error] = std::from_chars(digits.data(), last, value);
    const char* const expected = "a whole number >= 0";
    if (end != last || error == std::errc::invalid_argument) {
      FailCell(i, name, "is not a whole number", expected);
    }
    if (error != std::errc()) FailCell(i, name, "is too large", "at most 9223372036854775807");
    if (value < 0) FailCell(i, name, "is negative", expected);
    return value;
  }
  /// Returns the time in column i, which is in seconds. The result is exact to the nanosecond.
  Timestamp Time(std::size_t i, const char* name) const {
    const double t_s = Number(i, name);
    if (!(std::abs(t_s) < cell::kTimeLimit)) FailCell(i, name, "is beyond 292 years", "seconds");
    return cell::ParseTimestamp(text(i), t_s, 9);
  }

  /// Throws an error about column i. The message uses `name` as the name of the column.
  [[noreturn]] void FailCell(std::size_t i, const char* name, const std::string& problem,
                             std::string_view expected) const {
    Fail(Column(i), name, '\'' + cell::PrintableStart(text(i)) + "' " + problem, expected);
  }
  /// Throws an error about the whole line. Before the first line, the error is about the whole
  /// file.
  [[noreturn]] void FailLine(const std::string& problem, std::string_view expected) const {
    Fail(0, {}, problem, expected);
  }

 private:
  void Split() {
    cells_.clear();
    const char row_separator = has_commas() ? ',' : ' ';
    const char separator = separator_ == kCommaOrBlanks ? row_separator : separator_;
    if (separator != ' ') {
      for (std::string_view remaining = line_;;) {
        const std::size_t end = std::min(remaining.find(separator), remaining.size());
        cells_.push_back(remaining.substr(0, end));
        if (end == remaining.size()) return;
        remaining.remove_prefix(end + 1);
        if (separator_ == kCommaOrBlanks && cell::Trim(remaining).empty()) return;
      }
    }
    for (std::size_t start = line_.find_first_not_of(" \t"); start < line_.size();) {
      const std::size_t end = std::min(line_.find_first_of(" \t", start), line_.size());
      cells_.push_back(line_.substr(start, end - start));
      start = line_.find_first_not_of(" \t", end);
    }
  }
  std::size_t Column(std::size_t i) const {
    return static_cast<std::size_t>(cells_[i].data() - line_.data()) + 1;
  }
  [[noreturn]] void Fail(std::size_t column, std::string_view key, std::string_view problem,
                         std::string_view expected) const {
    const Place place{reader_.name(), reader_.number(), static_cast<int>(column)};
    throw Error(ExitCode::kBadData, ErrorLine(place, key, problem, expected));
  }

  LineReader reader_;
  char separator_;
  bool may_be_incomplete_ = false;
  std::string_view line_;
  std::vector<std::string_view> cells_;
};

/// Columns 1 to 7 of a trajectory in TUM format. Column 0 is the time in s.
inline constexpr std::array<const char*, 7> kTumPose = {"x", "y", "z", "qx", "qy", "qz", "qw"};

/// Returns columns 1 to 7: x y z and a quaternion. Fails if the length of the quaternion differs
/// from 1 by more than 1e-3. Messages use `names` as the names of the columns.
inline std::array<double, 7> PoseNumbers(const NumberRows& rows,
                                         const std::array<const char*, 7>& names) {
  std::array<double, 7> values{};
  double length2 = 0.0;
  for (std::size_t i = 0; i < 7; ++i) {
    values[i] = rows.Number(i + 1, names[i]);
    if (i >= 3) length2 += values[i] * values[i];
  }
  if (std::abs(std::sqrt(length2) - 1.0) <= 1e-3) return values;
  rows.FailLine("the length of the quaternion is " + std::to_string(std::sqrt(length2)),
                "a length within 1e-3 of 1");
}

}  // namespace alidade
