// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <map>

#include "alidade/base/text.h"
#include "alidade/compare/finished_run.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// Consecutive rows of measurements.csv with equal timestamps.
struct TimestampRows {
  std::string t_s;                ///< timestamp as in the file; "": the end of the file
  std::vector<std::string> rows;  ///< sorted by the name of the stream, like the hashed rows
};

/// Reader of measurements.csv that groups the rows by timestamp.
class MeasurementsFile {
 public:
  explicit MeasurementsFile(const fs::path& folder) : stream_(folder / "measurements.csv") {
    ReadRow();  // skips the header
    ReadRow();
  }
  bool is_open() const { return stream_.is_open(); }

  TimestampRows Next() {
    const auto cell_at = [](const std::string& row, std::size_t offset) {
      const std::size_t begin = std::min(offset, row.size());
      return row.substr(begin, row.find(',', begin) - begin);
    };
    TimestampRows next{cell_at(row_, 0), {}};
    for (; !row_.empty() && cell_at(row_, 0) == next.t_s; ReadRow()) next.rows.push_back(row_);
    std::ranges::stable_sort(
        next.rows, {}, [&](const std::string& row) { return cell_at(row, next.t_s.size() + 1); });
    return next;
  }

 private:
  /// Reads the next row. Removes trailing empty cells, which exist if other streams have more
  /// values.
  void ReadRow() {
    row_.clear();
    if (!std::getline(stream_, row_)) return;
    row_.resize(row_.find_last_not_of(',') + 1);
  }

  std::ifstream stream_;
  std::string row_;  ///< next row of the file
};

/// Returns the timestamp of rows as text for messages.
std::string TimestampOf(const TimestampRows& rows) {
  return rows.t_s.empty() ? "the end of the file" : "t = " + rows.t_s + " s";
}

/// Describes the first difference between the files measurements.csv of `folder` and `reference`.
std::string FirstDifference(const fs::path& folder, const fs::path& reference) {
  MeasurementsFile file(folder), reference_file(reference);
  if (!file.is_open() || !reference_file.is_open()) return "measurements.csv cannot be read";
  for (;;) {
    const TimestampRows rows = file.Next(), reference_rows = reference_file.Next();
    if (rows.rows != reference_rows.rows) {
      const std::string text = "the first difference is at " + TimestampOf(rows);
      const bool is_same_time = rows.t_s == reference_rows.t_s;
      return is_same_time ? text
                          : text + ", the other file has " + TimestampOf(reference_rows) + " there";
    }
    if (rows.t_s.empty()) {
      return "the covariances of measurements or the timestamps of empty frames differ";
    }
  }
}

/// Adds the path and the text of each scalar in the tree below `node` to `values`.
void Flatten(const Node& node, std::map<std::string, std::string>& values) {
  if (node.is_map()) {
    for (const auto& [key, value] : node.Entries()) Flatten(value, values);
  } else if (node.kind() == Node::Kind::kList) {
    for (const Node& item : node.Items()) Flatten(item, values);
  } else if (node.kind() == Node::Kind::kScalar) {
    values[node.path()] = node.Text();
  }
}

std::map<std::string, std::string> SharedSettings(const fs::path& folder) {
  std::map<std::string, std::string> values;
  const Config config = Config::FromFile(folder / "config.resolved.yaml", true);
  for (const char* key : {"state", "sensors", "landmarks", "camera", "initial_time_s"}) {
    if (const auto node = config.root().Find(key)) Flatten(*node, values);
  }
  return values;
}

/// Lists up to three settings that differ between two runs. Returns "" if no setting differs.
std::string DifferingSettings(const fs::path& a, const fs::path& b) {
  constexpr std::size_t kShown = 3;
  const std::map<std::string, std::string> first = SharedSettings(a);
  std::map<std::string, std::string> second = SharedSettings(b);
  std::vector<std::string> texts;
  const auto add = [&](const std::string& key, const std::string& x, const std::string& y) {
    texts.push_back(key + " (" + x + ", " + y + ')');
  };
  for (const auto& [key, value] : first) {
    const auto found = second.find(key);
    if (found == second.end()) {
      add(key, value, "none");
    } else if (found->second != value) {
      add(key, value, found->second);
    }
    if (found != second.end()) second.erase(found);
  }
  for (const auto& [key, value] : second) add(key, "none", value);
  const std::size_t omitted = texts.size() - std::min(kShown, texts.size());
  texts.resize(texts.size() - omitted);
  return Join(texts) + (omitted > 0 ? " and " + std::to_string(omitted) + " more" : "");
}

}  // namespace

std::vector<std::string> CheckSameData(const std::vector<ComparedRun>& runs) {
  std::vector<std::string> notes;
  const ComparedRun& first = runs.front();
  for (std::size_t r = 1; r < runs.size(); ++r) {
    const ComparedRun& run = runs[r];
    const std::string folders = "'" + first.folder.string() + "' and '" + run.folder.string() + "'";
    if (first.measurements_sha256 != run.measurements_sha256) {
      throw Error(ExitCode::kBadData,
                  ErrorLine(Place{run.folder.string()}, {},
                            "the measurements differ from those of '" + first.folder.string() +
                                "': the SHA-256 is " + run.measurements_sha256 + ", not " +
                                first.measurements_sha256 + "; " +
                                FirstDifference(run.folder, first.folder),
                            "runs of the same source, seed and start"));
    }
    if (first.truth_sha256 != run.truth_sha256) {
      notes.push_back("the truths of " + folders +
                      " differ: their errors relative to truth are not comparable");
    }
    const std::string settings = DifferingSettings(first.folder, run.folder);
    if (!settings.empty()) {
      notes.push_back("the settings of " + folders + " differ: " + settings +
                      "; the estimators are therefore not the only difference");
    }
  }
  return notes;
}

}  // namespace alidade::internal
