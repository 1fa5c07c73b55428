// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "alidade/experiment/run.h"

/// Log messages of a run.
namespace alidade::internal {

/// Logs the streams and truths of the source, and the type, sensors and blocks of each estimator.
/// The level is info.
void LogExperiment(const Experiment& experiment);

/// Logs one message for each event: a divergence as a warning, all others as info. If `is_reason`
/// is true, a divergence is also logged as info, because the run reports this divergence as the
/// reason why it ended.
void LogEvents(const std::string& estimator, std::span<const Event> events, bool is_reason = false);

/// Logs the wall-clock time of each estimator. The level is debug.
void LogDurations(const RunResult& result);

}  // namespace alidade::internal
