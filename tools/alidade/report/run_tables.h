// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alidade/io/json.h"
#include "alidade/report/column_pool.h"
#include "alidade/report/csv_columns.h"

namespace alidade::internal {

/// Rows of the files of a run that a page shows. By default, these are all rows of a finished run.
struct RunRows {
  std::size_t last = kAllRows;      ///< number of rows at the end of each file
  Timestamp origin = kNoTimestamp;  ///< zero of the times; kNoTimestamp: the first timestamp

  /// Returns whether the run is still writing its files.
  bool are_growing() const { return last != kAllRows; }
};

/// Files of one estimator in a run folder. Of long files, only selected rows are read. In
/// innovations.csv, each sensor and outcome is a group, so accepted measurements do not displace
/// rejected ones.
struct EstimatorTables {
  /// The rows of `estimates` and `errors` have the same timestamps, also while the run writes these
  /// files, and if it was killed. Gains and covariances of the poses of a run that is not finished
  /// are omitted.
  EstimatorTables(const std::filesystem::path& folder, const std::string& estimator,
                  const Json& run_entry, const RunRows& rows);

  std::string name;
  const Json& entry;  ///< entry of the estimator in run.json
  std::filesystem::path covariance_file;
  RowSelection estimate_rows;  ///< of both files
  CsvColumns errors, estimates;
  std::filesystem::path innovations_file;
  CsvColumns innovations, gains, landmarks, events, final_covariance;
  /// Number of the innovations that were read, for each outcome and sensor, if the run is not
  /// finished: otherwise `entry` contains the numbers of all.
  std::map<std::string, std::int64_t> counts;
};

/// Timestamps of a run: the union of the timestamps of all its files, sorted. Stores the times of
/// each file as places in this union.
class RunTimes {
 public:
  /// Adds the union to `pool`. `times` must not be empty. `origin` is the zero of the times;
  /// kNoTimestamp means the first timestamp.
  RunTimes(std::vector<Timestamp> times, Timestamp origin, ColumnPool& pool);

  const std::vector<Timestamp>& all() const { return all_; }
  Timestamp origin() const { return origin_; }
  /// Returns the column of all timestamps.
  int column() const { return column_; }
  /// Returns the column of `times`, which are part of the union.
  int ColumnOf(const std::vector<Timestamp>& times) const;
  /// Returns the place of the time in a cell. Returns nullopt if the run does not have this time.
  std::optional<std::size_t> Find(std::string_view cell) const;
  /// Returns seconds after the origin; NaN for kNoTimestamp.
  double SecondsOf(Timestamp time) const;
  /// Returns the values at all timestamps, of a file whose rows have the timestamps `times`.
  std::vector<double> Align(const std::vector<Timestamp>& times,
                            const std::vector<double>& values) const;

 private:
  std::uint32_t IndexOf(Timestamp time) const;

  std::vector<Timestamp> all_;
  Timestamp origin_;
  ColumnPool& pool_;
  int column_;
};

/// Returns the rows of `table` for which column `name` contains `text`.
std::vector<std::uint32_t> RowsWith(const CsvColumns& table, std::string_view name,
                                    std::string_view text);
/// Returns the distinct texts of a column, sorted.
std::vector<std::string> DistinctTexts(const CsvColumns& table, std::string_view name);

}  // namespace alidade::internal
