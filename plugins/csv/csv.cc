// SPDX-License-Identifier: Apache-2.0
#include "csv.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "alidade/io/line_reader.h"
#include "alidade/io/text_cell.h"
#include "csv_calibration.h"
#include "csv_layout.h"

namespace alidade {
namespace {

class CsvSource : public Source {
 public:
  explicit CsvSource(const SourceArguments& arguments)
      : layout_(ReadCsvLayout(arguments.entry)),
        reader_(Open(arguments)),
        any_order_(arguments.any_order) {
    for (const CsvField& field : layout_.streams) streams_.push_back(field.info);
    for (const CsvField& field : layout_.truths) truths_.push_back(field.info);
    ReadHeader();
    if (layout_.blind_after < 1.0) CountRows();
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  std::int64_t size() const override { return size_; }
  Place place() const override { return {reader_.name(), last_line_, 0}; }
  std::optional<Config> Calibration() const override { return calibration_.Get(); }

  bool Next(SourceFrame& frame) override {
    if (!has_row_ && !ReadRow()) {
      if (rows_ == 0) {
        Fail(Place{reader_.name()}, {}, "the table has no rows", "a row below the header");
      }
      return false;
    }
    frame.timestamp = timestamp_;
    frame.truth.resize(layout_.truths.size());
    for (std::vector<double>& truth : frame.truth) truth.clear();
    std::size_t count = 0;
    do {
      AppendRow(frame, count);
    } while (layout_.time_repeats && ReadRow() && timestamp_ == frame.timestamp);
    frame.measurements.resize(count);
    return true;
  }

 private:
  /// Reads the next row and its time. Returns false at the end.
  bool ReadRow() {
    has_row_ = NextRow();
    if (!has_row_) return false;
    Split();
    CheckColumns();
    timestamp_ = ReadTimestamp();
    return true;
  }

  /// Appends the measurements of the row to `frame`. The first `count` measurements of `frame` are
  /// already set. Increases `count`.
  void AppendRow(SourceFrame& frame, std::size_t& count) {
    for (std::size_t i = 0; i < layout_.streams.size(); ++i) {
      if (count == frame.measurements.size()) frame.measurements.emplace_back();
      Measurement& measurement = frame.measurements[count];
      if (!ReadField(layout_.streams[i], measurement.values)) continue;
      if (!ReadKnown(layout_.streams[i], measurement.known)) continue;
      if (layout_.streams[i].goes_blind && rows_ >= first_blind_row_) continue;
      measurement.timestamp = frame.timestamp;
      measurement.stream = static_cast<int>(i);
      measurement.landmark = -1;
      measurement.covariance.clear();
      ++count;
    }
    for (std::size_t i = 0; i < frame.truth.size(); ++i) {
      if (frame.truth[i].empty()) ReadField(layout_.truths[i], frame.truth[i]);
    }
    last_timestamp_ = timestamp_;
    last_line_ = reader_.number();
    ++rows_;
    has_row_ = false;
  }

  static LineReader Open(const SourceArguments& arguments) {
    const Node path = arguments.entry.At("path", "csv");
    return {Path(path, arguments.folder), path.place(), path.path()};
  }
  static std::filesystem::path Path(const Node& node, const std::filesystem::path& folder) {
    const std::filesystem::path path = node.Text();
    if (path.empty()) node.Fail("the path is empty", "a file, or '-' for standard input");
    return path == "-" ? path : folder / path;
  }

  /// Reads the next line that is neither a comment nor blank. In two cases a blank line is a row:
  /// if the table has a single column, whose cell may be missing, or if the row number determines
  /// the time.
  bool NextRow() {
    while (reader_.Next(line_)) {
      if (line_.starts_with('#')) {
        if (names_.empty()) calibration_.Record(line_, reader_.name(), reader_.number());
        continue;
      }
      const bool blank = line_.find_first_not_of(" \t") == std::string_view::npos;
      const bool skips_blank = names_.empty() || (names_.size() > 1 && layout_.rate_hz == 0.0);
      if (!blank || !skips_blank) return true;
    }
    return false;
  }

  /// Splits line_ into cells_, which are not trimmed.
  void Split() {
    cells_.clear();
    for (std::string_view remaining = line_;;) {
      const std::size_t end = std::min(remaining.find(layout_.separator), remaining.size());
      cells_.push_back(remaining.substr(0, end));
      if (end == remaining.size()) return;
      remaining.remove_prefix(end + 1);
    }
  }

  void ReadHeader() {
    if (!NextRow())
      Fail(Place{reader_.name()}, {}, "the header line is missing",
           "a line that names the columns");
    header_line_ = last_line_ = reader_.number();
    constexpr std::string_view kGzip = "\x1F\x8B";
    if (line_.starts_with(kGzip) || line_.find('\0') != line_.npos) {
      Fail(Place{reader_.name(), header_line_, 1}, {}, "this is not a text file",
           "a table as text; to read a compressed table, use a pipe: zcat FILE | alidade run "
           "CONFIG --set source.path=-");
    }
    Split();
    std::vector<std::string> names;
    for (const std::string_view cell : cells_) names.emplace_back(cell::Trim(cell));
    names_ = std::move(names);
    ResolveColumns(names_, reader_.name(), layout_);
  }

  void CountRows() {
    if (any_order_) {
      layout_.blind_after_node->Fail(
          "this key counts rows in the order of the file, but 'out_of_sequence.policy' reorders "
          "them",
          "'out_of_sequence.policy: reject', which requires a file in chronological order");
    }
    if (!reader_.is_regular()) {
      layout_.blind_after_node->Fail(
          "'" + reader_.name() + "' is a pipe, which cannot be read twice",
          "a regular file, whose rows can be counted first");
    }
    std::int64_t rows = 0;
    while (NextRow()) ++rows;
    reader_.Rewind();
    NextRow();  // skips the header
    if (!layout_.time_repeats) size_ = rows;
    const double share = layout_.blind_after * static_cast<double>(rows);
    first_blind_row_ = static_cast<std::int64_t>(std::ceil(share * (1.0 - 1e-12)));
  }

  void CheckColumns() const {
    const auto count = [](std::size_t n) {
      return std::to_string(n) + (n == 1 ? " column" : " columns");
    };
    if (cells_.size() == names_.size()) return;
    const bool is_too_short = cells_.size() < names_.size();
    const std::size_t column = is_too_short ? line_.size() : Column(cells_[names_.size()]) - 1;
    Fail(Place{reader_.name(), reader_.number(), static_cast<int>(column) + 1}, {},
         (is_too_short && reader_.is_unterminated() ? "the last line is cut short: it has "
                                                    : "the line has ") +
             count(cells_.size()),
         count(names_.size()) + ", as in line " + std::to_string(header_line_));
  }

  bool Missing(std::string_view cell) const {
    return std::find(layout_.missing.begin(), layout_.missing.end(), cell) != layout_.missing.end();
  }

  /// Reads the values of a field. Returns false and clears `values` if a cell of the field marks a
  /// missing value.
  bool ReadField(const CsvField& field, std::vector<double>& values) const {
    values.clear();
    for (const CsvColumn& column : field.columns) {
      if (Missing(cell::Trim(cells_[column.index]))) continue;
      const double x = ReadNumber(column);
      const double value = field.reciprocal ? field.gain / x : field.gain * x;
      if (!std::isfinite(value)) {
        FailCell(column, field.reciprocal ? "has no finite reciprocal"
                                          : "is too large to be multiplied by the gain");
      }
      values.push_back(value);
    }
    if (values.size() < field.columns.size()) values.clear();
    return !values.empty();
  }

  /// Reads the known values of a field. Returns false if a cell of these values marks a missing
  /// value.
  bool ReadKnown(const CsvField& field, std::vector<double>& known) const {
    known.clear();
    for (const CsvColumn& column : field.known) {
      if (Missing(cell::Trim(cells_[column.index]))) return false;
      known.push_back(ReadNumber(column));
    }
    return true;
  }

  /// Returns the key `source.missing` with the text of a further cell.
  std::string MissingWith(std::string_view text) const {
    const auto quoted = [](std::string_view word) {
      const bool is_plain = !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
        return std::isalpha(c) != 0;
      });
      return is_plain ? cell::PrintableStart(word) : '"' + cell::PrintableStart(word) + '"';
    };
    std::string list;
    for (const std::string& word : layout_.missing) list += quoted(word) + ", ";
    return "source.missing: [" + list + quoted(text) + ']';
  }

  double ReadNumber(const CsvColumn& column, bool may_miss = true) const {
    double value = 0.0;
    const std::string_view text = cell::Trim(cells_[column.index]);
    const char* const problem = cell::ParseNumber(text, value);
    if (problem == nullptr) return value;
    const bool may_mark = may_miss && text.find_first_of("0123456789") == text.npos;
    FailCell(column, text.empty() ? "is an empty cell" : problem,
             may_mark ? "a finite number, or '" + MissingWith(text) + '\'' : "a finite number");
  }

  Timestamp ReadTimestamp() const {
    if (!layout_.time) return TimestampFromSeconds(static_cast<double>(rows_) / layout_.rate_hz);
    const CsvColumn& column = *layout_.time;
    const double value = ReadNumber(column, false);
    const double t_s = value * std::pow(10.0, static_cast<double>(layout_.time_digits) - 9.0);
    if (!(std::abs(t_s) < cell::kTimeLimit)) {
      FailCell(column, "is beyond 292 years",
               "-9.2e9 s to 9.2e9 s, or another unit, such as 'source.time: {unit: ns}'");
    }
    const Timestamp timestamp =
        cell::ParseTimestamp(cell::Trim(cells_[column.index]), value, layout_.time_digits);
    const bool is_same_time = timestamp == last_timestamp_;
    if (!any_order_ && rows_ > 0 && timestamp <= last_timestamp_ &&
        !(is_same_time && layout_.time_repeats)) {
      const bool is_earlier = timestamp < last_timestamp_;
      FailCell(
          column,
          (is_earlier ? "is earlier than in line " : "is the same time as in line ") +
              std::to_string(last_line_),
          is_earlier
              ? "increasing times, or 'out_of_sequence.policy: buffer' or 'rollback'"
              : "increasing times, or 'time.repeats: true', which joins rows of one time into a "
                "frame, or 'out_of_sequence.policy: buffer', which joins rows of different "
                "streams");
    }
    return timestamp;
  }

  std::size_t Column(std::string_view cell) const {
    return static_cast<std::size_t>(cell.data() - line_.data()) + 1;
  }

  [[noreturn]] void FailCell(const CsvColumn& column, const std::string& problem,
                             std::string_view expected = "a finite number") const {
    const int column_number = static_cast<int>(Column(cells_[column.index]));
    Fail(Place{reader_.name(), reader_.number(), column_number}, column.name,
         '\'' + cell::PrintableStart(cell::Trim(cells_[column.index])) + "' " + problem, expected);
  }
  [[noreturn]] static void Fail(const Place& place, std::string_view key, std::string_view problem,
                                std::string_view expected) {
    throw Error(ExitCode::kBadData, ErrorLine(place, key, problem, expected));
  }

  CsvLayout layout_;
  LineReader reader_;
  CsvCalibration calibration_;
  bool any_order_;
  std::vector<StreamInfo> streams_, truths_;
  std::vector<std::string> names_;
  int header_line_ = 0;
  std::int64_t size_ = -1, first_blind_row_ = INT64_MAX;

  std::string_view line_;
  std::vector<std::string_view> cells_;
  bool has_row_ = false;     ///< true if the last row that was read is not in a frame yet
  Timestamp timestamp_ = 0;  ///< time of the last row that was read
  std::int64_t rows_ = 0;    ///< number of rows in frames so far
  Timestamp last_timestamp_ = 0;
  int last_line_ = 0;
};

}  // namespace

std::unique_ptr<Source> CreateCsv(const SourceArguments& arguments) {
  return std::make_unique<CsvSource>(arguments);
}

}  // namespace alidade
