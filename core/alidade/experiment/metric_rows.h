// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Keys of all metrics of all estimators, the ones a person wants first: rmse, rmse over segments,
/// lag, coverage, NEES, NIS, then what else there is.
std::vector<std::string> OrderedMetrics(const RunResult& result);
/// Keys of all counts, those accepted first.
std::vector<std::string> OrderedCounts(const RunResult& result);

/// The main metrics and all counts.
std::vector<TableRow> MetricRows(const RunResult& result);
/// These, whether it diverged and whether its errors were inconsistent.
std::vector<TableRow> ComparisonRows(const RunResult& result);
/// What rows are about, in the order of the config: the blocks, their owners and the sensors of
/// each estimator.
std::vector<std::string> SubjectsOf(const Experiment& experiment);
/// At most ten rows of ComparisonRows, those that matter most, in its order; all of them if they
/// are no more. `diverged` and `inconsistent` are two. The others are dealt out in turns: the first
/// subject's rmse, nees.mean, nis.mean, accepted, coverage95, map.rmse, map.sim3.rmse and
/// reprojection, then the second subject's, and so on. Segments are left out; unknown subjects come
/// last, by name.
std::vector<TableRow> MainRows(const RunResult& result, const std::vector<std::string>& subjects);
/// ComparisonTable() of these rows, with the number of those left out.
std::string MainTable(const RunResult& result, const std::vector<std::string>& subjects);
/// Metrics whose keys begin alike, `rmse` of `rmse:target.depth`, and what a row calls them.
struct RowKind {
  std::string kind, label;
};
/// The metrics of these kinds, in their order, over whole runs.
std::vector<TableRow> RowsOf(const RunResult& result, const std::vector<RowKind>& kinds);
/// What the metrics compare with, in words; "" where that is truth.
std::string ReferenceText(const RunResult& result);

}  // namespace alidade::internal
