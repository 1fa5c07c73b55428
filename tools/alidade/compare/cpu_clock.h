// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/estimator.h"

namespace alidade::internal {

/// Returns the CPU time of the calling thread since an arbitrary origin, s.
double ThreadCpuSeconds();

/// CPU time of an estimator. Excludes the time for reading the clock.
struct CpuTime {
  double frames_s = 0.0;  ///< time for processing the frames
  /// Time for smoothing after the last frame. Excludes the time of the receiver of the estimates.
  double smoothing_s = 0.0;
};

/// Wraps `estimator` in an estimator that measures the CPU time and adds it to `time`. The
/// estimates do not change. A clone does not measure the CPU time.
std::unique_ptr<Estimator> WithCpuClock(std::unique_ptr<Estimator> estimator,
                                        std::shared_ptr<CpuTime> time);

}  // namespace alidade::internal
