// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/worst_seeds.h"

#include <algorithm>
#include <cmath>

#include "alidade/base/text.h"
#include "alidade/experiment/metric_rows.h"

namespace alidade::internal {
namespace {

/// Run of one estimator.
struct SeedRow {
  std::uint64_t seed;
  const SweepRow* row;
};

std::vector<SeedRow> FinishedRowsOf(const SweepResult& result, const std::string& estimator) {
  std::vector<SeedRow> rows;
  for (const SweepRun& run : result.done) {
    if (run.status != RunStatus::kOk) continue;
    for (const SweepRow& row : run.estimators) {
      if (row.name == estimator) rows.push_back({run.seed, &row});
    }
  }
  return rows;
}

/// Returns the key of the metric that ranks the runs, or "" if no run has such a metric. The metric
/// covers the whole run, not a segment.
std::string FindRankingMetric(const std::vector<SeedRow>& rows) {
  for (const char* const prefix : {"nees.mean:", "rmse:", "nis.mean:"}) {
    for (const SeedRow& row : rows) {
      for (const std::string& name : row.row->metrics.names()) {
        if (name.starts_with(prefix) && name.find('@') == name.npos) return name;
      }
    }
  }
  return "";
}

/// Sets the label of the metric, and its value for each seed. All values have the same unit.
void FormatValues(const std::string& key, const std::vector<SeedRow>& rows, WorstSeeds& worst) {
  RunResult columns;
  for (const SeedRow& row : rows) {
    EstimatorResult& column = columns.estimators.emplace_back();
    column.metrics[key] = *row.row->metrics.Find(key);
    const NamedValues<std::string>& units = row.row->units;
    for (std::size_t i = 0; i < units.names().size(); ++i) {
      column.units[units.names()[i]] = units.values()[i];
    }
  }
  const TableRow formatted = MetricRows(columns).front();
  const std::size_t unit = formatted.label.find(" [");
  worst.metric = formatted.label.substr(0, unit);
  for (const std::string& cell : formatted.cells) {
    worst.values.push_back(
        unit == std::string::npos
            ? cell
            : cell + ' ' + formatted.label.substr(unit + 2, formatted.label.size() - unit - 3));
  }
}

}  // namespace

std::vector<WorstSeeds> FindWorstSeeds(const SweepResult& result) {
  constexpr std::size_t kShown = 3;
  std::vector<WorstSeeds> all;
  for (const std::string& estimator : result.estimators) {
    std::vector<SeedRow> rows = FinishedRowsOf(result, estimator);
    const std::string key = FindRankingMetric(rows);
    if (key.empty()) continue;
    std::erase_if(rows, [&](const SeedRow& row) {
      const double* const value = row.row->metrics.Find(key);
      return value == nullptr || std::isnan(*value);
    });
    if (rows.size() <= kShown) continue;
    std::ranges::stable_sort(rows, std::ranges::greater(),
                             [&](const SeedRow& row) { return *row.row->metrics.Find(key); });
    rows.resize(kShown);
    WorstSeeds& worst = all.emplace_back(WorstSeeds{estimator, "", {}, {}});
    for (const SeedRow& row : rows) worst.seeds.push_back(row.seed);
    FormatValues(key, rows, worst);
  }
  return all;
}

std::string WorstSeedLines(const std::vector<WorstSeeds>& worst) {
  std::string lines;
  for (const WorstSeeds& entry : worst) {
    std::vector<std::string> seeds;
    for (std::size_t i = 0; i < entry.seeds.size(); ++i) {
      seeds.push_back(std::to_string(entry.seeds[i]) + " (" + entry.values[i] + ')');
    }
    lines +=
        "worst seeds of " + entry.estimator + " by " + entry.metric + ": " + Join(seeds) + '\n';
  }
  return lines.empty() ? "" : '\n' + lines;
}

}  // namespace alidade::internal
