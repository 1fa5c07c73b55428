// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "alidade/compare/compare.h"
#include "alidade/compare/finished_run.h"

namespace alidade::internal {

/// Whether both take the same measurements.
bool SameSensors(const EstimatorResult& a, const EstimatorResult& b);
/// Whether both are of the same models and sensors.
bool SameSystem(const EstimatorResult& a, const EstimatorResult& b);

/// Whether its estimates rest on all data; later data of a window end with it.
inline bool SmoothsAllData(const EstimatorResult& one) {
  return one.smoothed && one.kind != EstimatorKind::kSlidingWindow;
}

/// Refuses what an option names. Error: kUsage.
[[noreturn]] void RefuseOption(const char* option, const std::string& what, const std::string& name,
                               const std::vector<std::string>& choices);
/// Refuses a `--filter` that is not one of `filters`; `known`: there is an estimator of that name.
[[noreturn]] void RefuseFilter(const std::string& name, bool known,
                               const std::vector<std::string>& filters);

/// Over the landmarks that both maps have, in m: `map`, the RMS difference of their places, and
/// `map.sim3`, what is left of it after the similarity that makes it least [Umeyama1991].
std::map<std::string, double> DistanceBetweenMaps(const EstimatorResult& map,
                                                  const EstimatorResult& reference);

/// Compares the estimators of runs over the same data. Error: kUsage.
Comparison CompareRuns(std::vector<ComparedRun> runs, const CompareOptions& options);

/// The steps from `filter` to the batch of all data, of those that the candidates allow.
std::vector<DecompositionStep> Decompose(const Candidate& filter,
                                         const std::vector<Candidate>& candidates, bool with_truth);

/// A number that was taken once.
inline Spread Single(double value) { return {value, value, value, value}; }

}  // namespace alidade::internal
