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

/// Returns the keys of the metrics that tables show.
std::vector<std::string> ShownMetrics(const RunResult& result);
/// Returns the rows of ShownMetrics().
std::vector<TableRow> MetricRows(const RunResult& result);
/// Returns the rows of these metrics.
std::vector<TableRow> MetricRows(const RunResult& result, const std::vector<std::string>& keys);
/// Returns the row `verdict`, MetricRows() and the rows of all counts. If the verdict on an
/// estimator is bad, ` !` marks each mean NEES and NIS outside its bounds that agrees with it.
std::vector<TableRow> ComparisonRows(const RunResult& result);
/// Returns the subjects of rows in the order of the config: the blocks, their owners and the
/// sensors of each estimator.
std::vector<std::string> SubjectsOf(const Experiment& experiment);
/// Returns the keys of the metrics and counts that are most relevant to a run, at most nine:
/// errors, NEES, NIS, measurements, and the others by MetricInfo::priority. The first three
/// errors, and the first two subjects of each other metric, come before all later subjects.
/// `subjects` contains the subjects in order.
std::vector<std::string> MainKeys(const RunResult& result,
                                  const std::vector<std::string>& subjects);
/// Returns the table of the verdicts and of these keys, in this order. The estimators are columns
/// or rows. Omits the last keys if the table has more lines than `max_lines`. The key of accepted
/// measurements yields the row `used / given`. The last line contains the number of omitted rows.
std::string MainTable(const RunResult& result, const std::vector<std::string>& keys,
                      std::size_t width, std::size_t max_lines);
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
