// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "alidade/experiment/estimator_run.h"

namespace alidade::internal {

/// Completes the result of `run` except for the metrics. Adds the counts, the units, the map, the
/// findings, the verdict, and events about the whole run, such as a sensor that was never used.
/// `run_failure` is the reason why the run ended before the data did, or "".
void CompleteResult(const Experiment& experiment, EstimatorRun& run, std::string_view run_failure);

}  // namespace alidade::internal
