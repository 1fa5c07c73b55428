// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "alidade/experiment/estimator_run.h"

namespace alidade::internal {

/// Completes the result of `run` except for the metrics. Adds the counts, the units and the map,
/// and sets the flags of divergence and failure. Also adds an event for each finding, such as a
/// sensor that was never used.
void Diagnose(const Experiment& experiment, EstimatorRun& run);

}  // namespace alidade::internal
