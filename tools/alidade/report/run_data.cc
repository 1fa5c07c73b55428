// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/run_data.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <nlohmann/json.hpp>

#include "alidade/estimation/estimator.h"
#include "alidade/io/run_files.h"
#include "alidade/report/csv_rows.h"
#include "alidade/report/estimator_data.h"
#include "alidade/report/run_tables.h"

namespace alidade::internal {
namespace {

namespace fs = std::filesystem;

/// Returns the name of each outcome, and the use of a measurement with this outcome.
Json OutcomeList() {
  Json list = Json::array();
  for (const OutcomeInfo& outcome : kOutcomes) {
    const char* const use = outcome.outcome == Outcome::kAccepted ? "accepted"
                            : outcome.is_initialisation           ? "initialised"
                            : outcome.is_rejection                ? "rejected"
                                                                  : "unused";
    list.push_back({{"name", outcome.name}, {"use", use}});
  }
  return list;
}

/// Returns the probability of the gate of an estimator, or null.
Json GateOf(const Node& config, const std::string& estimator) {
  const auto estimators = config.Find("estimators");
  if (!estimators || !estimators->is_map()) return {};
  const auto entry = estimators->Find(estimator);
  if (!entry || !entry->is_map()) return {};
  const auto gate = entry->Find("gate");
  if (!gate || gate->kind() != Node::Kind::kScalar || gate->Text() == "none") return {};
  return gate->Number();
}

Json TruthData(const CsvColumns& truth, const RunTimes& times, ColumnPool& pool) {
  Json data = Json::object();
  const std::vector<Timestamp> timestamps = truth.Times();
  for (const std::string& name : truth.names()) {
    if (name == "t_s") continue;
    data[name] = pool.AddNumbers(times.Align(timestamps, truth.Numbers(name)));
  }
  return data;
}

/// Returns the states that single measurements imply, for each sensor and block.
Json ImpliedData(const CsvColumns& implied, const RunTimes& times, ColumnPool& pool) {
  Json list = Json::array();
  const std::vector<Timestamp> timestamps = implied.Times();
  for (const std::string& sensor : DistinctTexts(implied, "sensor")) {
    const std::vector<std::uint32_t> sensor_rows = RowsWith(implied, "sensor", sensor);
    for (const std::string_view block : implied.names()) {
      if (block == "t_s" || block == "sensor") continue;
      const std::vector<double> values = implied.Numbers(block);
      std::vector<std::uint32_t> rows;
      for (const std::uint32_t row : sensor_rows) {
        const bool is_in_run = std::ranges::binary_search(times.all(), timestamps[row]);
        if (std::isfinite(values[row]) && is_in_run) rows.push_back(row);
      }
      if (rows.empty()) continue;
      list.push_back({{"sensor", sensor},
                      {"block", std::string(block)},
                      {"t", times.ColumnOf(Select(timestamps, rows))},
                      {"v", pool.AddNumbers(Select(values, rows))}});
    }
  }
  return list;
}

/// Returns for each timestamp whether any estimator received a valid measurement of `sensor`.
std::vector<bool> HasValid(const std::deque<EstimatorTables>& estimators, const std::string& sensor,
                           const RunTimes& times, std::size_t last_rows) {
  std::vector<bool> has_valid(times.all().size());
  for (const EstimatorTables& estimator : estimators) {
    CsvRows table(estimator.innovations_file, last_rows);
    const auto name = table.Find("sensor"), outcome = table.Find("outcome"), t = table.Find("t_s");
    while (name && outcome && t && table.Next()) {
      const std::vector<std::string_view>& cells = table.cells();
      const bool is_invalid = cells[*outcome] == ToString(Outcome::kInvalid) ||
                              cells[*outcome] == ToString(Outcome::kNotFinite);
      if (cells[*name] != sensor || is_invalid) continue;
      if (const auto index = times.Find(cells[*t])) has_valid[*index] = true;
    }
  }
  return has_valid;
}

/// Returns the intervals that contain all timestamps of a segment and no other. An interval ends
/// at the next timestamp.
Json SpansOf(const RunTimes& times, const std::vector<bool>& has_valid, bool with_measurement) {
  Json spans = Json::array();
  bool is_open = false;
  for (std::size_t i = 0; i < has_valid.size(); ++i) {
    const bool is_inside = has_valid[i] == with_measurement;
    const double seconds = times.SecondsOf(times.all()[i]);
    if (is_inside && !is_open) spans.push_back({seconds, seconds});
    if (is_open) spans.back()[1] = seconds;
    is_open = is_inside;
  }
  return spans;
}

Json SegmentData(const Node& config, const std::deque<EstimatorTables>& estimators,
                 const RunTimes& times, std::size_t last_rows) {
  Json list = Json::array();
  const auto evaluate = config.Find("evaluate");
  const auto segments = evaluate ? evaluate->Find("segments") : std::nullopt;
  if (!segments) return list;
  for (const auto& [name, rule] : segments->Entries()) {
    const bool needs_measurement = rule.Find("with").has_value();
    const char* const key = needs_measurement ? "with" : "without";
    const std::string sensor = rule.At(key).Text();
    const std::vector<bool> has_valid = HasValid(estimators, sensor, times, last_rows);
    list.push_back({{"name", name},
                    {"rule", key + (' ' + sensor)},
                    {"spans", SpansOf(times, has_valid, needs_measurement)}});
  }
  return list;
}

}  // namespace

Json RunData(const fs::path& folder, const Json& run, const Node& config, const RunRows& rows,
             ColumnPool& pool) {
  if (!run.contains("estimators")) return {};
  std::deque<EstimatorTables> estimators;
  std::vector<Timestamp> timestamps;
  for (const auto& [name, entry] : run.at("estimators").items()) {
    if (!entry.contains("blocks")) continue;  // the run ended before the files were created
    const EstimatorTables& tables = estimators.emplace_back(folder, name, entry, rows);
    for (const CsvColumns* table : {&tables.estimates, &tables.innovations, &tables.gains}) {
      const std::vector<Timestamp> more = table->Times();
      timestamps.insert(timestamps.end(), more.begin(), more.end());
    }
  }
  if (estimators.empty()) return {};
  std::ranges::sort(timestamps);
  const fs::path truth_file = folder / "truth.csv", implied_file = folder / "implied_states.csv";
  const CsvColumns truth(
      truth_file, rows.are_growing() ? LastRows(rows.last) : SelectTimes(truth_file, timestamps));
  const std::vector<Timestamp> truth_times = truth.Times();
  timestamps.insert(timestamps.end(), truth_times.begin(), truth_times.end());
  if (timestamps.empty()) return {};
  const RunTimes times(std::move(timestamps), rows.origin, pool);
  const Json columns = ReadJsonFile(folder / "columns.json");
  const CsvColumns implied(implied_file, rows.are_growing()
                                             ? LastRows(rows.last)
                                             : SelectTimes(implied_file, times.all()));
  // The page of a run that failed or was stopped shows the measurements of the last frames.
  const bool is_complete = rows.are_growing() || run.value("status", "ok") == "ok";
  Json data = {{"t", times.column()},
               {"t0", Seconds(times.origin())},
               {"outcomes", OutcomeList()},
               {"truth", TruthData(truth, times, pool)},
               {"implied", ImpliedData(implied, times, pool)},
               {"segments", SegmentData(config, estimators, times, rows.last)},
               {"conclusions", run.value("conclusions", Json::array())}};
  Json& list = data["estimators"] = Json::array();
  for (const EstimatorTables& tables : estimators) {
    const Json gate = GateOf(config, tables.name);
    list.push_back(EstimatorData(tables, columns, gate, !is_complete, times, pool));
  }
  return data;
}

}  // namespace alidade::internal
