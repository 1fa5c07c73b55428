// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/run_tables.h"

#include <algorithm>
#include <limits>
#include <set>

#include "alidade/report/csv_rows.h"
#include "alidade/report/row_selection.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMaxGainRows = 5000;

/// Selects the rows of estimates.csv and errors.csv, which have the same times.
RowSelection EstimateRows(const std::filesystem::path& folder) {
  const bool has_errors = std::filesystem::exists(folder / "errors.csv");
  return SelectRows(folder / (has_errors ? "errors.csv" : "estimates.csv"), {}, "nees:");
}

}  // namespace

EstimatorTables::EstimatorTables(const std::filesystem::path& folder, const std::string& estimator,
                                 const Json& run_entry)
    : name(estimator),
      entry(run_entry),
      covariance_file(folder / name / "trajectory_covariance.tum"),
      errors(folder / name / "errors.csv", EstimateRows(folder / name)),
      estimates(folder / name / "estimates.csv", EstimateRows(folder / name)),
      innovations_file(folder / name / "innovations.csv"),
      innovations(innovations_file, SelectRows(innovations_file, {"sensor", "outcome"}, "nis")),
      gains(folder / name / "gains.csv",
            SelectRows(folder / name / "gains.csv", {"sensor"}, "", kMaxGainRows)),
      landmarks(folder / name / "landmarks.csv"),
      events(folder / name / "events.csv"),
      final_covariance(folder / name / "final_covariance.csv") {}

RunTimes::RunTimes(std::vector<Timestamp> times, ColumnPool& pool)
    : all_(std::move(times)), pool_(pool) {
  std::ranges::sort(all_);
  all_.erase(std::unique(all_.begin(), all_.end()), all_.end());
  column_ = pool.AddTimes(all_, origin());
}

std::uint32_t RunTimes::IndexOf(Timestamp time) const {
  return static_cast<std::uint32_t>(std::ranges::lower_bound(all_, time) - all_.begin());
}

int RunTimes::ColumnOf(const std::vector<Timestamp>& times) const {
  if (times == all_) return column_;
  std::vector<std::uint32_t> indices;
  indices.reserve(times.size());
  for (const Timestamp time : times) indices.push_back(IndexOf(time));
  return pool_.AddSelection(column_, indices);
}

std::optional<std::size_t> RunTimes::Find(std::string_view cell) const {
  const Timestamp time = TimeOf(cell);
  const auto found = std::ranges::lower_bound(all_, time);
  if (found == all_.end() || *found != time) return std::nullopt;
  return static_cast<std::size_t>(found - all_.begin());
}

double RunTimes::SecondsOf(Timestamp time) const {
  if (time == kNoTimestamp) return std::numeric_limits<double>::quiet_NaN();
  return Seconds(time - origin());
}

std::vector<double> RunTimes::Align(const std::vector<Timestamp>& times,
                                    const std::vector<double>& values) const {
  std::vector<double> aligned(all_.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < times.size(); ++i) aligned[IndexOf(times[i])] = values[i];
  return aligned;
}

std::vector<std::uint32_t> RowsWith(const CsvColumns& table, std::string_view name,
                                    std::string_view text) {
  std::vector<std::uint32_t> rows;
  const std::vector<std::string_view> texts = table.Texts(name);
  for (std::uint32_t row = 0; row < texts.size(); ++row) {
    if (texts[row] == text) rows.push_back(row);
  }
  return rows;
}

std::vector<std::string> DistinctTexts(const CsvColumns& table, std::string_view name) {
  const std::vector<std::string_view> texts = table.Texts(name);
  const std::set<std::string_view> distinct(texts.begin(), texts.end());
  return {distinct.begin(), distinct.end()};
}

}  // namespace alidade::internal
