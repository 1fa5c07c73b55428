// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/base/statistics.h"
#include "alidade/sweep/sweep.h"

/// What every table and file of a sweep tells alike.
namespace alidade::internal {

/// Runs that came to their end.
std::int64_t CountWhole(const SweepResult& result);

/// Those of them in which there was no reference to compare with.
std::int64_t CountWithheld(const SweepResult& result);

/// For each owner the 95 % bounds of its mean NEES over all runs, by key of the metric. Each run
/// counts as one sample, which holds however the errors of a run are correlated over time.
std::map<std::string, Interval> NeesBounds(const SweepSummary& summary);

/// A line for each mean NEES outside its bounds, behind an empty one; "" where there is none.
std::string NeesLines(const std::vector<SweepSummary>& summaries);

/// What the errors of a sweep are differences from, and how often that was withheld, as lines
/// behind an empty one; "" where that is truth. Of a varied sweep: by value, where they differ.
std::string ReferenceLines(const SweepResult& result);
std::string ReferenceLines(const VariedSweep& sweep);

/// The text of `table.md`: a column for each estimator, of which `summaries` are.
std::string SweepMarkdown(const SweepResult& result, const std::vector<SweepSummary>& summaries);

}  // namespace alidade::internal
