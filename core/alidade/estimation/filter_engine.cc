// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/filter_engine.h"

#include <algorithm>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/delayed_initialisation.h"

namespace alidade::internal {
namespace {

Event StaleEvent(const Frame& frame, Timestamp state) {
  return {frame.timestamp, EventKind::kStale,
          "the frame at " + SecondsText(frame.timestamp) + " is older than the state at " +
              SecondsText(state) +
              ": the measurements of this frame are not used; to use late frames, set "
              "`out_of_sequence: {policy: rollback, ...}`, or use alidade::Rollback in C++"};
}

/// Returns `options`. Throws Error kBadConfig if an option is out of range.
const EkfOptions& CheckedOptions(const EkfOptions& options) {
  ExpectOption(options.gate > 0.0 && options.gate <= 1.0, "gate", options.gate,
               "a probability in (0, 1]; 1 means no gate");
  ExpectOption(options.max_dt_s > 0.0, "max_dt_s", options.max_dt_s, "a time > 0 s");
  ExpectOption(options.rejection_recovery_after >= 1, "rejection_recovery_after",
               options.rejection_recovery_after, "at least 1");
  ExpectOption(options.rejection_recovery_after_s > 0.0, "rejection_recovery_after_s",
               options.rejection_recovery_after_s, "seconds > 0");
  ExpectOption(options.max_covariance_repairs >= 0, "max_covariance_repairs",
               options.max_covariance_repairs, "at least 0");
  return options;
}

}  // namespace

void ExpectOption(bool in_range, const char* option, double value, const char* expected) {
  if (in_range) return;
  throw Error(ExitCode::kBadConfig, std::string("option ") + option + " is " +
                                        RoundedText(value, 6) + "; expected " + expected);
}

FilterEngine::FilterEngine(Problem problem, const EkfOptions& options,
                           const std::vector<StreamInfo>& streams,
                           std::unique_ptr<UpdateMethod> equations)
    : f(std::make_shared<const ProblemIndex>(std::move(problem), streams),
        options.jacobian == JacobianPolicy::kFirstEstimate),
      method(std::move(equations)),
      options_(CheckedOptions(options)),
      time_(f.problem_index->problem, streams, options.max_dt_s),
      gate_(f.problem_index->problem, options),
      consensus_(f.problem_index->problem),
      recovery_(f.problem_index->problem, options) {
  if (f.problem_index->problem.landmarks) {
    landmarks.emplace(*f.problem_index);
    landmarks->AddKnown(f);
  }
  method->Begin(f);
}

void FilterEngine::Process(const Frame& frame) {
  f.report.Clear();
  Run(frame);
  if (time_.has_inputs()) time_.TakeInputs(frame, f.report);
  if (f.report.stale && !stale_reported_) f.report.events.push_back(StaleEvent(frame, f.timestamp));
  stale_reported_ = f.report.stale;
  for (Event& event : f.report.events) event.timestamp = frame.timestamp;
}

/// Processes a frame. The attribute flatten inlines the called functions, because most of them are
/// so small that a call would cost as much as their work. Large and rarely called functions are
/// marked `noinline`.
[[gnu::flatten]] void FilterEngine::Run(const Frame& frame) {
  if (landmarks) part_start_ = std::chrono::steady_clock::now();
  if (f.timestamp == kNoTimestamp) f.timestamp = time_.StartFor(frame);
  f.report.stale = frame.timestamp < f.timestamp;
  if (!f.report.stale && !f.health.ended) StepTo(frame.timestamp);
  AddElapsedTo(FramePart::kStep);
  const Outcome common_outcome = f.report.stale   ? Outcome::kStale
                                 : f.health.ended ? Outcome::kEnded
                                                  : Outcome::kAccepted;
  rows_.Collect(frame, *f.problem_index, f.report, common_outcome);
  if (common_outcome != Outcome::kAccepted) return;
  const std::span<PendingMeasurement> rows = rows_.all();
  for (const PendingMeasurement& pending : rows) {
    if (pending.report->outcome == Outcome::kFailed) ReportPluginFailure(f, pending);
  }
  if (f.blocks.has_missing) InitialiseWaiting(f, rows);
  if (landmarks) landmarks->Attach(f, rows);
  UpdateInGroups(rows);
  const auto is_not_pd = [](const PendingMeasurement& pending) {
    return pending.report->outcome == Outcome::kNotPd;
  };
  if (std::ranges::any_of(rows, is_not_pd)) recovery_.RepairCovariance(f, *method);
  if (f.health.ended) return;
  for (PendingMeasurement& pending : rows) {
    if (landmarks && pending.binding->model->has_landmark())
      continue;  // rejected landmarks do not cause a recovery
    recovery_.Count(f, pending, *method);
  }
  AddElapsedTo(FramePart::kUpdate);
  if (!landmarks) return;
  landmarks->Maintain(f, rows);
  AddElapsedTo(FramePart::kLandmarks);
}

/// Adds the time since the end of the previous part to the reported time of this part.
void FilterEngine::AddElapsedTo(FramePart part) {
  if (!landmarks) return;
  const auto now = std::chrono::steady_clock::now();
  f.report.spent_s[static_cast<std::size_t>(part)] +=
      std::chrono::duration<double>(now - part_start_).count();
  part_start_ = now;
}

/// Propagates the state to `timestamp`. If a step fails, the filter ends with the state before that
/// step.
void FilterEngine::StepTo(Timestamp timestamp) {
  while (f.timestamp < timestamp) {
    time_.UseInputs(f.timestamp, f.motions, f.report.events);
    Timeline::SubStep sub_step;
    StepError error = time_.NextSubStep(f.timestamp, timestamp, f.report.events, sub_step);
    for (Timestamp i = 1; i <= sub_step.steps && !error; ++i) {
      error = method->Step(f, sub_step.dt_s);
      if (error) break;
      f.motions.CountStep();
      f.timestamp = sub_step.EndOf(i);
    }
    if (error) return End(f, error.kind(), error.text());
  }
}

/// Performs the updates of a frame, group by group.
void FilterEngine::UpdateInGroups(std::span<PendingMeasurement> rows) {
  std::vector<PendingMeasurement*>& group = groups_.group;
  group.clear();
  const auto starts_group = [&](const PendingMeasurement& pending) {
    return options_.fuse == Fuse::kPerMeasurement ||
           (!group.empty() && group.back()->sensor != pending.sensor);
  };
  for (PendingMeasurement& pending : rows) {
    if (pending.report->outcome != Outcome::kAccepted) continue;
    if (options_.fuse != Fuse::kJoint && starts_group(pending)) {
      Update(group);
      group.clear();
    }
    group.push_back(&pending);
  }
  Update(group);
}

/// Performs one update with the measurements of a group that pass the gate.
void FilterEngine::Update(std::vector<PendingMeasurement*>& group) {
  PredictAndGate(group);
  if (landmarks && Consensus::IsEnabledFor(group)) {
    UpdateByConsensus(group);
  } else {
    Correct(group);
  }
}

/// Performs one update with the inliers. Then performs a second update with the remaining
/// measurements that pass the rescue gate.
[[gnu::noinline]] void FilterEngine::UpdateByConsensus(std::span<PendingMeasurement* const> group) {
  groups_.inliers.clear();
  groups_.remaining.clear();
  consensus_.Split(f, group, static_cast<std::uint64_t>(landmarks->frame()), groups_.inliers,
                   groups_.remaining);
  AddElapsedTo(FramePart::kGate);
  // Without an update by the inliers, the remaining measurements cannot be tested.
  if (!groups_.inliers.empty() && !Correct(groups_.inliers)) {
    for (PendingMeasurement* const pending : groups_.remaining) {
      pending->report->outcome = groups_.inliers.front()->report->outcome;
    }
    return;
  }
  PredictAndGate(groups_.remaining);
  std::erase_if(groups_.remaining, [&](const PendingMeasurement* pending) {
    if (consensus_.PassesRescueGate(*pending)) return false;
    pending->report->outcome = Outcome::kGated;
    return true;
  });
  if (Correct(groups_.remaining)) {
    f.report.landmarks.rescued += static_cast<int>(groups_.remaining.size());
  }
}

/// Predicts all measurements of a group at the current state. Removes measurements from the group
/// that have no valid prediction or do not pass the gate.
void FilterEngine::PredictAndGate(std::vector<PendingMeasurement*>& group) {
  int capacity = 0;
  for (PendingMeasurement* const pending : group) {
    pending->report->outcome = method->Predict(f, *pending);
    if (pending->report->outcome == Outcome::kAccepted) capacity += pending->report->dof;
  }
  AddElapsedTo(FramePart::kEvaluate);
  method->BeginUpdate(f, capacity);
  int columns = 0;
  auto passed = group.begin();
  for (PendingMeasurement* const pending : group) {
    Outcome& outcome = pending->report->outcome;
    if (outcome != Outcome::kAccepted) continue;
    pending->linearised.column = columns;
    outcome = gate_.Test(f, *pending, method->ComputeNis(f, *pending));
    if (outcome != Outcome::kAccepted) continue;
    *passed++ = pending;
    columns += pending->report->dof;
  }
  group.erase(passed, group.end());
  AddElapsedTo(FramePart::kGate);
}

/// Performs one update. If `rows` is empty or the update fails, returns false and leaves the state
/// unchanged.
bool FilterEngine::Correct(std::span<PendingMeasurement* const> rows) {
  if (rows.empty()) return false;
  gate_.ApplyRobustWeights(rows);
  const Outcome outcome = method->Correct(f, rows);
  AddElapsedTo(FramePart::kUpdate);
  if (outcome == Outcome::kNotPd) {
    AddEvent(f, EventKind::kNotPd,
             "the update was rolled back, because S or P would not be positive definite");
  } else if (outcome == Outcome::kNotFinite) {
    AddEvent(f, EventKind::kNotFinite, "the update was rolled back, because it is not finite");
  }
  if (outcome != Outcome::kAccepted) {
    for (const PendingMeasurement* const pending : rows) {
      if (pending->report->outcome == Outcome::kAccepted) pending->report->outcome = outcome;
    }
    return false;
  }
  f.motions.EndInterval();
  const PendingMeasurement& last = *rows.back();
  f.health.last_used.sensor = last.sensor;
  f.health.last_used.timestamp = last.measurement->timestamp;
  std::vector<double>& z = f.health.last_used.z;
  z.resize(last.report->z.size());
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = last.z[i];
  return true;
}

std::optional<Prediction> FilterEngine::Expect(int sensor, std::int64_t landmark,
                                               const std::vector<double>& known) {
  if (f.health.ended || f.report.stale) return std::nullopt;
  Measurement measurement;
  measurement.landmark = landmark;
  measurement.known = known;
  const Geometry& geometry = f.problem_index->problem.sensors[static_cast<std::size_t>(sensor)]
                                 .model->measurement()
                                 .geometry;
  measurement.values = geometry.Identity();
  PendingMeasurement& pending = rows_.CollectOne(measurement, sensor, *f.problem_index, f.report);
  if (landmarks) landmarks->Attach(f, {&pending, 1});
  if (pending.report->outcome != Outcome::kAccepted || !IsReady(f, pending) ||
      PredictAt(f, pending, f.state.values(), measurement.values.data()) != Outcome::kAccepted) {
    return std::nullopt;
  }
  std::ranges::copy(measurement.values, pending.z);  // the innovation is then zero
  if (method->Predict(f, pending) != Outcome::kAccepted) return std::nullopt;
  const int m = pending.report->dof;
  method->BeginUpdate(f, m);
  pending.linearised.column = 0;
  const Outcome outcome = gate_.Test(f, pending, method->ComputeNis(f, pending));
  // In the Ukf the outcome can be kGated: z is h at the estimate, which can be far from the mean of
  // h over the sigma points.
  if (outcome != Outcome::kAccepted && outcome != Outcome::kGated) return std::nullopt;
  return Prediction{{pending.report->h.begin(), pending.report->h.end()},
                    Eigen::Map<const RowMajor>(pending.s, m, m)};
}

}  // namespace alidade::internal
