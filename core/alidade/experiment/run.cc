// SPDX-License-Identifier: Apache-2.0
#include "alidade/experiment/run.h"

#include <algorithm>
#include <chrono>
#include <functional>

#include "alidade/base/number_text.h"
#include "alidade/experiment/accepted_data.h"
#include "alidade/experiment/complete_result.h"
#include "alidade/experiment/estimator_run.h"
#include "alidade/experiment/frame_check.h"
#include "alidade/experiment/frame_order.h"
#include "alidade/experiment/metrics.h"
#include "alidade/experiment/reference_metrics.h"
#include "alidade/experiment/run_log.h"

namespace alidade {
namespace {

/// Returns a text such as ` at t = 0.033000 s`.
std::string TimeText(const Frame& frame) {
  return " at t = " + internal::SecondsText(frame.timestamp);
}

/// Returns whether the frame lies in the range of the segment and, depending on the segment,
/// contains, or does not contain, a valid measurement of a sensor.
bool IsInSegment(const Segment& segment, const Frame& frame) {
  if (frame.timestamp < segment.first || frame.timestamp > segment.last) return false;
  if (segment.sensor == nullptr) return true;
  const auto is_valid = [&](const Measurement& m) {
    return m.stream == segment.stream &&
           segment.sensor->Valid({m.values.data(), m.known.data()}) == Status::kOk;
  };
  return std::any_of(frame.measurements.begin(), frame.measurements.end(), is_valid) ==
         segment.has_measurement;
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

/// Returns the text of the event that reports a divergence or failure. If there is no such event,
/// returns the text of the last event, or `fallback` if there are no events.
std::string Cause(const std::vector<Event>& events, const char* fallback) {
  const auto cause = std::ranges::find(events, true, &Event::divergence);
  if (cause != events.end()) return cause->text;
  return events.empty() ? fallback : events.back().text;
}

/// Processes one frame with one estimator. `visible` is the frame with the measurements that the
/// estimator uses. If the estimator processed the frame on arrival, `rolled_back` is the result;
/// otherwise it is null. Returns false if the whole run must end.
bool Advance(EstimatorRun& run, const FrameWithSegments& frame, const Frame& visible,
             const ProcessedFrame* rolled_back, const Source& source, const RunOptions& options,
             RunResult& result) {
  run.last_report = nullptr;
  if (run.finished) return true;
  const auto [after, report, wall_s] = run.Process(visible, source.streams(), rolled_back);
  if (wall_s) {
    run.result.wall_s += *wall_s;
    std::ranges::transform(run.result.parts_s, report.spent_s, run.result.parts_s.begin(),
                           std::plus<>());
    for (RunObserver* const observer : options.observers) observer->OnTime(run.index, *wall_s);
  }
  run.last_report = &report;
  run.finished = after.failed();
  run.diverged = after.diverged();
  run.AddEvents(report.events);
  if (!run.finished && !after.offline()) {
    const auto start = Clock::now();
    run.AddEstimate(static_cast<std::size_t>(result.frames), frame, after.state(), report, options);
    run.result.record_s += SecondsSince(start);
  }
  if (const std::string reason = run.HandleFailures(report); !reason.empty()) {
    if (result.status == RunStatus::kOk) {
      Fail(result, ExitCode::kPlugin,
           "estimator '" + run.spec.name + "'" + TimeText(frame.frame) + ": " + reason);
    }
    return false;
  }
  const bool ends_run = run.spec.on_divergence == OnDivergence::kFail && run.diverged;
  if (!run.finished && !ends_run) return true;
  if (result.status == RunStatus::kOk) {
    const std::string reason = Cause(report.events, "diverged");
    Fail(result, ExitCode::kDiverged,
         "estimator '" + run.spec.name + "'" + TimeText(frame.frame) + ": " + reason);
  }
  return !ends_run;
}

/// Returns the frame with the measurements that the estimator with index `estimator` accepted. This
/// estimator must already have processed the frame.
Frame AcceptedBy(int estimator, const std::vector<EstimatorRun>& runs, const Frame& frame,
                 const Source& source) {
  const EstimatorRun& filter = runs[static_cast<std::size_t>(estimator)];
  const int earlier = filter.spec.accepted_by;
  return internal::AcceptedMeasurements(
      earlier < 0 ? frame : AcceptedBy(earlier, runs, frame, source), source.streams(),
      filter.spec.problem, filter.last_report ? *filter.last_report : UpdateReport());
}

/// Reads the next frame in the order of the OutOfSequencePolicy. Returns false at the end. Records
/// the statistics of arrival and the events of dropped frames.
bool NextFrame(internal::FrameOrder& frames, std::vector<EstimatorRun>& runs, RunResult& result,
               SourceFrame& frame) {
  const auto record = [&] {
    result.arrivals = frames.arrivals();
    const std::vector<Event> events = frames.ExtractEvents();
    for (EstimatorRun& run : runs) run.AddEvents(events);
  };
  try {
    const bool has_frame = frames.Next(frame);
    record();
    return has_frame;
  } catch (...) {
    record();
    throw;
  }
}

/// Processes the frames one by one with all estimators. Adds the frames to `stored` if an estimator
/// is offline, or if metrics need the estimates of the reference.
void RunFrames(Experiment& experiment, std::vector<EstimatorRun>& runs, const RunOptions& options,
               RunResult& result, std::vector<FrameWithSegments>& stored) {
  FrameWithSegments frame;
  frame.in_segment.resize(experiment.segments.size());
  const std::int64_t size = experiment.source->size();
  const bool stores_frames = std::ranges::any_of(runs, [](const EstimatorRun& run) {
    return run.needs_reference || run.spec.estimator->offline();
  });
  internal::FrameCheck check(experiment, result.normalised);
  internal::FrameOrder frames(experiment, [&check](SourceFrame& received) { check(received); });
  while (NextFrame(frames, runs, result, frame.frame)) {
    check.ChooseTruthSigns(frame.frame);
    for (std::size_t i = 0; i < experiment.segments.size(); ++i) {
      frame.in_segment[i] = IsInSegment(experiment.segments[i], frame.frame);
    }
    for (RunObserver* const observer : options.observers) observer->OnFrame(frame.frame);
    if (stores_frames) stored.push_back(frame);
    bool can_continue = true;
    for (std::size_t e = 0; e < runs.size(); ++e) {
      const ProcessedFrame* const rolled_back = frames.processed(e);
      const int filter = rolled_back != nullptr ? -1 : runs[e].spec.accepted_by;
      Frame accepted;
      if (filter >= 0) accepted = AcceptedBy(filter, runs, frame.frame, *experiment.source);
      can_continue = Advance(runs[e], frame, filter < 0 ? frame.frame : accepted, rolled_back,
                             *experiment.source, options, result) &&
                     can_continue;
    }
    ++result.frames;
    if (!can_continue || std::ranges::all_of(runs, &EstimatorRun::finished)) return;
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

/// Computes the metrics of an estimator. If the computation fails, for example for lack of memory,
/// the other results remain valid.
void ComputeMetrics(EstimatorRun& run, RunResult& result) {
  try {
    run.result.metrics = run.metrics.Finish();
  } catch (...) {
    Failure failure = CaughtFailure();
    if (result.status == RunStatus::kOk) Fail(result, failure.code, std::move(failure.reason));
  }
}

/// Records that the smoothing of an estimator was stopped. The results of the other estimators
/// remain valid.
void RecordStop(EstimatorRun& run, const char* reason, RunResult& result) {
  run.AddEvents({{run.spec.estimator->timestamp(), EventKind::kStopped, reason}});
  if (result.status != RunStatus::kOk) return;
  result.status = RunStatus::kStopped;
  result.code = ExitCode::kStopped;
  result.reason = "estimator '" + run.spec.name + "': " + reason;
}

/// Computes the estimates of the offline estimators.
void SmoothAll(std::vector<EstimatorRun>& runs, const std::vector<FrameWithSegments>& stored,
               const RunOptions& options, RunResult& result) {
  for (EstimatorRun& run : runs) {
    Estimator& estimator = *run.spec.estimator;
    if (run.finished || !estimator.offline()) continue;
    std::vector<Event> events;
    auto start = Clock::now();  // start of the time measurement, which excludes records and metrics
    try {
      estimator.StopWhen(options.stop);
      estimator.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
        run.result.wall_s += SecondsSince(start);
        run.AddEstimate(k, stored[k], state, report, options);
        events = report.events;
        start = Clock::now();
      });
      run.result.wall_s += SecondsSince(start);
    } catch (const Error& e) {
      run.result.wall_s += SecondsSince(start);
      if (e.code() == ExitCode::kStopped) {
        RecordStop(run, e.what(), result);
        continue;
      }
      // The estimator did not fail, so another part, such as a record, threw the error.
      if (!estimator.failed()) throw;
      events.push_back({estimator.timestamp(), EventKind::kFailed, e.what()});
    }
    run.finished = estimator.failed();
    run.AddEvents(events);
    if (!run.finished || result.status == RunStatus::kFailed) continue;
    Fail(result, ExitCode::kDiverged,
         "estimator '" + run.spec.name + "': " + Cause(events, "failed"));
  }
}

/// Returns the reason why the estimates of a reference cannot be used for a comparison, or "" if
/// they can be used.
std::string WhyNoReference(const EstimatorRun& reference) {
  const Estimator& estimator = *reference.spec.estimator;
  const char* state = nullptr;
  if (reference.finished || estimator.failed()) {
    state = "failed";
  } else if (reference.diverged || estimator.diverged()) {
    state = "diverged";
  } else if (reference.estimates.empty()) {
    state = "has no estimates";
  }
  if (state == nullptr) return "";
  return "no reference is available: estimator '" + reference.spec.name + "' " + state +
         ", so the comparison with this estimator is withheld";
}

/// Adds the differences from the reference to the metrics of the other estimators.
void Compare(std::vector<EstimatorRun>& runs, int index,
             const std::vector<FrameWithSegments>& stored, RunResult& result) {
  const EstimatorRun& reference = runs[static_cast<std::size_t>(index)];
  result.withheld = WhyNoReference(reference);
  if (!result.withheld.empty()) return;
  for (EstimatorRun& run : runs) {
    if (run.index == index) continue;
    internal::AddDifferences(run.estimates, reference.estimates, stored, run.metrics);
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
  std::vector<EstimatorRun> runs;
  std::vector<FrameWithSegments> stored;
  const auto run_guarded = [&result](const auto& call) {
    try {
      call();
    } catch (...) {
      // The results up to this frame remain valid.
      Failure failure = CaughtFailure();
      const bool was_stopped = failure.code == ExitCode::kStopped;
      if (was_stopped && result.status != RunStatus::kOk) return;  // the earlier status remains
      Fail(result, failure.code, std::move(failure.reason));
      if (was_stopped) result.status = RunStatus::kStopped;
    }
  };
  run_guarded([&] {
    runs = internal::CreateRuns(experiment);
    for (RunObserver* const observer : options.observers) observer->Begin(experiment);
    internal::LogExperiment(experiment);
    for (const EstimatorRun& run : runs) internal::LogEvents(run.spec.name, run.result.events);
    RunFrames(experiment, runs, options, result, stored);
    SmoothAll(runs, stored, options, result);
  });
  if (reference >= 0 && !runs.empty()) {
    run_guarded([&] { Compare(runs, reference, stored, result); });
  }
  const bool is_failed = result.status == RunStatus::kFailed;
  for (EstimatorRun& run : runs) {
    run_guarded([&] {
      ComputeMetrics(run, result);
      internal::CompleteResult(experiment, run, is_failed ? result.reason : "");
    });
    result.estimators.push_back(std::move(run.result));
  }
  internal::LogDurations(result);
  return result;
}

}  // namespace alidade
