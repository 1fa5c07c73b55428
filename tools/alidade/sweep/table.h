// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/experiment/metric_rows.h"
#include "alidade/io/text_table.h"
#include "alidade/report/conclusion.h"
#include "alidade/sweep/sweep.h"

/// Texts and statistics that the tables and files of a sweep have in common.
namespace alidade::internal {

/// Returns the number of finished runs.
std::int64_t CountFinished(const SweepResult& result);

/// Returns the number of finished runs without a reference for the errors.
std::int64_t CountWithheld(const SweepResult& result);

/// Returns a row `runs used`, and a row for each verdict that occurred, with the number of runs.
/// The rows have a cell for each summary.
std::vector<TableRow> VerdictRows(const std::vector<SweepSummary>& summaries);

/// Returns the 95 % bounds of the mean NEES over all runs for each owner, by the key of the metric.
/// Each run counts as one sample, so the bounds are valid for any correlation of the errors over
/// time.
std::map<std::string, Interval> NeesBounds(const SweepSummary& summary);

/// Returns a line for each conclusion, and an empty line. Returns "" if there is no conclusion.
std::string FormatConclusions(const std::vector<Conclusion>& conclusions, TableFormat format);

/// Returns an empty line, and a line about the reference of the errors. This line also contains the
/// number of runs in which the errors were withheld. Returns "" if the reference is truth. For a
/// varied sweep with different lines, returns the lines of all values.
std::string ReferenceLines(const SweepResult& result);
std::string ReferenceLines(const VariedSweep& sweep);

/// Returns the text of `table.md`.
std::string SweepMarkdown(const SweepResult& result, const std::vector<SweepSummary>& summaries);

}  // namespace alidade::internal
