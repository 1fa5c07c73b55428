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

/// The rows of a file of numbers, one at a time, in constant memory. Blank lines and lines that
/// begin with `#` are left out, and so is a last row without a line end in `NAME.partial`, the
/// folder of a run that has not come to its end.
///
/// Errors       kBadData with file, line and column; those of LineReader.
class NumberRows {
 public:
  static constexpr char kCommaOrBlanks = '\0';

  /// `separator` ' ': any blanks; kCommaOrBlanks: commas in a row that has one, else blanks.
  NumberRows(const std::filesystem::path& path, const Place& place, const std::string& key,
             char separator = ',')
      : reader_(path, place, key), separator_(separator) {
    const auto is_partial = [](const auto& part) { return part.extension() == ".partial"; };
    may_be_torn_ = std::any_of(path.begin(), path.end(), is_partial);
  }

  const std::string& name() const { return reader_.name(); }
  int line() const { return reader_.number(); }
  /// The row's cells stand between commas.
  bool has_commas() const { return line_.find(',') != std::string_view::npos; }
  std::size_t size() const { return cells_.size(); }
  std::string_view text(std::size_t i) const { return cell::Trim(cells_[i]); }

  /// The next row; false at the end.
  bool Next() {
    while (reader_.Next(line_)) {
      if (may_be_torn_ && reader_.unterminated()) return false;
      if (line_.find_first_not_of(" \t") == std::string_view::npos) continue;
      if (line_.starts_with('#')) continue;
      Split();
      return true;
    }
    return false;
  }
  /// Fails unless the row has `count` columns, named in `columns`.
  void ExpectColumns(std::size_t count, const std::string& columns) const {
    if (cells_.size() == count) return;
    const bool few = cells_.size() < count;
    const std::size_t at = few ? line_.size() + 1 : Column(count);
    Fail(at, {},
         (few && reader_.unterminated() ? "the last line is cut short: " : "") +
             std::to_string(cells_.size()) + (cells_.size() == 1 ? " column" : " columns"),
         std::to_string(count) + ", " + columns);
  }
  /// The finite number of column i, called `name`.
  double Number(std::size_t i, const char* name) const {
    double value = 0.0;
    const char* const wrong = cell::ParseNumber(text(i), value);
    if (wrong != nullptr) FailCell(i, name, wrong, "a finite number");
    return value;
  }
  /// A whole number of 0 or more.
  std::int64_t Index(std::size_t i, const char* name) const {
    const std::string_view digits = text(i);
    std::int64_t value = 0;
    const char* const last = digits.data() + digits.size();
    const auto [end, error] = std::from_chars(digits.data(), last, value);
    const char* const expected = "a whole number of 0 or more";
    if (end != last || error == std::errc::invalid_argument) {
      FailCell(i, name, "is not a whole number", expected);
    }
    if (error != std::errc()) FailCell(i, name, "is too large", "at most 9223372036854775807");
    if (value < 0) FailCell(i, name, "is negative", expected);
    return value;
  }
  /// A time in seconds, exact to the ns.
  Timestamp Time(std::size_t i, const char* name) const {
    const double t_s = Number(i, name);
    if (!(std::abs(t_s) < cell::kTimeLimit)) FailCell(i, name, "is beyond 292 years", "seconds");
    return cell::ParseTimestamp(text(i), t_s, 9);
  }

  /// Of column i, called `name`.
  [[noreturn]] void FailCell(std::size_t i, const char* name, const std::string& what,
                             std::string_view expected) const {
    Fail(Column(i), name, '\'' + cell::Harmless(text(i)) + "' " + what, expected);
  }
  /// Of the whole line, or the whole file where there is none yet.
  [[noreturn]] void FailLine(const std::string& what, std::string_view expected) const {
    Fail(0, {}, what, expected);
  }

 private:
  void Split() {
    cells_.clear();
    const char rows = has_commas() ? ',' : ' ';
    const char separator = separator_ == kCommaOrBlanks ? rows : separator_;
    if (separator != ' ') {
      for (std::string_view rest = line_;;) {
        const std::size_t end = std::min(rest.find(separator), rest.size());
        cells_.push_back(rest.substr(0, end));
        if (end == rest.size()) return;
        rest.remove_prefix(end + 1);
      }
    }
    for (std::size_t at = line_.find_first_not_of(" \t"); at < line_.size();) {
      const std::size_t end = std::min(line_.find_first_of(" \t", at), line_.size());
      cells_.push_back(line_.substr(at, end - at));
      at = line_.find_first_not_of(" \t", end);
    }
  }
  std::size_t Column(std::size_t i) const {
    return static_cast<std::size_t>(cells_[i].data() - line_.data()) + 1;
  }
  [[noreturn]] void Fail(std::size_t column, std::string_view key, std::string_view what,
                         std::string_view expected) const {
    const Place place{reader_.name(), reader_.number(), static_cast<int>(column)};
    throw Error(ExitCode::kBadData, ErrorLine(place, key, what, expected));
  }

  LineReader reader_;
  char separator_;
  bool may_be_torn_ = false;
  std::string_view line_;
  std::vector<std::string_view> cells_;
};

/// Columns 1 to 7 of a trajectory in the form of TUM, whose first is t, s.
inline constexpr std::array<const char*, 7> kTumPose = {"x", "y", "z", "qx", "qy", "qz", "qw"};

/// x y z and a quaternion of unit length to 1e-3, of columns 1 to 7, named by `names`.
inline std::array<double, 7> PoseNumbers(const NumberRows& rows,
                                         const std::array<const char*, 7>& names) {
  std::array<double, 7> values{};
  double length2 = 0.0;
  for (std::size_t i = 0; i < 7; ++i) {
    values[i] = rows.Number(i + 1, names[i]);
    if (i >= 3) length2 += values[i] * values[i];
  }
  if (std::abs(std::sqrt(length2) - 1.0) <= 1e-3) return values;
  rows.FailLine("quaternion of length " + std::to_string(std::sqrt(length2)), "length 1 to 1e-3");
}

}  // namespace alidade
