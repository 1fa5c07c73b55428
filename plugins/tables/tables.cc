// SPDX-License-Identifier: Apache-2.0
#include "tables.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/io/log.h"
#include "alidade/io/near_file.h"
#include "data_unit.h"
#include "field_values.h"
#include "known_table.h"
#include "local_frame.h"
#include "table_calibration.h"
#include "table_layout.h"
#include "table_reader.h"

namespace alidade {
namespace {

std::optional<GeodeticPosition> ReadOrigin(const Node& entry) {
  const std::optional<Node> node = entry.Find("origin");
  if (!node) return std::nullopt;
  GeodeticPosition origin;
  origin.latitude_deg = node->At("latitude_deg").Number(-90.0, 90.0, false, false, "deg");
  origin.longitude_deg = node->At("longitude_deg").Number(-360.0, 360.0, false, false, "deg");
  if (const auto height = node->Find("height_m")) origin.height_m = height->Number();
  node->RejectUnread();
  return origin;
}

std::filesystem::path ReadPath(const Node& node, const std::filesystem::path& folder) {
  const std::filesystem::path path = node.Text();
  if (path.empty()) node.Fail("the path is empty", "a file, or '-' for standard input");
  return path == "-" ? path : folder / path;
}

class TablesSource : public Source {
 public:
  explicit TablesSource(const SourceArguments& arguments)
      : any_order_(arguments.any_order), local_frame_(ReadOrigin(arguments.entry)) {
    const std::optional<Node> files = arguments.entry.Find("files");
    if (!files) {
      AddTable(arguments.entry, arguments.folder);
      return;
    }
    std::filesystem::path folder = arguments.folder;
    if (const auto path = arguments.entry.Find("path")) {
      folder = ReadPath(*path, folder);
      if (!std::filesystem::is_directory(folder)) {
        throw Error(
            ExitCode::kInputMissing,
            ErrorLine(path->place(), path->path(), "there is no folder '" + folder.string() + "'",
                      "the folder of the files", internal::NearFile(folder)));
      }
    }
    for (const Node& file : files->Items()) {
      file.ExpectMap("{path: gps.csv, streams: {gps: [x, y]}}");
      AddTable(file, folder);
      file.RejectUnread();
    }
  }

  const std::vector<StreamInfo>& streams() const override { return streams_; }
  const std::vector<StreamInfo>& truths() const override { return truths_; }
  std::int64_t size() const override {
    return tables_.size() == 1 ? tables_.front().reader->size() : -1;
  }
  Place place() const override { return place_; }
  std::optional<Config> Calibration() const override { return calibration_.Get(); }

  void CheckUnits(std::size_t stream, const std::vector<std::string>& units,
                  const std::string& quantity) const override {
    const auto next = std::ranges::upper_bound(tables_, stream, {},
                                               [](const Table& t) { return t.first_stream; });
    const Table& table = *std::prev(next);
    const TableField& field = table.reader->layout().streams[stream - table.first_stream];
    if (field.geodetic || field.reciprocal) return;
    for (std::size_t i = 0; i < field.conversions.size(); ++i) {
      const Conversion& conversion = field.conversions[i];
      const std::optional<DataUnit> expected = ParseDataUnit(units[i]);
      if (!expected || !conversion.unit_node || std::abs(conversion.gain) != 1.0) continue;
      const std::string unit = conversion.unit_node->Text();
      if (ParseDataUnit(unit)->dimensions == expected->dimensions) continue;
      conversion.unit_node->Fail(
          "'" + unit + "' cannot be converted to " + units[i] + ", the unit of " + quantity,
          "a unit of the same dimension, or a gain that converts the dimension");
    }
  }

  bool Next(SourceFrame& frame) override {
    while (!HasCompleteFrame()) {
      if (!ReadRows() && frames_.empty()) return false;
    }
    frame = std::move(frames_.front().frame);
    std::ranges::stable_sort(frame.measurements, {}, &Measurement::stream);
    place_ = std::move(frames_.front().place);
    frames_.pop_front();
    return true;
  }

 private:
  struct Table {
    std::unique_ptr<TableReader> reader;
    /// Index of the first stream and truth of the table in the lists of the source.
    std::size_t first_stream, first_truth;
  };
  struct PendingFrame {
    SourceFrame frame;
    Place place;  ///< place of the last row of the frame
  };

  void AddTable(const Node& entry, const std::filesystem::path& folder) {
    TableLayout layout = ReadTableLayout(entry);
    layout.streams = ReadKnownTables(entry, folder, std::move(layout.streams));
    const Node path = entry.At("path", "tables");
    const auto is_standard_input = [](const Table& table) {
      return table.reader->name() == "<stdin>";
    };
    if (path.Text() == "-" && std::ranges::any_of(tables_, is_standard_input)) {
      path.Fail("an earlier file is already read from standard input", "a file or a named pipe");
    }
    tables_.push_back({nullptr, streams_.size(), truths_.size()});
    AddNames(layout.streams, entry, streams_);
    last_rows_.resize(streams_.size(), kNoTimestamp);
    AddNames(layout.truths, entry, truths_);
    tables_.back().reader = std::make_unique<TableReader>(std::move(layout), ReadPath(path, folder),
                                                          path, any_order_, calibration_);
  }

  /// Reads the tables of known numbers. Returns the streams, with one stream for each id in place
  /// of a stream whose name contains `*`.
  static std::vector<TableField> ReadKnownTables(const Node& entry,
                                                 const std::filesystem::path& folder,
                                                 std::vector<TableField> fields) {
    std::vector<TableField> streams;
    for (TableField& field : fields) {
      if (field.known_table) ReadKnownTable(folder, *field.known_table);
      if (field.info.name.find('*') == std::string::npos) {
        streams.push_back(std::move(field));
        continue;
      }
      if (!field.known_table) {
        entry.At("streams")
            .At(field.info.name)
            .Fail("the name contains `*`, which stands for the ids of a table of known numbers",
                  "known: {path: beacons.csv, id: beacon, columns: [x, y]}, or a name without `*`");
      }
      std::ranges::move(StreamsById(field), std::back_inserter(streams));
    }
    return streams;
  }

  static void AddNames(const std::vector<TableField>& fields, const Node& entry,
                       std::vector<StreamInfo>& infos) {
    for (const TableField& field : fields) {
      if (std::ranges::find(infos, field.info.name, &StreamInfo::name) != infos.end()) {
        entry.Fail("'" + field.info.name + "' is also in an earlier file",
                   "each stream and each truth in one file");
      }
      infos.push_back(field.info);
    }
  }

  /// Returns true if the first frame can be returned: if no later row can add to it or precede it.
  bool HasCompleteFrame() const {
    if (frames_.empty()) return false;
    if (any_order_) return true;
    const Timestamp timestamp = frames_.front().frame.timestamp;
    return std::ranges::all_of(
        tables_, [&](const Table& table) { return table.reader->EarliestNext() > timestamp; });
  }

  /// Adds the earliest rows to the frames: all rows with the time of the first one. Returns false
  /// at the end of all tables.
  bool ReadRows() {
    const TableReader* first = nullptr;
    for (const Table& table : tables_) {
      TableReader& reader = *table.reader;
      if (!reader.has_row() && (reader.is_at_end() || !reader.Read())) continue;
      if (first == nullptr || reader.timestamp() < first->timestamp()) first = &reader;
    }
    if (first == nullptr) return false;
    if (!std::exchange(has_rows_, true)) CheckFirstTimes(*first);
    const Timestamp timestamp = first->timestamp();
    if (!first->has_begun()) WarnOfGap(*first);
    if (first_time_ == kNoTimestamp) first_time_ = timestamp;
    last_time_ = std::max(last_time_, timestamp);
    for (const Table& table : tables_) {
      TableReader& reader = *table.reader;
      while (reader.has_row() && reader.timestamp() == timestamp) {
        AddRow(table);
        reader.ReleaseRow();
        if (reader.layout().time.repeats) reader.Read();
      }
    }
    return true;
  }

  /// Rejects tables whose first times are so far apart that their units or origins must differ.
  /// `first` is the table with the earliest time.
  void CheckFirstTimes(const TableReader& first) const {
    constexpr std::uint64_t kYear = 365ULL * 86400 * 1'000'000'000;
    for (const Table& table : tables_) {
      const TableReader& reader = *table.reader;
      const std::optional<TableColumn>& column = reader.layout().time.column;
      const std::uint64_t step = TimeBetween(first.timestamp(), reader.timestamp());
      if (!reader.has_row() || !column || step <= kYear) continue;
      reader.row().Fail(*column,
                        "is more than a year after the first time of " + first.name() + ", " +
                            internal::SecondsText(first.timestamp()),
                        "the same origin of all times: the unit of this column, such as 'time: "
                        "{unit: ns}', or an 'offset_s'");
    }
  }

  /// Logs a warning if the first row of `next` follows a gap that no table spans, and that is
  /// longer than all rows before it together.
  void WarnOfGap(const TableReader& next) const {
    constexpr double kMinGap = 60.0;
    std::vector<std::string> names;
    for (const Table& table : tables_) {
      const TableReader& reader = *table.reader;
      if (reader.has_begun() && !reader.is_at_end()) return;
      if (reader.has_begun()) names.push_back(reader.name());
    }
    // The difference of two timestamps can exceed the range of a Timestamp.
    const double begin_s = Seconds(first_time_), end_s = Seconds(last_time_);
    const double gap_s = Seconds(next.timestamp()) - end_s;
    if (names.empty() || gap_s <= kMinGap || gap_s <= end_s - begin_s) return;
    Log(LogLevel::kWarning,
        ErrorLine(Place{next.name(), next.row().number(), 0}, "",
                  "the first time is " + internal::SecondsText(next.timestamp()) +
                      ", but the times of " + internal::Join(names) + " are " +
                      internal::SecondsText(first_time_) + " to " +
                      internal::SecondsText(last_time_),
                  "times that overlap; check 'time.unit' and 'time.offset_s' of these files"));
  }

  void AddRow(const Table& table) {
    const TableReader& reader = *table.reader;
    const TableLayout& layout = reader.layout();
    for (std::size_t i = 0; i < layout.streams.size(); ++i) {
      const TableField& field = layout.streams[i];
      Timestamp& last = last_rows_[table.first_stream + i];
      if (!IsSelected(reader.row(), field) || !IsDue(reader.timestamp(), last, field)) continue;
      SourceFrame& frame = FrameAt(reader.timestamp() - field.delay, reader);
      Measurement measurement;
      if (!ReadMeasurement(reader.row(), field, local_frame_, measurement)) continue;
      if (field.goes_blind && reader.is_blind()) continue;
      last = reader.timestamp();
      measurement.timestamp = frame.timestamp;
      measurement.stream = static_cast<int>(table.first_stream + i);
      frame.measurements.push_back(std::move(measurement));
    }
    for (std::size_t i = 0; i < layout.truths.size(); ++i) {
      const TableField& field = layout.truths[i];
      if (!IsSelected(reader.row(), field)) continue;
      std::vector<double>& truth = FrameAt(reader.timestamp(), reader).truth[table.first_truth + i];
      if (truth.empty()) ReadValues(reader.row(), field, local_frame_, truth);
    }
  }

  /// Returns true if the stream uses a row at `timestamp`. `last` is the time of the last used row.
  static bool IsDue(Timestamp timestamp, Timestamp last, const TableField& field) {
    if (!field.min_interval || last == kNoTimestamp || timestamp == last) return true;
    return timestamp > last &&
           TimeBetween(last, timestamp) >= static_cast<std::uint64_t>(*field.min_interval);
  }

  /// Returns the pending frame at `timestamp`, to which the row of `reader` adds.
  SourceFrame& FrameAt(Timestamp timestamp, const TableReader& reader) {
    const auto time_of = [](const PendingFrame& pending) { return pending.frame.timestamp; };
    auto found = std::ranges::lower_bound(frames_, timestamp, {}, time_of);
    if (found == frames_.end() || found->frame.timestamp != timestamp) {
      found = frames_.insert(found, PendingFrame());
      found->frame.timestamp = timestamp;
      found->frame.truth.resize(truths_.size());
    }
    found->place = {reader.name(), reader.row().number(), 0};
    return found->frame;
  }

  bool any_order_;
  LocalFrame local_frame_;
  TableCalibration calibration_;
  std::vector<StreamInfo> streams_, truths_;
  std::vector<Timestamp> last_rows_;  ///< time of the last used row of each stream
  std::vector<Table> tables_;
  Timestamp first_time_ = kNoTimestamp, last_time_ = kNoTimestamp;  ///< of the rows read so far
  std::deque<PendingFrame> frames_;                                 ///< in the order of time
  Place place_;
  bool has_rows_ = false;  ///< true if the first rows of all tables were read
};

}  // namespace

std::unique_ptr<Source> CreateTables(const SourceArguments& arguments) {
  return std::make_unique<TablesSource>(arguments);
}

}  // namespace alidade
