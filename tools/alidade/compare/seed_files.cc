// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "alidade/compare/compare.h"
#include "alidade/io/csv_file.h"

/// Csv files of a comparison over several seeds. The page and the Python package read
/// over_time.csv.
namespace alidade {
namespace {

using internal::CsvFile;
using internal::OutputFolder;
using Estimators = std::vector<ComparedEstimator>;

/// Returns all timestamps of the estimators, sorted.
std::vector<Timestamp> TimestampsOf(const Estimators& estimators) {
  std::set<Timestamp> all;
  for (const ComparedEstimator& estimator : estimators) {
    all.insert(estimator.over_time.timestamps.begin(), estimator.over_time.timestamps.end());
  }
  return {all.begin(), all.end()};
}

/// Column of over_time.csv.
struct TimeColumn {
  std::string name;
  const std::vector<double>* values;
};

std::vector<TimeColumn> TimeColumnsOf(const ComparedEstimator& estimator) {
  std::vector<TimeColumn> columns;
  const auto add = [&](const std::string& name, const std::vector<double>& values) {
    columns.push_back({estimator.name + '.' + name, &values});
  };
  for (const auto& [block, error] : estimator.over_time.errors) {
    add("rms:" + block, error.rms);
    add("p16:" + block, error.low);
    add("p84:" + block, error.high);
    if (!error.bound.empty()) add("bound:" + block, error.bound);
  }
  for (const auto& [owner, nees] : estimator.over_time.nees) {
    add("anees:" + owner, nees.mean);
    add("anees.low:" + owner, nees.low);
    add("anees.high:" + owner, nees.high);
  }
  return columns;
}

/// Writes over_time.csv: RMS and quantiles of the errors, and average NEES with bounds, by time.
void WriteOverTime(const OutputFolder& folder, const Estimators& estimators) {
  const std::vector<Timestamp> timestamps = TimestampsOf(estimators);
  if (timestamps.empty()) return;
  std::vector<std::string> header = {"t_s"};
  std::vector<std::vector<TimeColumn>> columns;
  for (const ComparedEstimator& estimator : estimators) {
    for (const TimeColumn& column : columns.emplace_back(TimeColumnsOf(estimator))) {
      header.push_back(column.name);
    }
  }
  CsvFile csv(folder, "over_time.csv", header);
  std::vector<std::size_t> next(estimators.size(), 0);  // next row of each estimator
  for (const Timestamp timestamp : timestamps) {
    csv.Time(timestamp);
    for (std::size_t e = 0; e < estimators.size(); ++e) {
      const std::vector<Timestamp>& known = estimators[e].over_time.timestamps;
      const bool is_known = next[e] < known.size() && known[next[e]] == timestamp;
      for (const TimeColumn& column : columns[e]) {
        const double value = is_known ? (*column.values)[next[e]] : std::nan("");
        std::isfinite(value) ? csv.Number(value) : csv.Empty();
      }
      next[e] += is_known ? 1 : 0;
    }
    csv.EndRow();
  }
  csv.Close();
}

std::optional<double> MeanOf(const ComparedEstimator& estimator, const std::string& key) {
  const auto found = estimator.values.find(key);
  if (found == estimator.values.end()) return std::nullopt;
  return found->second.mean;
}

/// Returns the CPU time of a frame, us. The time includes that of the filter from which a batch
/// starts.
std::optional<double> CostOf(const ComparedEstimator& estimator) {
  const std::optional<double> cpu = MeanOf(estimator, "cpu_us");
  if (!cpu || !(*cpu > 0.0)) return std::nullopt;
  return *cpu + MeanOf(estimator, "cpu_us.start").value_or(0.0);
}

/// Returns the mean of an error. Returns nullopt if the error or the cost is unknown.
std::optional<double> ErrorOf(const ComparedEstimator& estimator, const std::string& key) {
  const std::optional<double> error = MeanOf(estimator, key);
  return error && std::isfinite(*error) && CostOf(estimator) ? error : std::nullopt;
}

/// Returns true if no other estimator is both cheaper and more accurate, except for rounding.
bool IsOnFront(const ComparedEstimator& estimator, const Estimators& group,
               const std::string& key) {
  constexpr double kRounding = 1e-9;
  const auto error = ErrorOf(estimator, key);
  return error && std::ranges::none_of(group, [&](const ComparedEstimator& other) {
           const auto other_error = ErrorOf(other, key);
           return other_error && *CostOf(other) < *CostOf(estimator) &&
                  *other_error < *error * (1.0 + kRounding);
         });
}

/// Estimators whose costs and errors can be compared with each other.
struct CostGroup {
  std::string prefix;  ///< prefix of the columns
  Estimators estimators;
  std::vector<std::string> kinds;  ///< kinds of errors

  /// Returns the keys of the errors that at least two of the estimators have.
  std::vector<std::string> Keys() const {
    std::map<std::string, int> counts;
    for (const ComparedEstimator& estimator : estimators) {
      for (const auto& [key, value] : estimator.values) {
        const auto begins = [&key = key](const std::string& kind) { return key.starts_with(kind); };
        const bool is_segment = key.find('@') != key.npos;
        if (is_segment || !std::ranges::any_of(kinds, begins)) continue;
        if (ErrorOf(estimator, key).value_or(0.0) > 0.0) ++counts[key];
      }
    }
    std::erase_if(counts, [](const auto& entry) { return entry.second < 2; });
    std::vector<std::string> keys;
    for (const auto& [key, count] : counts) keys.push_back(key);
    return keys;
  }
  bool Contains(const std::string& estimator) const {
    return std::ranges::count(estimators, estimator, &ComparedEstimator::name) > 0;
  }
};

/// Returns three groups: the last estimates of all estimators, which use the same data; the online
/// estimates; and the smoothed estimates.
std::vector<CostGroup> CostGroupsOf(const Estimators& estimators) {
  CostGroup last{"", estimators, {"final_error:", "map.rmse", "map.sim3.rmse"}};
  CostGroup online{"", {}, {"rmse:"}}, smoothed{"smoothed.", {}, {"rmse:"}};
  for (const ComparedEstimator& estimator : estimators) {
    (estimator.smoothed ? smoothed : online).estimators.push_back(estimator);
  }
  return {last, online, smoothed};
}

/// Writes cost.csv: the CPU time and the mean errors, with a row for each estimator.
void WriteCost(const OutputFolder& folder, const Estimators& estimators) {
  const std::vector<CostGroup> groups = CostGroupsOf(estimators);
  std::vector<std::string> header = {"estimator", "cpu_us", "cpu_us.start", "cpu_us.all"};
  for (const CostGroup& group : groups) {
    for (const std::string& key : group.Keys()) {
      const std::string name = group.prefix + key;
      header.insert(header.end(), {name, "low." + name, "high." + name, "front." + name});
    }
  }
  CsvFile csv(folder, "cost.csv", header);
  const auto write = [&](const std::optional<double>& value) {
    value ? csv.Number(*value) : csv.Empty();
  };
  for (const ComparedEstimator& estimator : estimators) {
    csv.Text(estimator.name);
    write(MeanOf(estimator, "cpu_us"));
    write(MeanOf(estimator, "cpu_us.start"));
    write(CostOf(estimator));
    for (const CostGroup& group : groups) {
      const bool is_member = group.Contains(estimator.name);
      for (const std::string& key : group.Keys()) {
        const auto error = is_member ? ErrorOf(estimator, key) : std::nullopt;
        const auto interval = estimator.mean_intervals.find(key);
        const bool has_interval = error && interval != estimator.mean_intervals.end();
        write(error);
        write(has_interval ? std::optional(interval->second.low) : error);
        write(has_interval ? std::optional(interval->second.high) : error);
        csv.Integer(is_member && IsOnFront(estimator, group.estimators, key) ? 1 : 0);
      }
    }
    csv.EndRow();
  }
  csv.Close();
}

}  // namespace

void WriteSeedFiles(const internal::OutputFolder& folder, const Comparison& comparison) {
  WriteOverTime(folder, comparison.estimators);
  WriteCost(folder, comparison.estimators);
}

}  // namespace alidade
