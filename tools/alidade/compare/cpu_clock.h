// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/estimator.h"

namespace alidade::internal {

/// Returns the CPU time of the calling thread since an arbitrary origin, s.
double ThreadCpuSeconds();

/// CPU time of an estimator, without the time for reading the clock.
struct CpuTime {
  double frames_s = 0.0;     ///< processing of the frames
  double smoothing_s = 0.0;  ///< after the last frame, without the receiver of the estimates
};

/// Returns `estimator` with a clock that adds to `time`. Its results do not change. A clone has no
/// clock.
std::unique_ptr<Estimator> WithCpuClock(std::unique_ptr<Estimator> estimator,
                                        std::shared_ptr<CpuTime> time);

}  // namespace alidade::internal
