// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <map>

#include "alidade/base/text.h"
#include "alidade/compare/finished_run.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// The rows of measurements.csv that follow each other with one timestamp.
struct TimestampRows {
  std::string t_s;                ///< "": the file is at its end
  std::vector<std::string> rows;  ///< by the name of their stream, as they are hashed
};

class MeasurementsFile {
 public:
  explicit MeasurementsFile(const fs::path& folder) : stream_(folder / "measurements.csv") {
    Advance();  // to the header
    Advance();
  }
  bool good() const { return stream_.is_open(); }

  TimestampRows Next() {
    const auto cell = [](const std::string& row, std::size_t at) {
      const std::size_t from = std::min(at, row.size());
      return row.substr(from, row.find(',', from) - from);
    };
    TimestampRows next{cell(row_, 0), {}};
    for (; !row_.empty() && cell(row_, 0) == next.t_s; Advance()) next.rows.push_back(row_);
    std::ranges::stable_sort(
        next.rows, {}, [&](const std::string& row) { return cell(row, next.t_s.size() + 1); });
    return next;
  }

 private:
  /// To the next row, without the empty cells that wider streams leave.
  void Advance() {
    row_.clear();
    if (!std::getline(stream_, row_)) return;
    row_.resize(row_.find_last_not_of(',') + 1);
  }

  std::ifstream stream_;
  std::string row_;  ///< the next one
};

/// The timestamp of rows, for people.
std::string TimestampOf(const TimestampRows& rows) {
  return rows.t_s.empty() ? "its end" : "t = " + rows.t_s + " s";
}

/// Where measurements.csv of two folders begin to differ, in words.
std::string FirstDifference(const fs::path& a, const fs::path& b) {
  MeasurementsFile first(a), second(b);
  if (!first.good() || !second.good()) return "measurements.csv cannot be read";
  for (;;) {
    const TimestampRows one = first.Next(), other = second.Next();
    if (one.rows != other.rows) {
      return "first at " + TimestampOf(one) + " of the one, " + TimestampOf(other) +
             " of the other";
    }
    if (one.t_s.empty()) return "their own covariances or the timestamps of empty frames differ";
  }
}

/// Every scalar below a node by its path.
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

/// Up to three settings that two runs do not have alike; "": none.
std::string SettingsThatDiffer(const fs::path& a, const fs::path& b) {
  constexpr std::size_t kShown = 3;
  const std::map<std::string, std::string> one = SharedSettings(a);
  std::map<std::string, std::string> other = SharedSettings(b);
  std::vector<std::string> texts;
  const auto add = [&](const std::string& key, const std::string& x, const std::string& y) {
    texts.push_back(key + " (" + x + ", " + y + ')');
  };
  for (const auto& [key, value] : one) {
    const auto found = other.find(key);
    if (found == other.end()) {
      add(key, value, "none");
    } else if (found->second != value) {
      add(key, value, found->second);
    }
    if (found != other.end()) other.erase(found);
  }
  for (const auto& [key, value] : other) add(key, "none", value);
  const std::size_t more = texts.size() - std::min(kShown, texts.size());
  texts.resize(texts.size() - more);
  return Join(texts) + (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

}  // namespace

std::vector<std::string> CheckSameData(const std::vector<ComparedRun>& runs) {
  std::vector<std::string> notes;
  const ComparedRun& first = runs.front();
  for (std::size_t r = 1; r < runs.size(); ++r) {
    const ComparedRun& other = runs[r];
    const std::string both = "'" + first.folder.string() + "' and '" + other.folder.string() + "'";
    if (first.measurements_sha256 != other.measurements_sha256) {
      throw Error(ExitCode::kBadData,
                  ErrorLine(Place{other.folder.string()}, {},
                            "saw other measurements than '" + first.folder.string() +
                                "': " + other.measurements_sha256 + " against " +
                                first.measurements_sha256 + ", " +
                                FirstDifference(first.folder, other.folder),
                            "runs of the same source, seed and start"));
    }
    if (first.truth_sha256 != other.truth_sha256) {
      notes.push_back("the truths of " + both +
                      " differ: errors against truth of the one are not those of the other");
    }
    const std::string settings = SettingsThatDiffer(first.folder, other.folder);
    if (!settings.empty()) {
      notes.push_back("the settings of " + both + " differ: " + settings +
                      ": what differs is not the estimator alone");
    }
  }
  return notes;
}

}  // namespace alidade::internal
