// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/run_log.h"

#include "alidade/base/number_text.h"
#include "alidade/base/text.h"
#include "alidade/io/log.h"

namespace alidade::internal {
namespace {

std::string OrNone(const std::string& text) { return text.empty() ? "none" : text; }

}  // namespace

void LogExperiment(const Experiment& experiment) {
  if (!IsLogged(LogLevel::kInfo)) return;
  Log(LogLevel::kInfo, "source: streams " + OrNone(Join(NamesOf(experiment.source->streams()))) +
                           "; truth " + OrNone(Join(NamesOf(experiment.source->truths()))) +
                           "; seed " + std::to_string(experiment.seed));
  for (const EstimatorSpec& spec : experiment.estimators) {
    Log(LogLevel::kInfo, spec.name + ": type " + spec.type + "; sensors " +
                             OrNone(Join(NamesOf(spec.problem.sensors))) + "; blocks " +
                             OrNone(Join(NamesOf(spec.problem.layout.blocks()))));
  }
}

void LogEvents(const std::string& estimator, std::span<const Event> events, bool is_reason) {
  for (const Event& event : events) {
    const LogLevel level = event.divergence && !is_reason ? LogLevel::kWarning : LogLevel::kInfo;
    if (!IsLogged(level)) continue;
    const std::string time =
        event.timestamp == kNoTimestamp ? "" : " at t = " + SecondsText(event.timestamp);
    Log(level, estimator + ": " + ToString(event.kind) + time + ": " + event.text);
  }
}

void LogDurations(const RunResult& result) {
  if (!IsLogged(LogLevel::kDebug)) return;
  for (const EstimatorResult& estimator : result.estimators) {
    Log(LogLevel::kDebug, estimator.name + ": " + FixedText(estimator.wall_s, 3) + " s for " +
                              std::to_string(result.frames) + " frames");
  }
}

}  // namespace alidade::internal
