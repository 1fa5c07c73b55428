// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/csv_columns.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>

#include "alidade/io/read_file.h"
#include "alidade/io/run_files.h"
#include "alidade/io/text_cell.h"

namespace alidade::internal {
namespace {

/// Returns the header and the last `rows` complete rows of a file. Reads only the end of the file.
/// Quoted cells must not contain line ends.
std::string HeaderAndLastRows(std::ifstream file, std::size_t rows) {
  constexpr std::streamoff kBlock = 1 << 16;
  std::string header;
  if (!std::getline(file, header) || file.eof()) return "";
  const std::streamoff begin = file.tellg();
  file.seekg(0, std::ios::end);
  std::string text;
  std::size_t ends = 0;  // number of line ends in `text`
  for (std::streamoff start = file.tellg(); start > begin && ends <= rows;) {
    const std::streamoff size = std::min(kBlock, start - begin);
    std::string block(static_cast<std::size_t>(size), '\0');
    file.seekg(start -= size);
    file.read(block.data(), size);
    ends += static_cast<std::size_t>(std::ranges::count(block, '\n'));
    text.insert(0, block);
  }
  std::size_t end = text.rfind('\n');  // of the row before the first one to return
  for (std::size_t row = 0; row < rows && end != text.npos; ++row) {
    end = end == 0 ? text.npos : text.rfind('\n', end - 1);
  }
  return header + '\n' + text.substr(end == text.npos ? 0 : end + 1);
}

}  // namespace

CsvColumns::CsvColumns(const std::filesystem::path& file, std::size_t last_rows) : file_(file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return;
  RequireFile(file);
  *text_ =
      last_rows == kAllRows
          ? ReadFile(file, [&](ExitCode, int) { FailFile(file, 0, "the file cannot be read"); })
          : HeaderAndLastRows(OpenFile(file), last_rows);
  Parse();
}

void CsvColumns::Keep(std::size_t first, std::size_t count) {
  const auto cell = [&](std::size_t row) {
    return cells_.begin() + static_cast<std::ptrdiff_t>(row * width());
  };
  cells_ = std::vector(cell(first), cell(first + count));
}

void CsvColumns::Fail(std::size_t row, const std::string& problem) const {
  FailFile(file_, static_cast<int>(row) + 2, problem);
}

std::string_view CsvColumns::ParseCell(std::size_t& position) {
  const std::string_view text = *text_;
  const std::size_t begin = position;
  if (position >= text.size() || text[position] != '"') {
    position = std::min(text.find_first_of(",\n", position), text.size());
    return text.substr(begin, position - begin);
  }
  std::string& cell = *unquoted_.emplace_back(std::make_unique<std::string>());
  for (++position; position < text.size(); ++position) {
    if (text[position] == '"' && (++position == text.size() || text[position] != '"')) break;
    cell += text[position];
  }
  return cell;
}

void CsvColumns::Parse() {
  std::vector<std::string_view> row;
  for (std::size_t position = 0; position < text_->size();) {
    row.push_back(ParseCell(position));
    if (position >= text_->size()) break;  // the last row is incomplete
    if ((*text_)[position++] == ',') continue;
    if (names_.empty()) {
      names_ = row;
    } else if (row.size() == names_.size()) {
      cells_.insert(cells_.end(), row.begin(), row.end());
    } else {
      Fail(rows(), "the number of cells differs from that of the header");
    }
    row.clear();
  }
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
  for (std::size_t i = *column; i < cells_.size(); i += width()) texts.push_back(cells_[i]);
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
      Fail(numbers.size() - 1, "the column '" + std::string(name) + "' contains '" +
                                   cell::PrintableStart(text) + "', which is not a number");
    }
  }
  numbers.resize(rows(), kNan);
  return numbers;
}

std::vector<Timestamp> CsvColumns::Times(std::string_view name) const {
  std::vector<Timestamp> times;
  const std::vector<double> numbers = Numbers(name);
  for (const std::string_view text : Texts(name)) {
    const double seconds = numbers[times.size()];
    const bool is_known = std::abs(seconds) < cell::kTimeLimit;
    times.push_back(is_known ? cell::ParseTimestamp(text, seconds, 9) : kNoTimestamp);
  }
  return times;
}

}  // namespace alidade::internal
