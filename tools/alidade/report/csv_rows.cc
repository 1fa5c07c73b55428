// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/csv_rows.h"

#include <algorithm>
#include <cmath>

#include "alidade/io/run_files.h"
#include "alidade/io/text_cell.h"

namespace alidade::internal {

CsvRows::CsvRows(const std::filesystem::path& file, std::size_t last_rows) : file_(file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return;
  RequireFile(file);
  stream_.open(file, std::ios::binary);
  if (!stream_) FailFile(file, 0, "the file cannot be read");
  if (ReadRow()) names_.assign(cells_.begin(), cells_.end());
  if (last_rows != kAllRows && !names_.empty()) SkipToLast(last_rows);
}

/// Moves to the first of the last `rows` complete rows. Reads only the end of the file.
void CsvRows::SkipToLast(std::size_t rows) {
  constexpr std::streamoff kBlock = 1 << 16;
  const std::streamoff first = stream_.tellg();
  stream_.seekg(0, std::ios::end);
  std::string block;
  std::size_t ends = 0;  // number of line ends from the current place on
  for (std::streamoff start = stream_.tellg(); start > first;) {
    const std::streamoff size = std::min(kBlock, start - first);
    block.resize(static_cast<std::size_t>(size));
    stream_.seekg(start -= size);
    stream_.read(block.data(), size);
    for (std::size_t i = block.size(); i-- > 0;) {
      // The line end before the first row counts too.
      if (block[i] != '\n' || ++ends <= rows) continue;
      stream_.seekg(start + static_cast<std::streamoff>(i) + 1);
      return;
    }
  }
  stream_.seekg(first);
}

std::optional<std::size_t> CsvRows::Find(std::string_view name) const {
  const auto found = std::ranges::find(names_, name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

bool CsvRows::Next() {
  if (names_.empty() || !ReadRow()) return false;
  ++count_;
  if (cells_.size() != names_.size()) {
    FailFile(file_, static_cast<int>(count_) + 1,
             "the number of cells differs from that of the header");
  }
  return true;
}

/// Reads the text up to the next line end that is not inside quotes.
bool CsvRows::ReadRow() {
  text_.clear();
  std::string line;
  do {
    std::getline(stream_, line);
    if (stream_.bad()) FailFile(file_, 0, "the file cannot be read");
    if (stream_.eof() || stream_.fail()) return false;
    text_ += text_.empty() ? line : '\n' + line;
  } while (std::ranges::count(text_, '"') % 2 != 0);
  ParseRow();
  return true;
}

void CsvRows::ParseRow() {
  cells_.clear();
  unquoted_.clear();
  const std::string_view text = text_;
  for (std::size_t position = 0; position <= text.size(); ++position) {
    const std::size_t begin = position;
    if (!text.substr(position).starts_with('"')) {
      position = std::min(text.find(',', position), text.size());
      cells_.push_back(text.substr(begin, position - begin));
      continue;
    }
    std::string& cell = unquoted_.emplace_back();
    for (++position; position < text.size(); ++position) {
      if (text[position] == '"' && (++position == text.size() || text[position] != '"')) break;
      cell += text[position];
    }
    cells_.emplace_back(cell);
  }
}

Timestamp TimeOf(std::string_view cell) {
  double seconds = 0.0;
  const bool is_time =
      cell::ParseNumber(cell, seconds) == nullptr && std::abs(seconds) < cell::kTimeLimit;
  return is_time ? cell::ParseTimestamp(cell, seconds, 9) : kNoTimestamp;
}

}  // namespace alidade::internal
