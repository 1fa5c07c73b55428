// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "alidade/estimation/estimator.h"

namespace alidade::internal {

/// CPU time of the calling thread, s, since some time before.
double ThreadCpuSeconds();

/// CPU time of the thread of an estimator, without what it takes to read the clock.
struct CpuTime {
  double frames_s = 0.0;     ///< in its frames
  double smoothing_s = 0.0;  ///< after the last frame, without what takes its estimates
};

/// `estimator` with a clock that adds to `time`; it works as before. A copy has no clock.
std::unique_ptr<Estimator> WithCpuClock(std::unique_ptr<Estimator> estimator,
                                        std::shared_ptr<CpuTime> time);

}  // namespace alidade::internal
