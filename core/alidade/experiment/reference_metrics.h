// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/metrics.h"

/// An estimator in the place of truth.
namespace alidade::internal {

/// The blocks of a problem as a source names its truths.
std::vector<StreamInfo> BlocksOf(const Problem& problem);

/// An estimate, as far as errors are taken from it, and the index of its frame in the run.
struct Estimate {
  std::size_t frame;
  std::vector<std::vector<double>> values;  ///< by block of the problem; empty where it has none
};

/// The values of the first `blocks` blocks of a state.
std::vector<std::vector<double>> ValuesOf(const State& state, std::size_t blocks);

/// A frame of a run, and which segments it is in.
struct FrameWithSegments {
  SourceFrame frame;
  std::vector<bool> in_segment;
};

/// Gives `metrics`, made for BlocksOf the reference's problem, the differences of `estimates` from
/// those of the reference at the same frames of `seen`. A value of the reference that is not finite
/// counts as unknown.
void AddDifferences(const std::vector<Estimate>& estimates, const std::vector<Estimate>& reference,
                    const std::vector<FrameWithSegments>& seen, Metrics& metrics);

}  // namespace alidade::internal
