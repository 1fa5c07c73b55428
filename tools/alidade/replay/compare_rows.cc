// SPDX-License-Identifier: Apache-2.0
#include "alidade/replay/compare_rows.h"

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "alidade/io/output_file.h"

namespace alidade::internal {
namespace {

/// Reads the next row, including the line end if it exists. Returns false at the end of the stream.
bool ReadRow(std::istream& stream, std::string& row) {
  if (!std::getline(stream, row)) return false;
  if (!stream.eof()) row += '\n';
  return true;
}

/// Returns the cell of `row` that contains byte `offset`, or a part of that cell. The part has at
/// most kMaxBytes, of which at most kMaxBytesBefore precede the byte. Returns "" if the part is not
/// printable text.
std::string CellAt(const std::string& row, std::size_t offset) {
  constexpr std::size_t kMaxBytes = 40, kMaxBytesBefore = 20;
  const std::size_t comma = offset == 0 ? row.npos : row.rfind(',', offset - 1);
  std::size_t start = comma == row.npos ? 0 : comma + 1;
  if (offset - start > kMaxBytesBefore) start = offset - kMaxBytesBefore;
  start = std::min(row.find_first_not_of(' ', start), offset);
  const std::size_t end = std::min({row.find(',', offset), row.find('\n', offset), row.size()});
  const std::string cell = row.substr(std::min(start, end), std::min(end - start, kMaxBytes));
  const bool is_text = std::ranges::all_of(cell, [](char c) { return c >= ' ' && c <= '~'; });
  return is_text ? cell : "";
}

RowDifference DifferenceOf(const std::string& recorded, const std::string& current,
                           std::int64_t line) {
  const auto offset =
      static_cast<std::size_t>(std::ranges::mismatch(recorded, current).in1 - recorded.begin());
  const bool only_line_end = recorded + '\n' == current || current + '\n' == recorded;
  return {line, static_cast<std::int64_t>(offset) + 1, CellAt(recorded, offset),
          CellAt(current, offset), only_line_end};
}

/// Opens a file. If the file does not exist, the stream is in the failed state. Error: kIo if the
/// file exists but cannot be read.
std::ifstream OpenIfExists(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream && errno != ENOENT && errno != ENOTDIR) FailIo(file.string(), "read", errno);
  return stream;
}

}  // namespace

std::string RowDifference::Text() const {
  if (only_line_end) return "the line end differs";
  if (recorded.empty() && current.empty()) return "the bytes differ";
  return "now '" + current + "', was '" + recorded + '\'';
}

RowComparison CompareRows(std::istream& recorded, std::istream& current) {
  RowComparison comparison;
  for (std::string recorded_row, current_row;; ++comparison.rows) {
    comparison.recorded_has_more = ReadRow(recorded, recorded_row);
    comparison.current_has_more = ReadRow(current, current_row);
    if (!comparison.recorded_has_more || !comparison.current_has_more) return comparison;
    if (recorded_row == current_row) continue;
    comparison.difference = DifferenceOf(recorded_row, current_row, comparison.rows + 1);
    return comparison;
  }
}

RowComparison CompareRows(const std::filesystem::path& recorded,
                          const std::filesystem::path& current) {
  std::ifstream recorded_file = OpenIfExists(recorded), current_file = OpenIfExists(current);
  const RowComparison comparison = CompareRows(recorded_file, current_file);
  if (recorded_file.bad()) FailIo(recorded.string(), "read", EIO);
  if (current_file.bad()) FailIo(current.string(), "read", EIO);
  return comparison;
}

}  // namespace alidade::internal
