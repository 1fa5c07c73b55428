// SPDX-License-Identifier: Apache-2.0
#include "alidade/run.h"

#include <algorithm>

#include "accepted.h"
#include "alidade/metrics.h"
#include "alidade/recorder.h"
#include "map_metrics.h"
#include "number_text.h"
#include "observability.h"
#include "reference.h"
#include "reorder.h"
#include "text_table.h"

namespace alidade {
namespace {

/// ` at t = 0.033000 s`
std::string At(const Frame& frame) {
  return " at t = " + internal::FixedText(Seconds(frame.stamp), 6) + " s";
}

[[noreturn]] void Refuse(const Frame& frame, const std::string& what) {
  throw ContractViolation("the source gives " + what + At(frame));
}

/// Throws ContractViolation for a frame that is not as Source::streams() and truths() say. Whatever
/// takes the frame afterwards indexes by stream and reads as many values as these tell.
void CheckFrame(const Frame& frame, const Source& source) {
  const std::vector<StreamInfo>& streams = source.streams();
  const std::vector<StreamInfo>& truths = source.truths();
  const auto check = [&](const StreamInfo& info, const std::vector<double>& values) {
    if (std::ssize(values) == info.size) return;
    Refuse(frame, std::to_string(values.size()) + " values of '" + info.name + "', not " +
                      std::to_string(info.size) + ',');
  };
  for (const Measurement& m : frame.measurements) {
    if (m.stream < 0 || m.stream >= std::ssize(streams)) {
      Refuse(frame, "a measurement of stream " + std::to_string(m.stream) + " of " +
                        std::to_string(streams.size()));
    }
    check(streams[static_cast<std::size_t>(m.stream)], m.values);
  }
  if (frame.truth.size() > truths.size()) {
    Refuse(frame,
           std::to_string(frame.truth.size()) + " truths of " + std::to_string(truths.size()));
  }
  for (std::size_t t = 0; t < frame.truth.size(); ++t) {
    if (!frame.truth[t].empty()) check(truths[t], frame.truth[t]);
  }
}

/// Whether the frame has a measurement of the segment's stream that its sensor finds valid.
bool InSegment(const Segment& segment, const Frame& frame) {
  const auto seen = [&](const Measurement& m) {
    return m.stream == segment.stream && segment.sensor.Valid(m.values.data()) == Status::kOk;
  };
  return std::any_of(frame.measurements.begin(), frame.measurements.end(), seen) == segment.with;
}

using internal::Seen;

/// One estimator on its way through a run.
struct Running {
  NamedEstimator& named;
  int index = 0;  ///< in the experiment
  Metrics metrics;
  EstimatorResult result;
  bool ended = false;                  ///< it had nothing left to go on with
  bool diverged = false;               ///< by a frame that was taken; not of offline estimators
  bool took = false;                   ///< an estimate, so that its counts tell of the measurements
  const UpdateReport* last = nullptr;  ///< report of the last frame; null: it had ended before
  bool waits = false;                  ///< metrics need the estimates of the reference
  std::vector<internal::Estimate> estimates = {};  ///< where it waits

  /// Puts the estimate of frame k into metrics and record.
  void Take(std::size_t k, const Seen& seen, const State& state, const UpdateReport& report,
            Recorder* recorder) {
    took = true;
    if (!waits) {
      metrics.Add(seen.frame, seen.in_segment, state, report);
    } else {
      metrics.AddReport(seen.in_segment, report);
      if (!report.stale) estimates.push_back({k, state});
    }
    if (recorder != nullptr) recorder->AddEstimate(index, seen.frame, state, report);
  }
  void Note(const std::vector<Event>& events) {
    result.events.insert(result.events.end(), events.begin(), events.end());
  }
};

EstimatorResult Begin(const NamedEstimator& named) {
  EstimatorResult result;
  result.name = named.name;
  result.unobservable = UnobservableDirections(named.system);
  if (!internal::ObservabilityIsTold(named.system)) {
    result.events.push_back({kNoStamp, "observability",
                             "not looked into: the state has more than " +
                                 std::to_string(internal::kMostObserved) + " elements"});
  }
  for (const auto& direction : result.unobservable) {
    result.events.push_back({kNoStamp, "unobservable",
                             "no sensor of this estimator tells " +
                                 internal::Join(direction, " and ") +
                                 (direction.size() > 1 ? " apart" : "")});
  }
  return result;
}

/// An event `unused` for each sensor of which the whole run used no measurement; `accepted_by`
/// names the filter that chose them, or is empty.
void NoteUnused(const System& system, const std::string& accepted_by, EstimatorResult& result) {
  for (const SensorBinding& sensor : system.sensors) {
    std::int64_t used = 0, all = 0;
    std::vector<std::string> others;
    for (const auto& [key, count] : result.counts) {
      const std::size_t colon = key.find(':');
      const std::string outcome = key.substr(0, colon);
      if (key.substr(colon + 1) != sensor.name || outcome == "inputs") continue;
      all += count;
      if (outcome == ToString(Outcome::kAccepted) || outcome == ToString(Outcome::kInitialised)) {
        used += count;
      } else {
        others.push_back(std::to_string(count) + ' ' + outcome);
      }
    }
    if (used > 0) continue;
    const std::string of_all =
        all > 0 ? " used none of " + std::to_string(all) +
                      " measurements: " + internal::Join(others, ", ")
                : ": stream '" + sensor.stream + "' had no measurement" +
                      (accepted_by.empty() ? "" : " that " + accepted_by + " accepted");
    result.events.push_back({kNoStamp, "unused", "sensor '" + sensor.name + "'" + of_all});
  }
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

/// One frame through one estimator, which sees `visible` of it, unless it has passed already; false
/// where the whole run has to end.
bool Advance(Running& one, const Seen& seen, const Frame& visible,
             const internal::Processed* passed, const RunOptions& options, RunResult& result) {
  one.last = nullptr;
  if (one.ended) return true;
  Estimator& estimator = *one.named.estimator;
  const UpdateReport& report = passed ? passed->report : estimator.Process(visible);
  one.last = &report;
  one.Note(report.events);
  one.ended = passed ? passed->failed : estimator.failed();
  one.diverged = passed ? passed->diverged : estimator.diverged();
  if (!one.ended && !estimator.offline()) {
    one.Take(static_cast<std::size_t>(result.frames), seen,
             passed ? passed->after->state : estimator.state(), report, options.recorder);
  }
  const bool policy = one.named.on_divergence == OnDivergence::kFail && one.diverged;
  if (!one.ended && !policy) return true;
  if (result.status == RunStatus::kOk) {
    const std::string why = Cause(report.events, "diverged");
    Fail(result, ExitCode::kDiverged,
         "estimator '" + one.named.name + "'" + At(seen.frame) + ": " + why);
  }
  return !policy;
}

/// The measurements of the frame that `filter`, which has had it, accepted.
Frame AcceptedOf(const Running& filter, const Frame& frame, const Source& source) {
  return internal::AcceptedOf(frame, source.streams(), filter.named.system,
                              filter.last ? *filter.last : UpdateReport());
}

/// The next frame, as the experiment's TimePolicy has it; false at the end. What became of others
/// on the way is noted.
bool NextFrame(internal::FrameOrder& frames, std::vector<Running>& running, RunResult& result,
               Frame& frame) {
  const auto note = [&] {
    result.arrivals = frames.arrivals();
    const std::vector<Event> events = frames.TakeEvents();
    for (Running& one : running) one.Note(events);
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
void RunFrames(Experiment& experiment, std::vector<Running>& running, const RunOptions& options,
               RunResult& result, std::vector<Seen>& kept) {
  Seen seen;
  seen.in_segment.resize(experiment.segments.size());
  const std::int64_t size = experiment.source->size();
  const bool keep = std::ranges::any_of(
      running, [](const Running& one) { return one.waits || one.named.estimator->offline(); });
  internal::FrameOrder frames(experiment, &CheckFrame);
  while (NextFrame(frames, running, result, seen.frame)) {
    for (std::size_t i = 0; i < experiment.segments.size(); ++i) {
      seen.in_segment[i] = InSegment(experiment.segments[i], seen.frame);
    }
    if (options.recorder != nullptr) options.recorder->AddFrame(seen.frame);
    if (keep) kept.push_back(seen);
    bool go_on = true;
    for (std::size_t e = 0; e < running.size(); ++e) {
      const int by = running[e].named.accepted_by;
      Frame accepted;
      if (by >= 0) {
        accepted =
            AcceptedOf(running[static_cast<std::size_t>(by)], seen.frame, *experiment.source);
      }
      go_on = Advance(running[e], seen, by < 0 ? seen.frame : accepted, frames.processed(e),
                      options, result) &&
              go_on;
    }
    ++result.frames;
    if (!go_on || std::ranges::all_of(running, &Running::ended)) return;
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
void Measure(Running& one, RunResult& result) {
  try {
    one.result.metrics = one.metrics.Finish();
  } catch (...) {
    Failure failure = CaughtFailure();
    if (result.status == RunStatus::kOk) Fail(result, failure.code, std::move(failure.reason));
  }
}

/// The smoothing of `one` was stopped; the others keep theirs.
void NoteStop(Running& one, const char* why, RunResult& result) {
  one.Note({{one.named.estimator->stamp(), "stopped", why}});
  if (result.status != RunStatus::kOk) return;
  result.status = RunStatus::kStopped;
  result.code = ExitCode::kStopped;
  result.reason = "estimator '" + one.named.name + "': " + why;
}

/// The estimates of those that needed all frames.
void SmoothAll(std::vector<Running>& running, const std::vector<Seen>& kept,
               const RunOptions& options, RunResult& result) {
  for (Running& one : running) {
    Estimator& estimator = *one.named.estimator;
    if (one.ended || !estimator.offline()) continue;
    std::vector<Event> events;
    try {
      estimator.StopWhen(options.stop);
      estimator.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
        one.Take(k, kept[k], state, report, options.recorder);
        events = report.events;
      });
    } catch (const Error& e) {
      if (e.code() == ExitCode::kStopped) {
        NoteStop(one, e.what(), result);
        continue;
      }
      if (!estimator.failed()) throw;  // it is the record, say, that failed
      events.push_back({estimator.stamp(), "failed", e.what()});
    }
    one.Note(events);
    if (!estimator.failed()) continue;
    Fail(result, ExitCode::kDiverged,
         "estimator '" + one.named.name + "': " + Cause(events, "failed"));
  }
}

/// Why the estimates of a reference are of no use to compare with; "": they are of use.
std::string WhyNoReference(const Running& reference) {
  const Estimator& estimator = *reference.named.estimator;
  const char* why = nullptr;
  if (reference.ended || estimator.failed()) {
    why = "failed";
  } else if (reference.diverged || estimator.diverged()) {
    why = "diverged";
  } else if (reference.estimates.empty()) {
    why = "has no estimates";
  }
  if (why == nullptr) return "";
  return "no reference: estimator '" + reference.named.name + "' " + why +
         ", the comparison with it is withheld";
}

/// The metrics that waited for the estimates of the reference; what does not last for them is kept.
void Compare(std::vector<Running>& running, int index, const std::vector<Seen>& kept,
             RunResult& result) {
  const Running& reference = running[static_cast<std::size_t>(index)];
  result.withheld = WhyNoReference(reference);
  if (!result.withheld.empty()) return;
  for (Running& one : running) {
    if (one.index == index) continue;
    internal::AddDifferences(one.estimates, reference.estimates, kept, one.metrics);
  }
}

/// All estimators of the experiment before their first frame.
std::vector<Running> BeginAll(Experiment& experiment) {
  const int reference = experiment.reference;
  std::vector<StreamInfo> truths = experiment.source->truths();
  for (std::size_t t = 0; t < experiment.truth_sigmas.size(); ++t)
    truths.at(t).sigma = experiment.truth_sigmas[t];
  if (reference >= 0) {
    truths = internal::BlocksOf(experiment.estimators[static_cast<std::size_t>(reference)].system);
  }
  std::vector<Running> running;
  for (NamedEstimator& named : experiment.estimators) {
    const int index = static_cast<int>(running.size());
    Metrics metrics(named, index == reference ? std::vector<StreamInfo>() : truths,
                    experiment.segments);
    running.push_back({named, index, std::move(metrics), Begin(named)});
    running.back().waits = reference >= 0;
  }
  return running;
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
  std::vector<Running> running;
  std::vector<Seen> kept;
  const auto guarded = [&result](const auto& call) {
    try {
      call();
    } catch (...) {
      // What was done so far is kept.
      Failure failure = CaughtFailure();
      Fail(result, failure.code, std::move(failure.reason));
      if (failure.code == ExitCode::kStopped) result.status = RunStatus::kStopped;
    }
  };
  guarded([&] {
    running = BeginAll(experiment);
    if (options.recorder != nullptr) options.recorder->Start(experiment);
    RunFrames(experiment, running, options, result, kept);
    SmoothAll(running, kept, options, result);
  });
  if (reference >= 0 && !running.empty()) {
    guarded([&] { Compare(running, reference, kept, result); });
  }
  for (Running& one : running) {
    Measure(one, result);
    one.result.counts = one.metrics.counts();
    one.result.units = one.metrics.units();
    internal::NoteMap(one.named, *experiment.source, one.result);
    if (one.took && !one.named.estimator->failed()) {
      const int by = one.named.accepted_by;
      NoteUnused(one.named.system, by < 0 ? "" : running[static_cast<std::size_t>(by)].named.name,
                 one.result);
    }
    one.Note(one.metrics.events());
    const Estimator& estimator = *one.named.estimator;
    one.result.diverged = one.diverged || (estimator.offline() && estimator.diverged()) ||
                          !one.metrics.events().empty();
    result.estimators.push_back(std::move(one.result));
  }
  return result;
}

}  // namespace alidade
