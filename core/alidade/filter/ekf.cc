// SPDX-License-Identifier: Apache-2.0
#include "alidade/filter/ekf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "alidade/base/number_text.h"
#include "alidade/base/statistics.h"
#include "alidade/filter/ekf_landmarks.h"
#include "alidade/filter/ekf_small.h"
#include "alidade/filter/ekf_snapshot.h"
#include "alidade/state/small_kernels.h"

namespace alidade {
namespace {

/// Six significant digits.
std::string Rounded(double value) { return internal::RoundedText(value, 6); }

}  // namespace

Ekf::~Ekf() = default;

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams)
    : Ekf(std::move(system), options, streams, Steps::kOwn) {}

Ekf::Ekf(System system, const EkfOptions& options, const std::vector<StreamInfo>& streams,
         Steps steps)
    : system_(std::move(system)),
      options_(options),
      stream_of_sensor_(system_.sensors.size(), -1),
      state_(system_.InitialState(true)),
      steps_(steps),
      inputs_(system_, streams),
      rejections_(system_.sensors.size(), 0),
      out_of_domain_(system_.sensors.size(), false),
      inflated_(system_.sensors.size(), false),
      warned_(system_.sensors.size(), false) {
  for (const SensorBinding& sensor : system_.sensors) {
    gate_threshold_.push_back(
        options_.gate < 1.0
            ? ChiSquareQuantile(options_.gate, sensor.model.measurement().geometry.tangent)
            : std::numeric_limits<double>::infinity());
  }
  for (std::size_t i = 0; i < system_.sensors.size(); ++i) {
    for (std::size_t s = 0; s < streams.size(); ++s) {
      if (streams[s].name != system_.sensors[i].stream) continue;
      ALIDADE_EXPECTS(streams[s].size == system_.sensors[i].model.measurement().geometry.ambient);
      stream_of_sensor_[i] = static_cast<int>(s);
    }
  }
  if (system_.landmarks) {
    landmarks_ = std::make_unique<Landmarks>(*this);
    landmarks_->AddKnown();
  }
  Bind();
}

std::vector<LandmarkEstimate> Ekf::landmarks() const {
  return landmarks_ == nullptr ? std::vector<LandmarkEstimate>() : landmarks_->Estimates();
}

void Ekf::Start(Timestamp timestamp) { timestamp_ = timestamp; }

std::unique_ptr<Estimator::Snapshot> Ekf::Save() const { return std::make_unique<Kept>(*this); }

void Ekf::Restore(const Snapshot& snapshot) {
  const auto& kept = dynamic_cast<const Kept&>(snapshot);
  state_ = kept.state;
  Kept::Members(*this) = kept.values;
  if (landmarks_ != nullptr) landmarks_->Restore(kept.landmarks);
  Bind();
  kept.RestoreInterval(*this);
}

const UpdateReport& Ekf::Process(const Frame& frame) {
  report_.Clear();
  if (small_ == nullptr || !small_->Process(frame)) ProcessFully(frame);
  if (!inputs_.empty()) inputs_.Take(frame, report_);
  return report_;
}

/// The step and the updates of a frame on the general path.
void Ekf::ProcessFully(const Frame& frame) {
  if (timestamp_ == kNoTimestamp) {
    Start(system_.initial_time_s ? TimestampFromSeconds(*system_.initial_time_s) : frame.timestamp);
  }
  report_.stale = frame.timestamp < timestamp_;
  if (!report_.stale && !failed_) StepTo(frame.timestamp);
  for (Event& event : report_.events)
    event.timestamp = frame.timestamp;  // also where it stays behind
  Collect(frame);
  if (report_.stale || failed_) {
    for (MeasurementReport& entry : report_.measurements()) {
      entry.outcome = report_.stale ? Outcome::kStale : Outcome::kFailed;
    }
    return;
  }
  if (waiting_) InitialiseFromMeasurements();
  if (landmarks_ != nullptr) landmarks_->PlanRows();
  group_.clear();
  for (Row& row : rows()) {
    if (EntryOf(row).outcome != Outcome::kAccepted) continue;
    const bool apart = options_.fuse == Fuse::kPerMeasurement ||
                       (options_.fuse == Fuse::kPerSensor && !group_.empty() &&
                        group_.back()->sensor != row.sensor);
    if (apart) {
      Fuse(group_);
      group_.clear();
    }
    group_.push_back(&row);
  }
  Fuse(group_);
  RepairCovariance();
  CountRejections();
  if (landmarks_ != nullptr) landmarks_->Finish();
}

/// One row for each measurement and sensor bound to its stream, in the order of the sensors.
void Ekf::Collect(const Frame& frame) {
  row_count_ = 0;
  report_.ClearMeasurements();
  for (int sensor = 0; sensor < std::ssize(system_.sensors); ++sensor) {
    const SensorBinding& binding = system_.sensors[static_cast<std::size_t>(sensor)];
    const Geometry& geometry = binding.model.measurement().geometry;
    for (const Measurement& m : frame.measurements) {
      if (m.stream != stream_of_sensor_[static_cast<std::size_t>(sensor)]) continue;
      ALIDADE_EXPECTS(std::ssize(m.values) == geometry.ambient);
      ALIDADE_EXPECTS(m.covariance.empty() ||
                      std::ssize(m.covariance) == geometry.tangent * geometry.tangent);
      if (row_count_ == rows_.size()) rows_.emplace_back();
      Row& row = rows_[row_count_];
      row.measurement = &m;
      row.sensor = sensor;
      row.report = row_count_++;
      MeasurementReport& entry = report_.Add();
      entry.Reset(sensor, m.landmark, geometry.tangent);
      entry.z.assign(m.values.begin(), m.values.end());
      entry.outcome =
          AllFinite(entry.z) ? OutcomeOf(binding.model.Valid(entry.z.data())) : Outcome::kNotFinite;
      if (entry.outcome == Outcome::kFailed) NotePluginFailure(binding);
    }
  }
}

/// Moves the state to `timestamp`, piece by piece where a control input stops acting on the way.
void Ekf::StepTo(Timestamp timestamp) {
  while (timestamp_ < timestamp) {
    if (!inputs_.empty()) UseInputs();
    if (!StepEvenly(inputs_.StepEnd(timestamp_, timestamp))) return;
  }
}

/// The control inputs from here on, for the models that move.
void Ekf::UseInputs() {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (motions_[i].active) motions_[i].u = inputs_.Use(i, timestamp_, report_.events);
  }
}

/// Moves the state to `end`, in equal parts of at most max_dt_s. Where a part cannot be done the
/// state stays at the end of the one before, and the filter has given up.
bool Ekf::StepEvenly(Timestamp end) {
  constexpr Timestamp kMostParts = 1'000'000;
  Timestamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(end, timestamp_, &elapsed);
  const Timestamp count = overflow ? 0 : StepParts(elapsed, options_.max_dt_s);
  if (overflow || count > kMostParts) {
    GiveUp("too_many_substeps", "a gap of " + Rounded(Seconds(end) - Seconds(timestamp_)) +
                                    " s would need more than " +
                                    Rounded(static_cast<double>(kMostParts)) + " steps of " +
                                    Rounded(options_.max_dt_s) + " s");
    return false;
  }
  if (count >= 2 * most_parts_) {
    Note("substeps", "a gap of " + Rounded(Seconds(elapsed)) +
                         " s, longer than max_dt_s = " + Rounded(options_.max_dt_s) +
                         ", is stepped in " + std::to_string(count) + " equal parts");
    most_parts_ = count;
  }
  const Timestamp start = timestamp_;
  for (Timestamp i = 1; i <= count; ++i) {
    if (!StepOnce(Seconds(elapsed) / static_cast<double>(count))) return false;
    ++interval_steps_;
    timestamp_ = i == count ? end : start + elapsed / count * i;
  }
  return true;
}

/// One step of all motion models: all of it happens or nothing.
bool Ekf::StepOnce(double dt_s) {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (motions_[i].active && !StepModel(system_.motions[i], motions_[i], dt_s)) return false;
  }
  if (!Propagate()) {
    GiveUp("not_finite", "the covariance steps to what is not finite");
    return false;
  }
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    if (!motions_[i].active) continue;
    for (const BlockId id : system_.motions[i].blocks) {
      const Block& block = state_.layout()[id];
      if (block.status == BlockStatus::kConstant) continue;
      const Geometry& geometry = block.geometry();
      std::copy_n(next_.data() + block.value_offset, geometry.ambient, state_.value(id));
      if (geometry.kind != GeometryKind::kVector) geometry.Normalise(state_.value(id));
    }
  }
  return true;
}

/// Whether no F P F' + Q of this step can overflow, by |F P F'|_ij <= (n max|F|)^2 max|P|.
bool Ekf::StepIsBounded() const {
  constexpr double kSafe = 1e300;
  double f = 1.0, q = 0.0, p = 0.0;
  for (const MotionPlan& plan : motions_) {
    if (!plan.active) continue;
    for (const double value : plan.f) f = std::max(f, std::abs(value));
    for (const double value : plan.q) q = std::max(q, std::abs(value));
  }
  const int n = state_.covariance().size();
  for (int i = 0; i < n; ++i) p = std::max(p, state_.covariance().Variance(i));
  const double sum = f * n;
  return sum * sum * p + q <= kSafe;
}

/// P <- F P F' + G Q G' with what StepModel found; false, and P as it was, where it is not finite.
bool Ekf::Propagate() {
  Covariance& p = state_.covariance();
  if (StepIsBounded()) {
    PropagateModels();
    return true;
  }
  const Covariance before = p;
  PropagateModels();
  if (p.Dense().allFinite()) return true;
  p = before;
  return false;
}

void Ekf::PropagateModels() {
  Covariance& p = state_.covariance();
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const MotionPlan& plan = motions_[i];
    if (!plan.active || plan.segments.empty()) continue;
    if (plan.rows.empty() && plan.segments.size() == 1) {
      p.Propagate(plan.segments[0].first, plan.segments[0].second, plan.f.data(), plan.q.data());
      continue;
    }
    const Eigen::Index n = system_.motions[i].model.tangent_size();
    const Eigen::Map<const RowMajor> f(plan.f.data(), n, n), q(plan.q.data(), n, n);
    if (plan.rows.empty()) {
      p.Propagate(plan.segments, f, q);
    } else {
      p.Propagate(plan.segments, f(plan.rows, plan.rows), q(plan.rows, plan.rows));
    }
  }
}

/// What one motion model makes of its blocks: next_, L, and with `derivatives` F and G Q G' of the
/// plan. False where the filter cannot go on.
bool Ekf::StepModel(const MotionBinding& motion, MotionPlan& plan, double dt_s, bool derivatives) {
  const double unwritten = std::nan("");
  const bool goes_on = plan.holds && InInterval();
  if (goes_on && interval_steps_ == 1) plan.m = plan.gl;
  std::ranges::fill(plan.f, unwritten);
  std::ranges::fill(plan.g, unwritten);
  if (!goes_on) std::ranges::fill(plan.l, unwritten);
  for (std::size_t i = 0; i < motion.blocks.size(); ++i) {
    std::fill_n(plan.next[i], state_.layout()[motion.blocks[i]].geometry().ambient, unwritten);
  }
  Status status = motion.model.Step(plan.x.data(), plan.u, nullptr, dt_s, plan.next.data(),
                                    derivatives ? plan.f.data() : nullptr,
                                    derivatives ? plan.g.data() : nullptr);
  if (status == Status::kOk && !goes_on) {
    status = motion.model.SqrtQ(plan.x.data(), dt_s, plan.l.data());
  }
  if (status != Status::kOk) {
    GiveUp(status == Status::kError ? "plugin_failed" : "diverged",
           "motion model of '" + motion.name + "' cannot step: " +
               (status == Status::kError ? motion.model.error_text() : "out of its domain"));
    return false;
  }
  bool finite = AllFinite(plan.l);
  if (derivatives) {
    internal::SpreadNoise(plan.g.data(), plan.l.data(), motion.model.tangent_size(),
                          motion.model.noise_size(), plan.gl.data(), plan.q.data());
    if (goes_on) {
      CarryHeld(motion.model, plan);
    } else if (plan.holds) {
      plan.m = plan.gl;
    }
    finite = finite && AllFinite(plan.f) && AllFinite(plan.q);
  }
  for (std::size_t i = 0; i < motion.blocks.size(); ++i) {
    const auto size =
        static_cast<std::size_t>(state_.layout()[motion.blocks[i]].geometry().ambient);
    finite = finite && AllFinite({plan.next[i], size});
  }
  if (!finite) {
    GiveUp("not_finite",
           "motion model of '" + motion.name + "' steps to a state that is not finite");
  }
  return finite;
}

/// With A = F M and N = G Lq: q <- N N' + A N' + N A' (its lower triangle), M <- A + N. Blocks
/// without a covariance have no M.
void Ekf::CarryHeld(const MotionModel& model, MotionPlan& plan) {
  const Workspace::Use use(work_);
  const Eigen::Index n = model.tangent_size(), w = model.noise_size();
  const Eigen::Map<const RowMajor> f(plan.f.data(), n, n), input(plan.gl.data(), n, w);
  Eigen::Map<RowMajor> m(plan.m.data(), n, w), q(plan.q.data(), n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (plan.at[static_cast<std::size_t>(i)] < 0) m.row(i).setZero();
  }
  Workspace::Matrix moved = work_.Take(n, w), both = work_.Take(n, n);
  moved.noalias() = f * m;
  both.noalias() = moved * input.transpose();
  q.triangularView<Eigen::Lower>() += both;
  q.triangularView<Eigen::Lower>() += both.transpose();
  m = moved + input;
}

void Ekf::NotePluginFailure(const SensorBinding& sensor) {
  Note("plugin_failed", "sensor '" + sensor.name + "': " + sensor.model.error_text());
}

Event& Ekf::Note(const char* kind, std::string text) {
  report_.events.push_back({timestamp_, kind, std::move(text)});
  return report_.events.back();
}

/// An event by which the filter counts as diverged.
void Ekf::NoteDivergence(const char* kind, std::string text) {
  diverged_ = true;
  Note(kind, std::move(text)).divergence = true;
}

/// `block = value, ...` for the given blocks that have one.
std::string Ekf::Describe(const std::vector<BlockId>& blocks) const {
  std::string text;
  for (const BlockId id : blocks) {
    if (id < 0 || !state_.layout()[id].present) continue;
    const Block& block = state_.layout()[id];
    text += (text.empty() ? "" : ", ") + block.name + " =";
    for (int i = 0; i < block.geometry().ambient; ++i) {
      text += ' ' + internal::RoundedText(state_.value(id)[i], 6);
    }
  }
  return text;
}

/// Ends the filter: what happened, the state that is left, the measurement that led there.
void Ekf::GiveUp(const char* kind, const std::string& what) {
  failed_ = true;
  std::vector<BlockId> all(system_.layout.blocks().size());
  std::iota(all.begin(), all.end(), 0);
  std::string text =
      what + "; last good state at " + internal::SecondsText(timestamp_) + ": " + Describe(all);
  if (last_used_.sensor >= 0) {
    text += "; last measurement used: sensor '" +
            system_.sensors[static_cast<std::size_t>(last_used_.sensor)].name + "' at " +
            internal::SecondsText(last_used_.timestamp) + ", z =";
    for (const double z : last_used_.z) text += ' ' + internal::RoundedText(z, 6);
  }
  NoteDivergence(kind, text);
}

}  // namespace alidade
