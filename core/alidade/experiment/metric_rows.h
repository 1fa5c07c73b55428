// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Returns the keys of all metrics of all estimators. The metrics that tables show come first, in
/// the order of kMetrics.
std::vector<std::string> OrderedMetrics(const RunResult& result);
/// Returns the keys of all counts. The counts of accepted measurements come first.
std::vector<std::string> OrderedCounts(const RunResult& result);

/// Returns the rows of the metrics that tables show, and of all counts.
std::vector<TableRow> MetricRows(const RunResult& result);
/// Returns the row `verdict` and MetricRows().
std::vector<TableRow> ComparisonRows(const RunResult& result);
/// Returns the subjects of rows in the order of the config: the blocks, their owners and the
/// sensors of each estimator.
std::vector<std::string> SubjectsOf(const Experiment& experiment);
/// Returns ComparisonRows() if they are at most ten rows. Otherwise returns `verdict` and nine
/// other rows in the same order, without rows of segments. The selection proceeds in rounds. Each
/// round chooses one subject of each metric, in the order of priority; subjects that `subjects`
/// does not contain come last.
std::vector<TableRow> MainRows(const RunResult& result, const std::vector<std::string>& subjects);
/// Returns the table of MainRows(), with the number of omitted rows.
std::string MainTable(const RunResult& result, const std::vector<std::string>& subjects);
/// Returns the rows of the metrics with this name over the whole run. Replaces the name by `label`.
std::vector<TableRow> RowsOf(const RunResult& result, const std::string& name,
                             const std::string& label);
/// Formats a value of the metric `key` with its unit, as in `2.04 mm`. `unit` is the unit of the
/// subject of the metric.
std::string ValueText(const std::string& key, double value, const std::string& unit);
/// Formats the metric `key` of an estimator with its unit. The prefix is that of its largest error.
std::string ValueText(const EstimatorResult& estimator, const std::string& key);
/// Returns a sentence about the reference of the errors; "" if the reference is truth.
std::string ReferenceText(const RunResult& result);

}  // namespace alidade::internal
