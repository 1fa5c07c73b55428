// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "alidade/experiment/metrics.h"

/// Metrics whose reference is an estimator instead of truth.
namespace alidade::internal {

/// Returns the blocks of a problem in the form of the truths of a source.
std::vector<StreamInfo> BlocksOf(const Problem& problem);

/// Values of an estimate, and the index of the frame of the estimate in the run.
struct Estimate {
  std::size_t frame;
  /// Value of each block of the problem. A value is empty if the block has no value.
  std::vector<std::vector<double>> values;
};

/// Returns the values of the first `blocks` blocks of a state.
std::vector<std::vector<double>> ValuesOf(const State& state, std::size_t blocks);

/// Frame of a run, with its membership in each segment.
struct FrameWithSegments {
  SourceFrame frame;
  std::vector<bool> in_segment;
};

/// Adds to `metrics` the differences between `estimates` and `reference` at the same frames. The
/// truths of `metrics` must be the result of BlocksOf() for the problem of the reference. `frames`
/// are all frames of the run. A reference value that is not finite counts as unknown.
void AddDifferences(const std::vector<Estimate>& estimates, const std::vector<Estimate>& reference,
                    const std::vector<FrameWithSegments>& frames, Metrics& metrics);

}  // namespace alidade::internal
