// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/run.h"

#include <algorithm>
#include <chrono>
#include <functional>

#include "alidade/base/number_text.h"
#include "alidade/experiment/accepted_data.h"
#include "alidade/experiment/diagnosis.h"
#include "alidade/experiment/estimator_run.h"
#include "alidade/experiment/frame_check.h"
#include "alidade/experiment/frame_order.h"
#include "alidade/experiment/metrics.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/run_log.h"

namespace alidade {
namespace {

/// ` at t = 0.033000 s`
std::string At(const Frame& frame) { return " at t = " + internal::SecondsText(frame.timestamp); }

/// Whether the frame has a measurement of the segment's stream that its sensor finds valid.
bool InSegment(const Segment& segment, const Frame& frame) {
  const auto seen = [&](const Measurement& m) {
    return m.stream == segment.stream &&
           segment.sensor->Valid({m.values.data(), m.known.data()}) == Status::kOk;
  };
  return std::any_of(frame.measurements.begin(), frame.measurements.end(), seen) == segment.with;
}

using internal::EstimatorRun;
using internal::FrameWithSegments;
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void Fail(RunResult& result, ExitCode code, std::string reason) {
  result.status = RunStatus::kFailed;
  result.code = code;
  result.reason = std::move(reason);
}

/// The text of the event by which the estimator diverged or failed, else of the last one.
std::string Cause(const std::vector<Event>& events, const char* otherwise) {
  const auto cause = std::ranges::find(events, true, &Event::divergence);
  if (cause != events.end()) return cause->text;
  return events.empty() ? otherwise : events.back().text;
}

/// One frame through one estimator, which sees `visible` of it, unless it was `rolled_back` to it;
/// false if the whole run has to end.
bool Advance(EstimatorRun& one, const FrameWithSegments& seen, const Frame& visible,
             const ProcessedFrame* rolled_back, const Source& source, const RunOptions& options,
             RunResult& result) {
  one.last_report = nullptr;
  if (one.finished) return true;
  const auto [after, report, wall_s] = one.Process(visible, source.streams(), rolled_back);
  if (wall_s) {
    one.result.wall_s += *wall_s;
    std::ranges::transform(one.result.parts_s, report.spent_s, one.result.parts_s.begin(),
                           std::plus<>());
    for (RunObserver* const observer : options.observers) observer->OnTime(one.index, *wall_s);
  }
  one.last_report = &report;
  one.finished = after.failed();
  one.diverged = after.diverged();
  one.AddEvents(report.events);
  if (!one.finished && !after.offline()) {
    const auto takes_since = Clock::now();
    one.AddEstimate(static_cast<std::size_t>(result.frames), seen, after.state(), report, options);
    one.result.record_s += SecondsSince(takes_since);
  }
  if (const std::string why = one.HandleFailures(report); !why.empty()) {
    if (result.status == RunStatus::kOk) {
      Fail(result, ExitCode::kPlugin,
           "estimator '" + one.spec.name + "'" + At(seen.frame) + ": " + why);
    }
    return false;
  }
  const bool policy = one.spec.on_divergence == OnDivergence::kFail && one.diverged;
  if (!one.finished && !policy) return true;
  if (result.status == RunStatus::kOk) {
    const std::string why = Cause(report.events, "diverged");
    Fail(result, ExitCode::kDiverged,
         "estimator '" + one.spec.name + "'" + At(seen.frame) + ": " + why);
  }
  return !policy;
}

/// The measurements of the frame that filter `by`, which has had what it sees of it, accepted.
Frame AcceptedBy(int by, const std::vector<EstimatorRun>& running, const Frame& frame,
                 const Source& source) {
  const EstimatorRun& filter = running[static_cast<std::size_t>(by)];
  const int before = filter.spec.accepted_by;
  return internal::AcceptedOf(before < 0 ? frame : AcceptedBy(before, running, frame, source),
                              source.streams(), filter.spec.problem,
                              filter.last_report ? *filter.last_report : UpdateReport());
}

/// The next frame, as the experiment's OutOfSequencePolicy has it; false at the end. What became of
/// others on the way is noted.
bool NextFrame(internal::FrameOrder& frames, std::vector<EstimatorRun>& running, RunResult& result,
               SourceFrame& frame) {
  const auto note = [&] {
    result.arrivals = frames.arrivals();
    const std::vector<Event> events = frames.TakeEvents();
    for (EstimatorRun& one : running) one.AddEvents(events);
  };
  try {
    const bool more = frames.Next(frame);
    note();
    return more;
  } catch (...) {
    note();
    throw;
  }
}

/// The frames one by one through all estimators. They are kept where an estimator is offline or
/// metrics wait for one.
void RunFrames(Experiment& experiment, std::vector<EstimatorRun>& running,
               const RunOptions& options, RunResult& result, std::vector<FrameWithSegments>& kept) {
  FrameWithSegments seen;
  seen.in_segment.resize(experiment.segments.size());
  const std::int64_t size = experiment.source->size();
  const bool keep = std::ranges::any_of(running, [](const EstimatorRun& one) {
    return one.needs_reference || one.spec.estimator->offline();
  });
  internal::FrameCheck check(experiment, result.normalised);
  internal::FrameOrder frames(experiment, [&check](SourceFrame& frame) { check(frame); });
  while (NextFrame(frames, running, result, seen.frame)) {
    check.FollowTruth(seen.frame);
    for (std::size_t i = 0; i < experiment.segments.size(); ++i) {
      seen.in_segment[i] = InSegment(experiment.segments[i], seen.frame);
    }
    for (RunObserver* const observer : options.observers) observer->OnFrame(seen.frame);
    if (keep) kept.push_back(seen);
    bool go_on = true;
    for (std::size_t e = 0; e < running.size(); ++e) {
      const ProcessedFrame* const rolled_back = frames.processed(e);
      const int by = rolled_back != nullptr ? -1 : running[e].spec.accepted_by;
      Frame accepted;
      if (by >= 0) accepted = AcceptedBy(by, running, seen.frame, *experiment.source);
      go_on = Advance(running[e], seen, by < 0 ? seen.frame : accepted, rolled_back,
                      *experiment.source, options, result) &&
              go_on;
    }
    ++result.frames;
    if (!go_on || std::ranges::all_of(running, &EstimatorRun::finished)) return;
    if (options.progress) options.progress(result.frames, size);
    if (options.stop && options.stop()) {
      if (result.status != RunStatus::kOk) return;
      result.status = RunStatus::kStopped;
      result.code = ExitCode::kStopped;
      result.reason = "stopped after " + std::to_string(result.frames) +
                      (result.frames == 1 ? " frame" : " frames");
      return;
    }
  }
}

/// The metrics of the estimator; where memory, say, does not last for them, the rest is kept.
void Measure(EstimatorRun& one, RunResult& result) {
  try {
    one.result.metrics = one.metrics.Finish();
  } catch (...) {
    Failure failure = CaughtFailure();
    if (result.status == RunStatus::kOk) Fail(result, failure.code, std::move(failure.reason));
  }
}

/// The smoothing of `one` was stopped; the others keep theirs.
void NoteStop(EstimatorRun& one, const char* why, RunResult& result) {
  one.AddEvents({{one.spec.estimator->timestamp(), "stopped", why}});
  if (result.status != RunStatus::kOk) return;
  result.status = RunStatus::kStopped;
  result.code = ExitCode::kStopped;
  result.reason = "estimator '" + one.spec.name + "': " + why;
}

/// The estimates of those that needed all frames.
void SmoothAll(std::vector<EstimatorRun>& running, const std::vector<FrameWithSegments>& kept,
               const RunOptions& options, RunResult& result) {
  for (EstimatorRun& one : running) {
    Estimator& estimator = *one.spec.estimator;
    if (one.finished || !estimator.offline()) continue;
    std::vector<Event> events;
    auto works_since = Clock::now();  // rather than the record and the metrics
    try {
      estimator.StopWhen(options.stop);
      estimator.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
        one.result.wall_s += SecondsSince(works_since);
        one.AddEstimate(k, kept[k], state, report, options);
        events = report.events;
        works_since = Clock::now();
      });
      one.result.wall_s += SecondsSince(works_since);
    } catch (const Error& e) {
      one.result.wall_s += SecondsSince(works_since);
      if (e.code() == ExitCode::kStopped) {
        NoteStop(one, e.what(), result);
        continue;
      }
      if (!estimator.failed()) throw;  // it is the record, say, that failed
      events.push_back({estimator.timestamp(), "failed", e.what()});
    }
    one.finished = estimator.failed();
    one.AddEvents(events);
    if (!one.finished || result.status == RunStatus::kFailed) continue;
    Fail(result, ExitCode::kDiverged,
         "estimator '" + one.spec.name + "': " + Cause(events, "failed"));
  }
}

/// Why the estimates of a reference are of no use to compare with; "": they are of use.
std::string WhyNoReference(const EstimatorRun& reference) {
  const Estimator& estimator = *reference.spec.estimator;
  const char* why = nullptr;
  if (reference.finished || estimator.failed()) {
    why = "failed";
  } else if (reference.diverged || estimator.diverged()) {
    why = "diverged";
  } else if (reference.estimates.empty()) {
    why = "has no estimates";
  }
  if (why == nullptr) return "";
  return "no reference: estimator '" + reference.spec.name + "' " + why +
         ", the comparison with it is withheld";
}

/// The metrics that waited for the estimates of the reference; what does not last for them is kept.
void Compare(std::vector<EstimatorRun>& running, int index,
             const std::vector<FrameWithSegments>& kept, RunResult& result) {
  const EstimatorRun& reference = running[static_cast<std::size_t>(index)];
  result.withheld = WhyNoReference(reference);
  if (!result.withheld.empty()) return;
  for (EstimatorRun& one : running) {
    if (one.index == index) continue;
    internal::AddDifferences(one.estimates, reference.estimates, kept, one.metrics);
  }
}

}  // namespace

const char* ToString(RunStatus status) {
  switch (status) {
    case RunStatus::kOk:
      return "ok";
    case RunStatus::kStopped:
      return "stopped";
    case RunStatus::kFailed:
      break;
  }
  return "failed";
}

RunResult Run(Experiment& experiment, const RunOptions& options) {
  RunResult result;
  const int reference = experiment.reference;
  if (reference >= 0) {
    result.reference = experiment.estimators[static_cast<std::size_t>(reference)].name;
  }
  std::vector<EstimatorRun> running;
  std::vector<FrameWithSegments> kept;
  const auto guarded = [&result](const auto& call) {
    try {
      call();
    } catch (...) {
      // What was done so far is kept.
      Failure failure = CaughtFailure();
      const bool stopped = failure.code == ExitCode::kStopped;
      if (stopped && result.status != RunStatus::kOk) return;  // a failure stays one
      Fail(result, failure.code, std::move(failure.reason));
      if (stopped) result.status = RunStatus::kStopped;
    }
  };
  guarded([&] {
    running = internal::BeginAll(experiment);
    for (RunObserver* const observer : options.observers) observer->Begin(experiment);
    internal::LogExperiment(experiment);
    for (const EstimatorRun& one : running) internal::LogEvents(one.spec.name, one.result.events);
    RunFrames(experiment, running, options, result, kept);
    SmoothAll(running, kept, options, result);
  });
  if (reference >= 0 && !running.empty()) {
    guarded([&] { Compare(running, reference, kept, result); });
  }
  for (EstimatorRun& one : running) {
    guarded([&] {
      Measure(one, result);
      internal::Diagnose(experiment, one);
    });
    result.estimators.push_back(std::move(one.result));
  }
  internal::LogDurations(result);
  return result;
}

}  // namespace alidade
