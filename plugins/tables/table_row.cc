// SPDX-License-Identifier: Apache-2.0
#include "table_row.h"

#include <algorithm>
#include <cctype>

#include "alidade/io/text_cell.h"

namespace alidade {
namespace {

constexpr std::string_view kBlanks = " \t";

}  // namespace

void TableRow::Split(std::string_view line, int number, char separator) {
  line_ = line;
  number_ = number;
  cells_.clear();
  const bool is_blank = separator == ' ';
  const std::string_view separators = is_blank ? kBlanks : std::string_view(&separator, 1);
  for (std::string_view remaining = line_;;) {
    if (is_blank) {
      remaining.remove_prefix(std::min(remaining.find_first_not_of(kBlanks), remaining.size()));
      if (remaining.empty() && !cells_.empty()) return;
    }
    const std::size_t end = std::min(remaining.find_first_of(separators), remaining.size());
    cells_.push_back(remaining.substr(0, end));
    if (end == remaining.size()) return;
    remaining.remove_prefix(end + 1);
  }
}

std::string_view TableRow::Text(const TableColumn& column) const {
  return cell::Trim(cells_[column.index]);
}

bool TableRow::IsMissing(const TableColumn& column) const {
  return std::ranges::find(missing_, Text(column)) != missing_.end();
}

double TableRow::Number(const TableColumn& column, bool may_miss) const {
  double value = 0.0;
  const std::string_view text = Text(column);
  const char* const problem = cell::ParseNumber(text, value);
  if (problem == nullptr) return value;
  const bool may_mark = may_miss && !text.empty() && text.find_first_of("0123456789") == text.npos;
  Fail(column, text.empty() ? "is an empty cell" : problem,
       may_mark ? "a finite number, or '" + MissingWith(text) + '\'' : "a finite number");
}

/// Returns the key `missing` with the text of a further cell.
std::string TableRow::MissingWith(std::string_view text) const {
  const auto quoted = [](std::string_view word) {
    const bool is_plain = !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
      return std::isalpha(c) != 0;
    });
    return is_plain ? cell::PrintableStart(word) : '"' + cell::PrintableStart(word) + '"';
  };
  std::string list;
  for (const std::string& word : missing_) {
    if (!word.empty()) list += quoted(word) + ", ";
  }
  return "missing: [" + list + quoted(text) + ']';
}

std::size_t TableRow::ColumnNumber(std::size_t index) const {
  return static_cast<std::size_t>(cells_[index].data() - line_.data()) + 1;
}

void TableRow::Fail(const TableColumn& column, const std::string& problem,
                    std::string_view expected) const {
  const Place place{file_, number_, static_cast<int>(ColumnNumber(column.index))};
  throw Error(ExitCode::kBadData,
              ErrorLine(place, column.name,
                        '\'' + cell::PrintableStart(Text(column)) + "' " + problem, expected));
}

void TableRow::ExpectSize(std::size_t count, const std::string& reference,
                          bool is_unterminated) const {
  if (size() == count) return;
  const auto columns = [](std::size_t n) {
    return std::to_string(n) + (n == 1 ? " column" : " columns");
  };
  const bool is_too_short = size() < count;
  const std::size_t column = is_too_short ? line_.size() + 1 : ColumnNumber(count);
  throw Error(ExitCode::kBadData,
              ErrorLine(Place{file_, number_, static_cast<int>(column)}, {},
                        (is_too_short && is_unterminated ? "the last line is cut short: it has "
                                                         : "the line has ") +
                            columns(size()),
                        columns(count) + ", as in " + reference));
}

}  // namespace alidade
