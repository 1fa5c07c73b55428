// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/csv_columns.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "alidade/io/run_files.h"
#include "alidade/io/text_cell.h"
#include "alidade/report/csv_rows.h"

namespace alidade::internal {

CsvColumns::CsvColumns(const std::filesystem::path& file, const RowSelection& selection)
    : file_(file) {
  CsvRows table(file, selection.last);
  names_ = table.names();
  const auto& rows = selection.rows;
  for (std::size_t next = 0; table.Next();) {
    if (rows) {
      if (next == rows->size() || (*rows)[next] != table.row()) continue;
      ++next;
    }
    lines_.push_back(static_cast<std::uint32_t>(table.row()));
    for (const std::string_view cell : table.cells()) {
      text_ += cell;
      ends_.push_back(text_.size());
    }
  }
}

void CsvColumns::Keep(std::size_t first, std::size_t count) {
  const std::size_t first_cell = first * names_.size();
  const auto begin = ends_.begin() + static_cast<std::ptrdiff_t>(first_cell);
  const std::size_t start = first_cell == 0 ? 0 : ends_[first_cell - 1];
  ends_ = std::vector(begin, begin + static_cast<std::ptrdiff_t>(count * names_.size()));
  for (std::size_t& end : ends_) end -= start;
  text_.erase(0, start);
  const auto line = lines_.begin() + static_cast<std::ptrdiff_t>(first);
  lines_ = std::vector(line, line + static_cast<std::ptrdiff_t>(count));
}

std::optional<std::size_t> CsvColumns::Find(std::string_view name) const {
  const auto found = std::ranges::find(names_, name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

std::vector<std::string_view> CsvColumns::Texts(std::string_view name) const {
  const auto column = Find(name);
  std::vector<std::string_view> texts;
  if (!column) return texts;
  for (std::size_t i = *column; i < ends_.size(); i += names_.size()) {
    const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
    texts.push_back(std::string_view(text_).substr(begin, ends_[i] - begin));
  }
  return texts;
}

std::vector<double> CsvColumns::Numbers(std::string_view name) const {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> numbers;
  for (const std::string_view text : Texts(name)) {
    double& number = numbers.emplace_back(kNan);
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, number);
    if (!text.empty() && (error != std::errc() || end != last)) {
      FailFile(file_, static_cast<int>(lines_[numbers.size() - 1]) + 2,
               "the column '" + std::string(name) + "' contains '" + cell::PrintableStart(text) +
                   "', which is not a number");
    }
  }
  numbers.resize(rows(), kNan);
  return numbers;
}

std::vector<Timestamp> CsvColumns::Times(std::string_view name) const {
  static_cast<void>(Numbers(name));  // rejects a cell that is not a number
  std::vector<Timestamp> times;
  for (const std::string_view text : Texts(name)) times.push_back(TimeOf(text));
  return times;
}

}  // namespace alidade::internal
