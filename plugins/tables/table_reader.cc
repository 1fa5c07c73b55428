// SPDX-License-Identifier: Apache-2.0
#include "table_reader.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/io/text_cell.h"

namespace alidade {
namespace {

[[noreturn]] void Fail(const Place& place, std::string_view problem, std::string_view expected) {
  throw Error(ExitCode::kBadData, ErrorLine(place, {}, problem, expected));
}

bool IsBlank(std::string_view line) { return line.find_first_not_of(" \t") == line.npos; }

std::vector<std::string> Cells(const TableRow& row) {
  std::vector<std::string> cells;
  for (std::size_t i = 0; i < row.size(); ++i) {
    cells.emplace_back(row.Text({{}, Node(nullptr), i}));
  }
  return cells;
}

/// Returns true if a cell is a number, which means that the line is not a header.
bool HasNumber(const std::vector<std::string>& cells) {
  double value = 0.0;
  return std::ranges::any_of(
      cells, [&](const std::string& text) { return cell::ParseNumber(text, value) == nullptr; });
}

}  // namespace

TableReader::TableReader(TableLayout layout, const std::filesystem::path& path,
                         const Node& path_node, bool any_order, TableCalibration& calibration)
    : layout_(std::move(layout)),
      reader_(path, path_node.place(), path_node.path()),
      row_(reader_.name(), layout_.missing),
      any_order_(any_order) {
  for (const TableField& stream : layout_.streams) max_delay_ = std::max(max_delay_, stream.delay);
  ReadHeader(calibration);
  if (layout_.blind_after < 1.0) CountRows(any_order);
}

/// Reads the next line that is a row. A blank line is a row in two cases: if the table has a single
/// column, whose cell may be missing, or if the row number determines the time.
bool TableReader::NextLine() {
  if (std::exchange(holds_line_, false)) return true;
  const bool skips_blank = column_count_ > 1 && layout_.time.column.has_value();
  while (reader_.Next(line_)) {
    if (!line_.starts_with('#') && !(skips_blank && IsBlank(line_))) return true;
  }
  return false;
}

void TableReader::ReadHeader(TableCalibration& calibration) {
  std::string comment;  // the last comment above the first line
  int comment_line = 0;
  bool found = false;
  while (!found && reader_.Next(line_)) {
    found = !line_.starts_with('#') && !IsBlank(line_);
    if (!line_.starts_with('#')) continue;
    calibration.Record(line_, reader_.name(), reader_.number());
    comment = line_.substr(1);
    comment_line = reader_.number();
  }
  if (!found) {
    Fail(Place{reader_.name()}, "the header line is missing", "a line that names the columns");
  }
  first_line_ = reader_.number();
  constexpr std::string_view kGzip = "\x1F\x8B";
  if (line_.starts_with(kGzip) || line_.find('\0') != line_.npos) {
    Fail(Place{reader_.name(), first_line_, 1}, "this is not a text file",
         "a table as text; to read a compressed table, use a pipe: zcat FILE | alidade run "
         "CONFIG --set source.path=-");
  }
  if (layout_.separator == '\0') layout_.separator = DetectSeparator(comment, comment_line);
  const Header header = HeaderWith(layout_.separator, comment, comment_line);
  holds_line_ = !header.is_line;
  reference_ = header.reference;
  column_count_ = header.names.size();
  ResolveColumns(header.names, reader_.name(), layout_);
}

/// Returns the names of the columns if `separator` is that of the table.
TableReader::Header TableReader::HeaderWith(char separator, std::string_view comment,
                                            int comment_line) {
  row_.Split(line_, first_line_, separator);
  if (!layout_.columns.empty()) return {layout_.columns, "'columns'", false};
  Header header{Cells(row_), "line " + std::to_string(first_line_), true};
  if (!HasNumber(header.names) || comment.empty()) return header;
  row_.Split(comment, comment_line, separator);
  if (row_.size() != header.names.size()) return header;
  return {Cells(row_), "line " + std::to_string(comment_line), false};
}

/// Returns the separator with which the header has the most columns of the config. A comma precedes
/// other separators, and a separator that the first line contains precedes one that it lacks.
char TableReader::DetectSeparator(std::string_view comment, int comment_line) {
  char best = ',';
  std::size_t highest = 0;
  for (const char separator : {',', ';', '\t', '|', ' '}) {
    const std::vector<std::string> names = HeaderWith(separator, comment, comment_line).names;
    row_.Split(line_, first_line_, separator);
    const std::size_t found = row_.size() == names.size() ? CountColumns(names, layout_) : 0;
    const std::size_t score = 2 * found + (row_.size() > 1 ? 1 : 0);
    if (score > highest) best = separator;
    highest = std::max(highest, score);
  }
  return best;
}

void TableReader::CountRows(bool any_order) {
  const Node& node = *layout_.blind_after_node;
  if (any_order) {
    node.Fail(
        "this key counts rows in the order of the file, but 'out_of_sequence.policy' reorders them",
        "'out_of_sequence.policy: reject', which requires a file in chronological order");
  }
  if (!reader_.is_regular()) {
    node.Fail("'" + reader_.name() + "' is a pipe, which cannot be read twice",
              "a regular file, whose rows can be counted first");
  }
  const bool holds_line = holds_line_;
  std::int64_t rows = 0;
  while (NextLine()) ++rows;
  reader_.Rewind();
  while (reader_.number() < first_line_) reader_.Next(line_);
  holds_line_ = holds_line;
  if (!layout_.time.repeats) size_ = rows;
  const double share = layout_.blind_after * static_cast<double>(rows);
  first_blind_row_ = static_cast<std::int64_t>(std::ceil(share * (1.0 - 1e-12)));
}

bool TableReader::Read() {
  do {
    has_row_ = NextLine();
    is_at_end_ = !has_row_;
    if (is_at_end_) {
      if (rows_ == 0) {
        Fail(Place{reader_.name()}, "the table has no rows", "a row below the header");
      }
      return false;
    }
    row_.Split(line_, reader_.number(), layout_.separator);
    row_.ExpectSize(column_count_, reference_, reader_.is_unterminated());
    timestamp_ = ReadTimestamp();
  } while (IsBeyondGap(timestamp_));
  CheckOrder(timestamp_);
  return true;
}

void TableReader::ReleaseRow() {
  if (timestamp_ >= newest_) {
    newest_ = timestamp_;
    newest_line_ = row_.number();
  }
  ++rows_;
  has_row_ = false;
}

Timestamp TableReader::EarliestNext() const {
  if (is_at_end_) return INT64_MAX;
  if (has_row_) return timestamp_ - max_delay_;
  if (rows_ == 0) return kNoTimestamp;
  return newest_ - max_delay_ + (layout_.time.repeats ? 0 : 1);
}

Timestamp TableReader::ReadTimestamp() const {
  const TableTime& time = layout_.time;
  if (!time.column) {
    return time.offset + TimestampFromSeconds(static_cast<double>(rows_) / time.rate_hz);
  }
  const double value = row_.Number(*time.column, false);
  const double t_s = value * std::pow(10.0, static_cast<double>(time.digits) - 9.0);
  const double sum_s = t_s + Seconds(time.offset);
  if (!(std::max(std::abs(t_s), std::abs(sum_s)) < cell::kTimeLimit)) {
    row_.Fail(*time.column, "is beyond 292 years",
              "-9.2e9 s to 9.2e9 s, or another unit, such as 'time: {unit: ns}'");
  }
  return time.offset + cell::ParseTimestamp(row_.Text(*time.column), value, time.digits);
}

void TableReader::CheckOrder(Timestamp timestamp) const {
  const TableTime& time = layout_.time;
  const bool is_same_time = timestamp == newest_;
  if (any_order_ || rows_ == 0 || timestamp > newest_ || (is_same_time && time.repeats)) return;
  row_.Fail(*time.column,
            (is_same_time ? "is the same time as in line " : "is earlier than in line ") +
                std::to_string(newest_line_),
            is_same_time
                ? "increasing times, or 'time.repeats: true', which joins rows of one time into a "
                  "frame, or 'out_of_sequence.policy: buffer', which joins rows of different "
                  "streams"
                : "increasing times, or 'out_of_sequence.policy: buffer' or 'rollback'");
}

/// Returns true if the row is further ahead than `max_gap_s` allows and is skipped. Fails if such a
/// row is an error, or if a long series of rows was skipped, because the clock then has changed.
bool TableReader::IsBeyondGap(Timestamp timestamp) {
  constexpr int kMaxSkipped = 100;
  const TableTime& time = layout_.time;
  const bool is_beyond =
      time.max_gap && rows_ > 0 && timestamp > newest_ &&
      TimeBetween(newest_, timestamp) > static_cast<std::uint64_t>(*time.max_gap);
  skipped_ = is_beyond ? skipped_ + 1 : 0;
  if (!is_beyond || (time.skips_gaps && skipped_ <= kMaxSkipped)) return is_beyond;
  const std::string gap = internal::SecondsText(*time.max_gap);
  row_.Fail(*time.column,
            "is more than " + gap + " after line " + std::to_string(newest_line_) +
                (time.skips_gaps ? ", as are the " + std::to_string(kMaxSkipped) + " rows before it"
                                 : ""),
            time.skips_gaps ? "a larger 'max_gap_s'" : "a larger 'max_gap_s', or 'on_gap: skip'");
}

}  // namespace alidade
