// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/table.h"

#include <algorithm>
#include <string_view>

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/text_table.h"

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

/// Returns rows with a cell for each estimator. The mean and the quantiles are formatted as four
/// columns of one table, so all numbers of a row have the same unit.
std::vector<TableRow> TableRows(const std::vector<SweepSummary>& summaries) {
  RunResult columns;
  for (const SweepSummary& summary : summaries) {
    for (const auto member : {&Spread::mean, &Spread::p05, &Spread::p50, &Spread::p95}) {
      EstimatorResult& column = columns.estimators.emplace_back();
      column.units = summary.units;
      for (const auto& [key, spread] : summary.metrics) column.metrics[key] = spread.*member;
    }
  }
  std::vector<TableRow> rows;
  for (const TableRow& source : MetricRows(columns)) {
    TableRow& row = rows.emplace_back(TableRow{source.label, {}});
    for (std::size_t i = 0; i < source.cells.size(); i += 4) {
      const std::string* const c = &source.cells[i];
      row.cells.push_back(c[0] == "-" ? "-" : c[0] + " [" + c[1] + ", " + c[2] + ", " + c[3] + ']');
    }
  }
  TableRow used{"runs used", {}}, diverged{"diverged", {}}, inconsistent{"inconsistent", {}};
  for (const SweepSummary& summary : summaries) {
    used.cells.push_back(std::to_string(summary.used));
    diverged.cells.push_back(std::to_string(summary.diverged));
    inconsistent.cells.push_back(std::to_string(summary.inconsistent));
  }
  rows.push_back(used);
  rows.push_back(diverged);
  rows.push_back(inconsistent);
  return rows;
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

std::map<std::string, Interval> NeesBounds(const SweepSummary& summary) {
  constexpr std::string_view kDof = "nees.dof:";
  std::map<std::string, Interval> bounds;
  for (const auto& [key, dof] : summary.metrics) {
    if (!key.starts_with(kDof) || summary.used == 0) continue;
    bounds["nees.mean:" + key.substr(kDof.size())] =
        ConsistencyBounds(dof.mean, static_cast<double>(summary.used));
  }
  return bounds;
}

std::string NeesLines(const std::vector<SweepSummary>& summaries) {
  std::string lines;
  for (const SweepSummary& summary : summaries) {
    for (const auto& [key, bounds] : NeesBounds(summary)) {
      const auto mean = summary.metrics.find(key);
      if (mean == summary.metrics.end()) continue;
      const double value = mean->second.mean;
      if (value >= bounds.low && value <= bounds.high) continue;
      lines += summary.name + ": the mean NEES of " + key.substr(key.find(':') + 1) + " over " +
               std::to_string(summary.used) + " runs is " + RoundedText(value, 3) +
               ", outside the 95 % bounds [" + RoundedText(bounds.low, 3) + ", " +
               RoundedText(bounds.high, 3) + "]: the filter is " +
               (value > bounds.high ? "overconfident" : "underconfident") + '\n';
    }
  }
  return lines.empty() ? "" : '\n' + lines;
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
                     ". Mean [5 %, 50 %, 95 % quantile] over the runs that did not diverge, "
                     "including inconsistent runs.\n\n";
  text += FormatTable(MakeTable(NamesOf(summaries), TableRows(summaries)), TableFormat::kMarkdown);
  return text + NeesLines(summaries) + ReferenceLines(result);
}

}  // namespace alidade::internal

namespace alidade {

std::string SweepTable(const SweepResult& result, const std::vector<SweepSummary>& summaries) {
  using internal::MakeTable, internal::NamesOf, internal::TableFormat;
  return FormatTable(MakeTable(NamesOf(summaries), internal::TableRows(summaries)),
                     TableFormat::kText) +
         internal::NeesLines(summaries) + internal::ReferenceLines(result);
}

}  // namespace alidade
