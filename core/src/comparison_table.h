// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/run.h"

namespace alidade::internal {

/// Keys of all metrics of all estimators, the ones a person wants first: rmse, rmse over segments,
/// lag, coverage, NEES, NIS, then what else there is.
std::vector<std::string> OrderedMetrics(const RunResult& result);
/// Keys of all counts, those accepted first.
std::vector<std::string> OrderedCounts(const RunResult& result);

/// One line of a comparison: a label with its unit, and a cell for each estimator, `-` where it has
/// no value.
struct ComparisonRow {
  std::string label;
  std::vector<std::string> cells;
};
/// The main metrics and all counts.
std::vector<ComparisonRow> MetricRows(const RunResult& result);
/// These, whether it diverged and whether its errors were inconsistent.
std::vector<ComparisonRow> ComparisonRows(const RunResult& result);
/// Metrics whose keys begin alike, `rmse` of `rmse:target.depth`, and what a row calls them.
struct RowKind {
  std::string kind, label;
};
/// The metrics of these kinds, in their order, over whole runs.
std::vector<ComparisonRow> RowsOf(const RunResult& result, const std::vector<RowKind>& kinds);
/// What the metrics compare with, in words; "" where that is truth.
std::string ReferenceText(const RunResult& result);
/// Rows below the names of the estimators, aligned to the right. Estimators that do not fit beside
/// the others in a line of 100 characters go into a table below.
std::string EstimatorTable(const std::vector<std::string>& names,
                           const std::vector<ComparisonRow>& rows);
/// The label of a row, then its cells.
std::vector<std::string> CellsOf(const ComparisonRow& row);
/// The rows as a table of Markdown, `corner` above their labels.
std::string MarkdownTable(const std::string& corner, const std::vector<std::string>& names,
                          const std::vector<ComparisonRow>& rows);

}  // namespace alidade::internal
