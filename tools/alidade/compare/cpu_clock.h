// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/estimator.h"

namespace alidade::internal {

/// Returns the CPU time of the calling thread since an arbitrary origin, s.
double ThreadCpuSeconds();

/// CPU time of an estimator. Excludes the time for reading the clock.
struct CpuTime {
  double frames_s = 0.0;     ///< time for the frames
  double smoothing_s = 0.0;  ///< time after the last frame; excludes the receiver of the estimates
};

/// Returns `estimator` with a clock that adds the CPU time to `time`. The estimates do not change.
/// A clone of the estimator has no clock.
std::unique_ptr<Estimator> WithCpuClock(std::unique_ptr<Estimator> estimator,
                                        std::shared_ptr<CpuTime> time);

}  // namespace alidade::internal
