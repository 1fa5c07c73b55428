// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/compare/compare.h"
#include "alidade/compare/finished_run.h"

namespace alidade::internal {

/// Reports whether both estimators use the same sensors.
bool HaveSameSensors(const EstimatorResult& a, const EstimatorResult& b);
/// Reports whether both estimators use the same models and sensors.
bool HaveSameProblem(const EstimatorResult& a, const EstimatorResult& b);

/// Reports whether every estimate uses all data. A sliding window uses only the later data within
/// the window.
inline bool SmoothsAllData(const EstimatorResult& result) {
  return result.smoothed && result.kind != EstimatorKind::kSlidingWindow;
}

/// Refuses the value `name` of an option, with the reason `message`. Error: kUsage.
[[noreturn]] void RefuseOption(const char* option, const std::string& message,
                               const std::string& name, const std::vector<std::string>& choices);
/// Refuses a `--filter` that is not in `filters`. `is_estimator`: an estimator has that name.
/// Error: kUsage.
[[noreturn]] void RefuseFilter(const std::string& name, bool is_estimator,
                               const std::vector<std::string>& filters);

/// Computes the distances over the landmarks that both maps contain, in m: `map`, the RMS
/// difference of their positions, and `map.sim3`, the RMS difference after the similarity that
/// minimises it [Umeyama1991].
std::map<std::string, double> DistanceBetweenMaps(const EstimatorResult& map,
                                                  const EstimatorResult& reference);

/// Compares the estimators of runs over the same data. Error: kUsage.
Comparison CompareRuns(std::vector<ComparedRun> runs, const CompareOptions& options);

/// Computes the steps from `filter` to the batch of all data. A step for which an estimator is
/// missing contains the reason instead of values.
std::vector<DecompositionStep> Decompose(const Candidate& filter,
                                         const std::vector<Candidate>& candidates, bool with_truth);

/// Returns the spread of a single value.
inline Spread SingleValue(double value) { return {value, value, value, value}; }

}  // namespace alidade::internal
