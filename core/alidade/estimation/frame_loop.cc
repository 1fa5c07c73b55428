// SPDX-License-Identifier: Apache-2.0
#include "alidade/estimation/frame_loop.h"

#include <algorithm>
#include <utility>

#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/first_values.h"

namespace alidade::internal {
namespace {

Event StaleEvent(const Frame& frame, Timestamp state) {
  return {frame.timestamp, "stale",
          "the frame at " + SecondsText(frame.timestamp) + " is older than the state at " +
              SecondsText(state) +
              ": its measurements are not used; if it came late, set `out_of_sequence: {policy: "
              "rollback, ...}` or, in C++, process frames by alidade::Rollback"};
}

/// The options. Error kBadConfig if one is out of its range.
const EkfOptions& CheckedOptions(const EkfOptions& options) {
  ExpectOption(options.gate > 0.0 && options.gate <= 1.0, "gate", options.gate,
               "a probability in (0, 1], 1: no gate");
  ExpectOption(options.max_dt_s > 0.0, "max_dt_s", options.max_dt_s, "seconds > 0");
  ExpectOption(options.rejection_recovery_after >= 1, "rejection_recovery_after",
               options.rejection_recovery_after, "at least 1");
  ExpectOption(options.max_covariance_repairs >= 0, "max_covariance_repairs",
               options.max_covariance_repairs, "at least 0");
  return options;
}

}  // namespace

void ExpectOption(bool holds, const char* option, double value, const char* expected) {
  if (holds) return;
  throw Error(ExitCode::kBadConfig, std::string("option ") + option + " is " +
                                        RoundedText(value, 6) + "; expected " + expected);
}

FrameLoop::FrameLoop(System system, const EkfOptions& options,
                     const std::vector<StreamInfo>& streams, std::unique_ptr<Method> equations)
    : f(std::make_shared<const Binding>(std::move(system), streams),
        options.jacobian == JacobianPolicy::kFirstEstimate),
      method(std::move(equations)),
      options_(CheckedOptions(options)),
      time_(f.binding->system, streams, options.max_dt_s),
      gate_(f.binding->system, options),
      consensus_(f.binding->system),
      recovery_(options) {
  if (f.binding->system.landmarks) {
    landmarks.emplace(*f.binding);
    landmarks->AddKnown(f);
  }
  method->Begin(f);
}

void FrameLoop::Process(const Frame& frame) {
  f.report.Clear();
  Run(frame);
  if (time_.has_inputs()) time_.TakeInputs(frame, f.report);
  if (f.report.stale && !stale_noted_) f.report.events.push_back(StaleEvent(frame, f.timestamp));
  stale_noted_ = f.report.stale;
  for (Event& event : f.report.events) event.timestamp = frame.timestamp;
}

/// The way of a frame. Flattened: its parts are small, and a call of each would cost as much. Large
/// and rarely called functions are marked `noinline`.
[[gnu::flatten]] void FrameLoop::Run(const Frame& frame) {
  if (landmarks) since_ = std::chrono::steady_clock::now();
  if (f.timestamp == kNoTimestamp) f.timestamp = time_.StartFor(frame);
  f.report.stale = frame.timestamp < f.timestamp;
  if (!f.report.stale && !f.health.ended) StepTo(frame.timestamp);
  Spent(FramePart::kStep);
  const Outcome refused = f.report.stale   ? Outcome::kStale
                          : f.health.ended ? Outcome::kEnded
                                           : Outcome::kAccepted;
  rows_.Collect(frame, *f.binding, f.report, refused);
  if (refused != Outcome::kAccepted) return;
  const std::span<Row> all = rows_.all();
  for (const Row& row : all) {
    if (row.report->outcome == Outcome::kFailed) NotePluginFailure(f, row);
  }
  if (f.blocks.waiting) InitialiseWaiting(f, all);
  if (landmarks) landmarks->Attach(f, all);
  UpdateInGroups(all);
  const auto is_not_pd = [](const Row& row) { return row.report->outcome == Outcome::kNotPd; };
  if (std::ranges::any_of(all, is_not_pd)) recovery_.RepairCovariance(f);
  if (f.health.ended) return;
  for (Row& row : all) {
    if (landmarks && row.binding->model->has_landmark()) continue;  // its rejections do not count
    if (gate_.Count(f, *row.report)) recovery_.Recover(f, row);
  }
  Spent(FramePart::kUpdate);
  if (!landmarks) return;
  landmarks->Maintain(f, all);
  Spent(FramePart::kLandmarks);
}

/// The time since the last part goes to this one, in the report.
void FrameLoop::Spent(FramePart part) {
  if (!landmarks) return;
  const auto now = std::chrono::steady_clock::now();
  f.report.spent_s[static_cast<std::size_t>(part)] +=
      std::chrono::duration<double>(now - since_).count();
  since_ = now;
}

/// Moves the state to `timestamp`; where a step cannot be done it stays at the end of the one
/// before, and the filter has ended.
void FrameLoop::StepTo(Timestamp timestamp) {
  while (f.timestamp < timestamp) {
    time_.UseInputs(f.timestamp, f.motions, f.report.events);
    Timeline::Piece piece;
    Trouble trouble = time_.First(f.timestamp, timestamp, f.report.events, piece);
    for (Timestamp i = 1; i <= piece.steps && !trouble; ++i) {
      trouble = method->Step(f, piece.dt_s);
      if (trouble) break;
      f.motions.CountStep();
      f.timestamp = piece.EndOf(i);
    }
    if (trouble) return End(f, trouble.kind(), trouble.text());
  }
}

/// The updates of a frame, group by group.
void FrameLoop::UpdateInGroups(std::span<Row> all) {
  std::vector<Row*>& group = groups_.group;
  group.clear();
  const auto is_apart = [&](const Row& row) {
    return options_.fuse == Fuse::kPerMeasurement ||
           (!group.empty() && group.back()->sensor != row.sensor);
  };
  for (Row& row : all) {
    if (row.report->outcome != Outcome::kAccepted) continue;
    if (options_.fuse != Fuse::kJoint && is_apart(row)) {
      Update(group);
      group.clear();
    }
    group.push_back(&row);
  }
  Update(group);
}

/// One update by those of a group that pass.
void FrameLoop::Update(std::vector<Row*>& group) {
  PredictAndGate(group);
  if (landmarks && Consensus::IsAsked(group)) {
    UpdateByConsensus(group);
  } else {
    Correct(group);
  }
}

/// One update by those that agree, and a second one by those that it rescues.
[[gnu::noinline]] void FrameLoop::UpdateByConsensus(std::span<Row* const> group) {
  groups_.agreed.clear();
  groups_.rest.clear();
  consensus_.Split(f, group, static_cast<std::uint64_t>(landmarks->frame()), groups_.agreed,
                   groups_.rest);
  Spent(FramePart::kGate);
  if (!groups_.agreed.empty() && !Correct(groups_.agreed)) {  // what would the rest agree with?
    for (Row* const row : groups_.rest) {
      row->report->outcome = groups_.agreed.front()->report->outcome;
    }
    return;
  }
  PredictAndGate(groups_.rest);
  std::erase_if(groups_.rest, [&](const Row* row) {
    if (consensus_.Rescues(*row)) return false;
    row->report->outcome = Outcome::kGated;
    return true;
  });
  if (Correct(groups_.rest)) {
    f.report.landmarks.rescued += static_cast<int>(groups_.rest.size());
  }
}

/// Predicts all rows of a group at the state, and leaves those that pass the gate, each by itself.
void FrameLoop::PredictAndGate(std::vector<Row*>& group) {
  int capacity = 0;
  for (Row* const row : group) {
    row->report->outcome = method->Predict(f, *row);
    if (row->report->outcome == Outcome::kAccepted) capacity += row->report->dof;
  }
  Spent(FramePart::kEvaluate);
  method->BeginUpdate(f, capacity);
  int columns = 0;
  auto passed = group.begin();
  for (Row* const row : group) {
    Outcome& outcome = row->report->outcome;
    if (outcome != Outcome::kAccepted) continue;
    row->linearised.column = columns;
    outcome = gate_.Test(f, *row, method->ComputeNis(f, *row));
    if (outcome != Outcome::kAccepted) continue;
    *passed++ = row;
    columns += row->report->dof;
  }
  group.erase(passed, group.end());
  Spent(FramePart::kGate);
}

/// False where there is no update.
bool FrameLoop::Correct(std::span<Row* const> rows) {
  if (rows.empty()) return false;
  gate_.ApplyRobustWeights(rows);
  const Outcome outcome = method->Correct(f, rows);
  Spent(FramePart::kUpdate);
  if (outcome == Outcome::kNotPd) {
    Note(f, "not_pd", "the update would leave S or P not positive definite; rolled back");
  } else if (outcome == Outcome::kNotFinite) {
    Note(f, "not_finite", "the update is not finite; rolled back");
  }
  if (outcome != Outcome::kAccepted) {
    for (const Row* const row : rows) {
      if (row->report->outcome == Outcome::kAccepted) row->report->outcome = outcome;
    }
    return false;
  }
  f.motions.EndInterval();
  const Row& last = *rows.back();
  f.health.last_used.sensor = last.sensor;
  f.health.last_used.timestamp = last.measurement->timestamp;
  std::vector<double>& z = f.health.last_used.z;
  z.resize(last.report->z.size());
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = last.z[i];
  return true;
}

std::optional<Prediction> FrameLoop::Expect(int sensor, std::int64_t landmark,
                                            const std::vector<double>& known) {
  if (f.health.ended || f.report.stale) return std::nullopt;
  Measurement one;
  one.landmark = landmark;
  one.known = known;
  const Geometry& geometry =
      f.binding->system.sensors[static_cast<std::size_t>(sensor)].model->measurement().geometry;
  one.values.resize(static_cast<std::size_t>(geometry.ambient));
  geometry.Identity(one.values.data());
  Row& row = rows_.CollectOne(one, sensor, *f.binding, f.report);
  if (landmarks) landmarks->Attach(f, {&row, 1});
  if (row.report->outcome != Outcome::kAccepted || !IsReady(f, row) ||
      PredictAt(f, row, f.state.values(), one.values.data()) != Outcome::kAccepted) {
    return std::nullopt;
  }
  std::ranges::copy(one.values, row.z);  // as if it measured what it expects
  if (method->Predict(f, row) != Outcome::kAccepted) return std::nullopt;
  const int m = row.report->dof;
  method->BeginUpdate(f, m);
  row.linearised.column = 0;
  const Outcome outcome = gate_.Test(f, row, method->ComputeNis(f, row));
  // Gated: h at the estimate lies far from its mean.
  if (outcome != Outcome::kAccepted && outcome != Outcome::kGated) return std::nullopt;
  return Prediction{{row.report->h.begin(), row.report->h.end()},
                    Eigen::Map<const RowMajor>(row.s, m, m)};
}

}  // namespace alidade::internal
