// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/sweep/conclusions.h"
#include "alidade/sweep/worst_seeds.h"

namespace alidade::internal {
namespace {

/// Returns a sentence about the reference of the errors. Returns "" if the reference is truth.
std::string ReferenceText(const SweepResult& result) {
  RunResult run;
  run.reference = result.reference;
  const std::string text = internal::ReferenceText(run);
  const std::int64_t withheld = CountWithheld(result);
  if (withheld == 0) return text;
  return text + "; the errors are withheld in " + std::to_string(withheld) + " of " +
         std::to_string(CountFinished(result)) +
         " runs, in which the reference failed, diverged or had no estimates";
}

constexpr const char* kMetricsTitle =
    "Mean over the used runs, 95 % interval of this mean, and quantiles over the used runs";

/// Metrics in a table: the most relevant ones for a terminal, or all.
enum class Rows { kMain, kAll };

/// Returns the table of the metrics, with a row for each metric of each estimator. The statistics
/// of all estimators are formatted as columns of one table, so all numbers of a metric have the
/// same unit.
Table MetricTable(const std::vector<SweepSummary>& summaries, Rows rows) {
  constexpr std::size_t kStatistics = 6;
  RunResult columns;
  for (const SweepSummary& summary : summaries) {
    const std::size_t first = columns.estimators.size();
    columns.estimators.resize(first + kStatistics);
    EstimatorResult* const column = &columns.estimators[first];
    for (std::size_t i = 0; i < kStatistics; ++i) column[i].units = summary.units;
    for (const auto& [key, spread] : summary.metrics) {
      const Interval& interval = summary.mean_intervals.at(key);
      const std::array<double, kStatistics> values = {spread.mean, interval.low, interval.high,
                                                      spread.p05,  spread.p50,   spread.p95};
      for (std::size_t i = 0; i < kStatistics; ++i) {
        if (!std::isnan(values[i])) column[i].metrics[key] = values[i];
      }
    }
  }
  const bool has_names = summaries.size() > 1;
  Table table{{"", "mean", "95 % interval", "5 %", "median", "95 %"}, {}, has_names ? 2U : 1U};
  if (has_names) table.header.insert(table.header.begin() + 1, "estimator");
  const std::vector<std::string> keys =
      rows == Rows::kMain ? MainKeys(columns, {}) : ShownMetrics(columns);
  for (const TableRow& source : MetricRows(columns, keys)) {
    std::string label = source.label;  // only in the first row of the metric
    for (std::size_t e = 0; e < summaries.size(); ++e) {
      const std::string* const c = &source.cells[e * kStatistics];
      if (c[0] == "-") continue;
      const bool has_interval = c[1] != "-";
      std::vector<std::string>& row = table.rows.emplace_back();
      row = {std::exchange(label, ""),
             c[0],
             has_interval ? '[' + c[1] + ", " + c[2] + ']' : "-",
             c[3],
             c[4],
             c[5]};
      if (has_names) row.insert(row.begin() + 1, summaries[e].name);
    }
  }
  return table;
}

/// Formats the conclusions, the tables of the verdicts and the metrics, and the lines below them.
std::string FormatTables(const SweepResult& result, const std::vector<SweepSummary>& summaries,
                         TableFormat format, std::size_t width = kDefaultTextWidth) {
  const char* const title_end = format == TableFormat::kMarkdown ? ":\n\n" : ":\n";
  return FormatConclusions(ConclusionsOf(result, summaries), format) +
         FormatTable(MakeTable(NamesOf(summaries), VerdictRows(summaries)), format, width) + '\n' +
         kMetricsTitle + title_end +
         FormatTable(
             MetricTable(summaries, format == TableFormat::kText ? Rows::kMain : Rows::kAll),
             format, width) +
         ReferenceLines(result);
}

}  // namespace

std::int64_t CountFinished(const SweepResult& result) {
  return std::ranges::count(result.done, RunStatus::kOk, &SweepRun::status);
}

std::int64_t CountWithheld(const SweepResult& result) {
  return std::ranges::count_if(result.done, [](const SweepRun& run) {
    return run.status == RunStatus::kOk && run.withheld;
  });
}

std::vector<TableRow> VerdictRows(const std::vector<SweepSummary>& summaries) {
  std::vector<TableRow> rows = {{"runs used", {}}};
  for (const SweepSummary& summary : summaries) {
    rows[0].cells.push_back(std::to_string(summary.used));
  }
  for (const VerdictInfo& verdict : kVerdicts) {
    TableRow row{verdict.name, {}};
    std::int64_t total = 0;
    for (const SweepSummary& summary : summaries) {
      row.cells.push_back(std::to_string(summary.CountOf(verdict.state)));
      total += summary.CountOf(verdict.state);
    }
    if (total > 0) rows.push_back(std::move(row));
  }
  return rows;
}

std::map<std::string, Interval> NeesBounds(const SweepSummary& summary) {
  constexpr std::string_view kDof = "nees.dof:";
  std::map<std::string, Interval> bounds;
  for (const auto& [key, dof] : summary.metrics) {
    if (!key.starts_with(kDof) || dof.count == 0) continue;
    bounds["nees.mean:" + key.substr(kDof.size())] =
        ConsistencyBounds(dof.mean, static_cast<double>(dof.count));
  }
  return bounds;
}

std::string FormatConclusions(const std::vector<Conclusion>& conclusions, TableFormat format) {
  std::string text;
  for (const std::string& line : ConclusionLines(conclusions)) {
    text += (format == TableFormat::kMarkdown ? "- " : "") + line + '\n';
  }
  return text.empty() ? "" : text + '\n';
}

std::string ReferenceLines(const SweepResult& result) {
  const std::string text = ReferenceText(result);
  return text.empty() ? "" : '\n' + text + '\n';
}

std::string ReferenceLines(const VariedSweep& sweep) {
  std::string lines;
  bool all_same = true;
  for (std::size_t v = 0; v < sweep.results.size(); ++v) {
    const std::string text = ReferenceText(sweep.results[v]);
    all_same = all_same && text == ReferenceText(sweep.results.front());
    lines += '\n' + sweep.variation.values[v] + ": " +
             (text.empty() ? "errors are differences from truth" : text) + '\n';
  }
  return all_same ? ReferenceLines(sweep.results.front()) : lines;
}

std::string SweepMarkdown(const SweepResult& result, const std::vector<SweepSummary>& summaries) {
  std::string text = std::to_string(CountFinished(result)) + " of " + std::to_string(result.runs) +
                     " runs, seeds from " + std::to_string(result.first_seed) +
                     ". The runs in which the estimator did not diverge are used.\n\n";
  return text + FormatTables(result, summaries, TableFormat::kMarkdown) +
         WorstSeedLines(FindWorstSeeds(result));
}

}  // namespace alidade::internal

namespace alidade {

std::string SweepTable(const SweepResult& result, const std::vector<SweepSummary>& summaries,
                       std::size_t width) {
  return internal::FormatTables(result, summaries, internal::TableFormat::kText, width);
}

}  // namespace alidade
