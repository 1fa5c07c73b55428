// SPDX-License-Identifier: Apache-2.0
#include "alidade/run.h"

#include <algorithm>

#include "alidade/metrics.h"
#include "alidade/recorder.h"
#include "map_metrics.h"
#include "reorder.h"
#include "text_table.h"

namespace alidade {
namespace {

[[noreturn]] void Refuse(const Frame& frame, const std::string& what) {
  char at[48];
  std::snprintf(at, sizeof(at), " at t = %.6f s", Seconds(frame.stamp));
  throw ContractViolation("the source gives " + what + at);
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

/// A frame, and which segments it is in.
struct Seen {
  Frame frame;
  std::vector<bool> in_segment;
};

/// One estimator on its way through a run.
struct Running {
  NamedEstimator& named;
  int index = 0;  ///< in the experiment
  Metrics metrics;
  EstimatorResult result;
  bool ended = false;     ///< it had nothing left to go on with
  bool diverged = false;  ///< by a frame that was taken; not of offline estimators

  /// Puts an estimate into metrics and record.
  void Take(const Seen& seen, const State& state, const UpdateReport& report, Recorder* recorder) {
    metrics.Add(seen.frame, seen.in_segment, state, report);
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
  for (const auto& direction : result.unobservable) {
    result.events.push_back({kNoStamp, "unobservable",
                             "no sensor of this estimator tells " +
                                 internal::Join(direction, " and ") +
                                 (direction.size() > 1 ? " apart" : "")});
  }
  return result;
}

/// An event `unused` for each sensor of which the whole run used no measurement.
void NoteUnused(const System& system, EstimatorResult& result) {
  for (const SensorBinding& sensor : system.sensors) {
    std::int64_t used = 0, all = 0;
    std::vector<std::string> others;
    for (const auto& [key, count] : result.counts) {
      const std::size_t colon = key.find(':');
      const std::string outcome = key.substr(0, colon);
      if (key.substr(colon + 1) != sensor.name) continue;
      all += count;
      if (outcome == ToString(Outcome::kAccepted) || outcome == ToString(Outcome::kInitialised)) {
        used += count;
      } else {
        others.push_back(std::to_string(count) + ' ' + outcome);
      }
    }
    if (used > 0) continue;
    const std::string of_all = all > 0 ? " used none of " + std::to_string(all) +
                                             " measurements: " + internal::Join(others, ", ")
                                       : ": stream '" + sensor.stream + "' had no measurement";
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

/// One frame through one estimator, unless it has passed already; false where the whole run has to
/// end.
bool Advance(Running& one, const Seen& seen, const internal::Passed* passed,
             const RunOptions& options, RunResult& result) {
  if (one.ended) return true;
  Estimator& estimator = *one.named.estimator;
  const UpdateReport& report = passed ? passed->report : estimator.Process(seen.frame);
  one.Note(report.events);
  one.ended = passed ? passed->failed : estimator.failed();
  one.diverged = passed ? passed->diverged : estimator.diverged();
  if (!one.ended && !estimator.offline()) {
    one.Take(seen, passed ? passed->after->state : estimator.state(), report, options.recorder);
  }
  const bool policy = one.named.on_divergence == OnDivergence::kFail && one.diverged;
  if (!one.ended && !policy) return true;
  if (result.status == RunStatus::kOk) {
    const std::string why = Cause(report.events, "diverged");
    char at[48];
    std::snprintf(at, sizeof(at), " at t = %.6f s: ", Seconds(seen.frame.stamp));
    Fail(result, ExitCode::kDiverged, "estimator '" + one.named.name + "'" + at + why);
  }
  return !policy;
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

/// The frames one by one through all estimators; where one is offline, they are kept for it.
void RunFrames(Experiment& experiment, std::vector<Running>& running, const RunOptions& options,
               RunResult& result, std::vector<Seen>& kept) {
  Seen seen;
  seen.in_segment.resize(experiment.segments.size());
  const std::int64_t size = experiment.source->size();
  const bool keep = std::ranges::any_of(
      running, [](const Running& one) { return one.named.estimator->offline(); });
  internal::FrameOrder frames(experiment, &CheckFrame);
  while (NextFrame(frames, running, result, seen.frame)) {
    for (std::size_t i = 0; i < experiment.segments.size(); ++i) {
      seen.in_segment[i] = InSegment(experiment.segments[i], seen.frame);
    }
    if (options.recorder != nullptr) options.recorder->AddFrame(seen.frame);
    if (keep) kept.push_back(seen);
    bool go_on = true;
    for (std::size_t e = 0; e < running.size(); ++e) {
      go_on = Advance(running[e], seen, frames.passed(e), options, result) && go_on;
    }
    ++result.frames;
    if (!go_on || std::ranges::all_of(running, &Running::ended)) return;
    if (options.progress) options.progress(result.frames, size);
    if (options.stop && options.stop()) {
      if (result.status != RunStatus::kOk) return;
      result.status = RunStatus::kStopped;
      result.code = ExitCode::kStopped;
      result.reason = "stopped after " + std::to_string(result.frames) + " frames";
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

/// The map at the end, with its metrics.
void NoteMap(Running& one, const Source& source) {
  if (!one.named.system.landmarks) return;
  one.result.landmarks = one.named.estimator->landmarks();
  one.result.metrics.merge(internal::MapMetrics(*one.result.landmarks, source));
}

/// The estimates of those that needed all frames.
void SmoothAll(std::vector<Running>& running, const std::vector<Seen>& kept,
               const RunOptions& options, RunResult& result) {
  for (Running& one : running) {
    Estimator& estimator = *one.named.estimator;
    if (one.ended || !estimator.offline()) continue;
    std::vector<Event> events;
    try {
      estimator.Smooth([&](std::size_t k, const State& state, const UpdateReport& report) {
        one.Take(kept[k], state, report, options.recorder);
        events = report.events;
      });
    } catch (const Error& e) {
      if (!estimator.failed()) throw;  // it is the record, say, that failed
      events.push_back({estimator.stamp(), "failed", e.what()});
    }
    one.Note(events);
    if (!estimator.failed()) continue;
    Fail(result, ExitCode::kDiverged,
         "estimator '" + one.named.name + "': " + Cause(events, "failed"));
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
  std::vector<Running> running;
  try {
    for (NamedEstimator& named : experiment.estimators) {
      running.push_back({named, static_cast<int>(running.size()),
                         Metrics(named, *experiment.source, experiment.segments), Begin(named)});
    }
    if (options.recorder != nullptr) options.recorder->Start(experiment);
    std::vector<Seen> kept;
    RunFrames(experiment, running, options, result, kept);
    SmoothAll(running, kept, options, result);
  } catch (...) {
    // What was done so far is kept.
    Failure failure = CaughtFailure();
    Fail(result, failure.code, std::move(failure.reason));
    if (failure.code == ExitCode::kStopped) result.status = RunStatus::kStopped;
  }
  for (Running& one : running) {
    Measure(one, result);
    one.result.counts = one.metrics.counts();
    one.result.units = one.metrics.units();
    NoteMap(one, *experiment.source);
    if (result.frames > 0) NoteUnused(one.named.system, one.result);
    one.Note(one.metrics.events());
    const Estimator& estimator = *one.named.estimator;
    one.result.diverged = one.diverged || (estimator.offline() && estimator.diverged()) ||
                          !one.metrics.events().empty();
    result.estimators.push_back(std::move(one.result));
  }
  return result;
}

}  // namespace alidade
