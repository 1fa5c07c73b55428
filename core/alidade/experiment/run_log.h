// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "alidade/experiment/run.h"

/// Log messages of a run.
namespace alidade::internal {

/// Logs, at level info, the streams and truths of the source, and the type, sensors and blocks of
/// each estimator.
void LogExperiment(const Experiment& experiment);

/// Logs one message for each event: a divergence as a warning, all others as info. With
/// `is_reason`, the run reports the divergence as its reason, so it is logged as info.
void LogEvents(const std::string& estimator, std::span<const Event> events, bool is_reason = false);

/// Logs, at level debug, the wall-clock time of each estimator.
void LogDurations(const RunResult& result);

}  // namespace alidade::internal
