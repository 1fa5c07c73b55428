// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/compare_rows.h"

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "alidade/io/output_file.h"

namespace alidade::internal {
namespace {

/// The next row with its line end, where it has one.
bool NextRow(std::istream& stream, std::string& row) {
  if (!std::getline(stream, row)) return false;
  if (!stream.eof()) row += '\n';
  return true;
}

/// The cell of `row` that byte `at` is in, not too much of it; "" where it is no text.
std::string CellAt(const std::string& row, std::size_t at) {
  constexpr std::size_t kMost = 40, kBefore = 20;
  const std::size_t comma = at == 0 ? row.npos : row.rfind(',', at - 1);
  std::size_t start = comma == row.npos ? 0 : comma + 1;
  if (at - start > kBefore) start = at - kBefore;
  start = std::min(row.find_first_not_of(' ', start), at);
  const std::size_t end = std::min({row.find(',', at), row.find('\n', at), row.size()});
  const std::string cell = row.substr(std::min(start, end), std::min(end - start, kMost));
  const bool text = std::ranges::all_of(cell, [](char c) { return c >= ' ' && c <= '~'; });
  return text ? cell : "";
}

RowDifference DifferenceOf(const std::string& before, const std::string& now, std::int64_t line) {
  const auto at = static_cast<std::size_t>(std::ranges::mismatch(before, now).in1 - before.begin());
  const bool only_line_end = before + '\n' == now || now + '\n' == before;
  return {line, static_cast<std::int64_t>(at) + 1, CellAt(before, at), CellAt(now, at),
          only_line_end};
}

/// A stream that fails where the file is not there. Error: kIo.
std::ifstream Opened(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream && errno != ENOENT && errno != ENOTDIR) FailIo(file.string(), "read", errno);
  return stream;
}

}  // namespace

std::string RowDifference::Text() const {
  if (only_line_end) return "line end";
  if (before.empty() && now.empty()) return "other bytes";
  return "now '" + now + "', was '" + before + '\'';
}

RowComparison CompareRows(std::istream& before, std::istream& now) {
  RowComparison comparison;
  for (std::string was, is;; ++comparison.rows) {
    comparison.before_goes_on = NextRow(before, was);
    comparison.now_goes_on = NextRow(now, is);
    if (!comparison.before_goes_on || !comparison.now_goes_on) return comparison;
    if (was == is) continue;
    comparison.difference = DifferenceOf(was, is, comparison.rows + 1);
    return comparison;
  }
}

RowComparison CompareRows(const std::filesystem::path& before, const std::filesystem::path& now) {
  std::ifstream was = Opened(before), is = Opened(now);
  const RowComparison comparison = CompareRows(was, is);
  if (was.bad()) FailIo(before.string(), "read", EIO);
  if (is.bad()) FailIo(now.string(), "read", EIO);
  return comparison;
}

}  // namespace alidade::internal
