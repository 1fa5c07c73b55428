// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/compare/compare.h"
#include "alidade/compare/finished_run.h"

namespace alidade::internal {

/// Returns true if both estimators use the same sensors.
bool HaveSameSensors(const EstimatorResult& a, const EstimatorResult& b);
/// Returns true if both estimators use the same models and sensors.
bool HaveSameProblem(const EstimatorResult& a, const EstimatorResult& b);

/// Returns true if every estimate uses all data. Returns false for a sliding window, whose
/// estimates use later data only within the window.
inline bool SmoothsAllData(const EstimatorResult& result) {
  return result.smoothed && result.kind != EstimatorKind::kSlidingWindow;
}

/// Refuses the value `name` of an option, with the reason `message`. Error: kUsage.
[[noreturn]] void RefuseOption(const char* option, const std::string& message,
                               const std::string& name, const std::vector<std::string>& choices);
/// Refuses a value of `--filter` that is not in `filters`. `is_estimator` is true if `name` is the
/// name of an estimator. Error: kUsage.
[[noreturn]] void RefuseFilter(const std::string& name, bool is_estimator,
                               const std::vector<std::string>& filters);

/// Computes the distances in m over the landmarks that both maps contain. `map` is the RMS
/// difference of the positions. `map.sim3` is the RMS difference after alignment by the similarity
/// that minimises this difference [Umeyama1991].
std::map<std::string, double> DistanceBetweenMaps(const EstimatorResult& map,
                                                  const EstimatorResult& reference);

/// Compares the estimators of runs over the same data. Error: kUsage.
Comparison CompareRuns(std::vector<ComparedRun> runs, const CompareOptions& options);

/// Computes the steps of the decomposition from `filter` to the batch of all data. If an estimator
/// of a step is missing, the step contains the reason instead of values.
std::vector<DecompositionStep> Decompose(const Candidate& filter,
                                         const std::vector<Candidate>& candidates, bool with_truth);

/// Returns the spread of a single value.
inline Spread SingleValue(double value) { return {value, value, value, value, 1}; }

}  // namespace alidade::internal
