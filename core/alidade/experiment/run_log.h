// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "alidade/experiment/run.h"

/// What a run says in the log.
namespace alidade::internal {

/// Level info: streams and truth of the source, and of each estimator type, sensors and blocks.
void LogExperiment(const Experiment& experiment);

/// One message an event: a divergence is a warning, anything else info. `is_reason`: the run
/// returns the divergence as its reason, and it is info too.
void LogEvents(const std::string& estimator, std::span<const Event> events, bool is_reason = false);

/// Level debug: the wall clock of each estimator.
void LogDurations(const RunResult& result);

}  // namespace alidade::internal
