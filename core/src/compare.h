// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/compare.h"
#include "compared_run.h"

namespace alidade::internal {

/// An estimator of one of the runs.
struct Candidate {
  std::string name;  ///< as the comparison has it
  const ComparedRun* run;
  const ComparedEntry* entry;

  const EstimatorFacts& facts() const { return entry->facts; }
  bool batch() const { return facts().type == "ceres_batch"; }
};

/// Compares the estimators of runs over the same data. Error: kUsage.
Comparison CompareRuns(const std::vector<ComparedRun>& runs, const CompareOptions& options);

/// The steps from `filter` to the batch of all data, of those that the candidates allow.
std::vector<GapStep> ExplainGap(const Candidate& filter, const std::vector<Candidate>& candidates,
                                bool with_truth);

/// A number that was taken once.
inline Spread Single(double value) { return {value, value, value, value}; }

}  // namespace alidade::internal
