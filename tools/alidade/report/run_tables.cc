// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/run_tables.h"

#include <algorithm>
#include <limits>
#include <set>
#include <span>

#include "alidade/report/csv_rows.h"
#include "alidade/report/row_selection.h"

namespace alidade::internal {
namespace {

constexpr std::size_t kMaxGainRows = 5000;

/// Selects the rows of estimates.csv and errors.csv, which have the same times.
RowSelection EstimateRows(const std::filesystem::path& folder, const RunRows& rows) {
  if (rows.are_growing()) return LastRows(rows.last);
  const bool has_errors = std::filesystem::exists(folder / "errors.csv");
  return SelectRows(folder / (has_errors ? "errors.csv" : "estimates.csv"), {}, "nees:");
}

std::filesystem::path GainFile(const std::filesystem::path& folder, const RunRows& rows) {
  return rows.are_growing() ? std::filesystem::path() : folder / "gains.csv";
}

RowSelection InnovationRows(const std::filesystem::path& file, const RunRows& rows) {
  if (rows.are_growing()) return LastRows(rows.last);
  return SelectRows(file, {"sensor", "outcome"}, "nis");
}

/// If both tables have the same timestamps except at their ends, removes rows so that both have the
/// same number of rows and end at the same timestamp.
void Align(CsvColumns& a, CsvColumns& b) {
  const std::vector<Timestamp> a_times = a.Times(), b_times = b.Times();
  if (a_times.empty() || b_times.empty()) return;
  const Timestamp last = std::min(a_times.back(), b_times.back());
  const auto count_until = [&](const std::vector<Timestamp>& times) {
    return static_cast<std::size_t>(std::ranges::upper_bound(times, last) - times.begin());
  };
  const std::size_t a_count = count_until(a_times), b_count = count_until(b_times);
  const std::size_t count = std::min(a_count, b_count);
  const auto last_of = [&](const std::vector<Timestamp>& times, std::size_t end) {
    return std::span(times).subspan(end - count, count);
  };
  if (!std::ranges::equal(last_of(a_times, a_count), last_of(b_times, b_count))) return;
  a.Keep(a_count - count, count);
  b.Keep(b_count - count, count);
}

/// Returns the number of innovations of each outcome and sensor, with the keys of run.json.
std::map<std::string, std::int64_t> CountOutcomes(const CsvColumns& innovations) {
  std::map<std::string, std::int64_t> counts;
  const std::vector<std::string_view> sensors = innovations.Texts("sensor");
  const std::vector<std::string_view> outcomes = innovations.Texts("outcome");
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    ++counts[std::string(outcomes[i]) + ':' + std::string(sensors[i])];
  }
  return counts;
}

}  // namespace

EstimatorTables::EstimatorTables(const std::filesystem::path& folder, const std::string& estimator,
                                 const Json& run_entry, const RunRows& rows)
    : name(estimator),
      entry(run_entry),
      covariance_file(folder / name / "trajectory_covariance.tum"),
      estimate_rows(EstimateRows(folder / name, rows)),
      errors(folder / name / "errors.csv", estimate_rows),
      estimates(folder / name / "estimates.csv", estimate_rows),
      innovations_file(folder / name / "innovations.csv"),
      innovations(innovations_file, InnovationRows(innovations_file, rows)),
      gains(GainFile(folder / name, rows),
            SelectRows(GainFile(folder / name, rows), {"sensor"}, "", kMaxGainRows)),
      landmarks(folder / name / "landmarks.csv"),
      events(folder / name / "events.csv"),
      final_covariance(folder / name / "final_covariance.csv") {
  Align(estimates, errors);
  if (!rows.are_growing()) return;
  covariance_file.clear();
  counts = CountOutcomes(innovations);
}

RunTimes::RunTimes(std::vector<Timestamp> times, Timestamp origin, ColumnPool& pool)
    : all_(std::move(times)), pool_(pool) {
  std::ranges::sort(all_);
  all_.erase(std::unique(all_.begin(), all_.end()), all_.end());
  origin_ = origin == kNoTimestamp ? all_.front() : origin;
  column_ = pool.AddTimes(all_, origin_);
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
