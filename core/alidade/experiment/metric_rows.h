// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "alidade/experiment/run.h"
#include "alidade/io/text_table.h"

namespace alidade::internal {

/// Keys of all metrics of all estimators: those that tables show, in the order of kMetrics, then the
/// others.
std::vector<std::string> OrderedMetrics(const RunResult& result);
/// Keys of all counts, accepted measurements first.
std::vector<std::string> OrderedCounts(const RunResult& result);

/// The rows of the metrics that tables show, and of all counts.
std::vector<TableRow> MetricRows(const RunResult& result);
/// MetricRows() and the rows `diverged` and `inconsistent`.
std::vector<TableRow> ComparisonRows(const RunResult& result);
/// The subjects of rows, in the order of the config: the blocks, their owners and the sensors of
/// each estimator.
std::vector<std::string> SubjectsOf(const Experiment& experiment);
/// ComparisonRows(), or if there are more than ten: `diverged`, `inconsistent` and eight others in
/// the same order, without segments. They are chosen by the priority of the metrics in turns: one
/// subject of each metric, then the second one. Unknown subjects come last.
std::vector<TableRow> MainRows(const RunResult& result, const std::vector<std::string>& subjects);
/// The table of MainRows(), with the number of omitted rows.
std::string MainTable(const RunResult& result, const std::vector<std::string>& subjects);
/// The rows of the metrics of this name over whole runs, labelled `label` in place of the name.
std::vector<TableRow> RowsOf(const RunResult& result, const std::string& name,
                             const std::string& label);
/// The reference of the errors, as a sentence; "" if it is truth.
std::string ReferenceText(const RunResult& result);

}  // namespace alidade::internal
