// SPDX-License-Identifier: Apache-2.0
#include "condensed_run.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "alidade/base/number_text.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kMostInputs = 4000;  // the dense Jacobian of as many rows takes 128 MB

/// L with P = L L', for P positive semidefinite.
Eigen::MatrixXd SquareRoot(const Eigen::MatrixXd& p) {
  if (p.size() == 0) return p;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(p);
  const Eigen::VectorXd d = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
  return ldlt.transpositionsP().transpose() * (Eigen::MatrixXd(ldlt.matrixL()) * d.asDiagonal());
}

}  // namespace

CondensedRun::CondensedRun(System system, const std::vector<StreamInfo>& streams, double max_dt_s)
    : system_(std::move(system)),
      max_dt_s_(max_dt_s),
      initial_(system_.InitialState()),
      controls_(system_, streams) {
  for (const SensorBinding& sensor : system_.sensors) {
    const auto found = std::ranges::find(streams, sensor.stream, &StreamInfo::name);
    stream_of_sensor_.push_back(found == streams.end() ? -1
                                                       : static_cast<int>(found - streams.begin()));
  }
  l0_ = SquareRoot(initial_.covariance().Dense());
  d0_ = Eigen::VectorXd::Zero(l0_.rows());
  inputs_ = static_cast<int>(l0_.cols());
  for (const Block& block : initial_.layout().blocks()) present_.push_back(block.present);
  for (std::size_t i = 0; i < present_.size(); ++i) {
    if (present_[i]) continue;
    const BlockId id = static_cast<BlockId>(i);
    const Geometry geometry = initial_.layout()[id].geometry();
    std::vector<double> value(static_cast<std::size_t>(geometry.ambient));
    geometry.Identity(value.data());
    initial_.Add(id, value.data(), Eigen::MatrixXd::Zero(geometry.tangent, geometry.tangent));
  }
  has_unit_vector_ = std::ranges::any_of(initial_.layout().blocks(), [](const Block& block) {
    return block.has_covariance() && block.geometry().kind == GeometryKind::kUnitVector;
  });
  held_.assign(system_.motions.size(), -1);
  held_l_.resize(system_.motions.size());
  if (has_landmarks()) AddKnown();
}

bool CondensedRun::Holds(std::size_t motion) const {
  const MotionModel& model = system_.motions[motion].model;
  return model.discrete_noise() && !model.stationary() && model.noise_size() > 0;
}

bool CondensedRun::Fail(std::string why) const {
  problem_ = std::move(why);
  return false;
}

bool CondensedRun::FailTooMany() const {
  return Fail("more than " + std::to_string(kMostInputs) +
              " noise inputs: the batch solves for all of them at once; a shorter series, or a "
              "longer time between frames, has fewer");
}

bool CondensedRun::AllPresent(const std::vector<BlockId>& blocks) const {
  return std::ranges::all_of(
      blocks, [&](BlockId id) { return id < 0 || present_[static_cast<std::size_t>(id)]; });
}

std::vector<double> CondensedRun::ValuesOf(const State& state) const {
  std::vector<double> values = initial_.values();
  for (std::size_t i = 0; i < present_.size(); ++i) {
    const BlockId id = static_cast<BlockId>(i);
    if (!state.layout()[id].present) continue;
    const Block& block = initial_.layout()[id];
    std::copy_n(state.value(id), block.geometry().ambient, values.data() + block.value_offset);
  }
  return values;
}

bool CondensedRun::Add(const Frame& frame, const UpdateReport& report, const Estimator& filter) {
  if (timestamp_ == kNoTimestamp) {
    timestamp_ =
        system_.initial_time_s ? TimestampFromSeconds(*system_.initial_time_s) : frame.timestamp;
  }
  Epoch epoch;
  epoch.steps.swap(passed_on_);
  epoch.stale = frame.timestamp < timestamp_;
  const int inputs = inputs_;
  if (!epochs_.empty()) epoch.column = inputs;
  for (Timestamp from = timestamp_; from < frame.timestamp;) {
    const Timestamp end = controls_.StepEnd(from, frame.timestamp);
    if (!AddSteps(from, end, epoch)) {
      inputs_ = inputs;
      return false;
    }
    from = end;
  }
  if (!epoch.stale) timestamp_ = frame.timestamp;
  UpdateReport taken;
  controls_.Take(frame, taken);
  epoch.inputs = std::move(taken.inputs);
  AddFactors(frame, report, epoch);
  if (has_landmarks()) AddLandmarks(report, filter, epoch);
  EndInterval(epoch);
  epochs_.push_back(std::move(epoch));
  return inputs_ <= kMostInputs || FailTooMany();
}

/// Noise is held no longer where the frame has a measurement in use, as in a filter.
void CondensedRun::EndInterval(Epoch& epoch) {
  const auto in_use = [](const Factor& f) { return f.row >= 0 || f.landmark >= 0; };
  if (!epoch.first_values.empty() || std::ranges::any_of(epoch.factors, in_use)) {
    std::ranges::fill(held_, -1);
  }
  epoch.ends = std::ranges::all_of(held_, [](int column) { return column < 0; });
}

/// The steps of all models from `from` to `end`, over which the control inputs are constant.
bool CondensedRun::AddSteps(Timestamp from, Timestamp end, Epoch& epoch) {
  Timestamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(end, from, &elapsed);
  const Timestamp parts = overflow ? 0 : StepParts(elapsed, max_dt_s_);
  if (overflow || parts > kMostInputs) {
    return Fail("a gap before " + internal::SecondsText(end) + " needs more than " +
                std::to_string(kMostInputs) + " steps of max_dt_s");
  }
  std::vector<Event> events;  // which the filter tells
  for (Timestamp part = 0; part < parts; ++part) {
    for (std::size_t i = 0; i < system_.motions.size(); ++i) {
      const MotionBinding& motion = system_.motions[i];
      if (motion.model.stationary() || !AllPresent(motion.blocks)) continue;
      const std::span<const double> u = controls_.Use(i, from, events);
      Step& step = epoch.steps.emplace_back();
      step.motion = i;
      step.dt_s = Seconds(elapsed) / static_cast<double>(parts);
      step.begins = held_[i] < 0;
      step.column = step.begins ? inputs_ : held_[i];
      step.columns = inputs_;
      step.u.assign(u.begin(), u.end());
      if (step.begins) inputs_ += motion.model.noise_size();
      if (Holds(i)) held_[i] = step.column;
    }
    if (inputs_ > kMostInputs) return FailTooMany();
  }
  return true;
}

/// One factor for each measurement and sensor bound to its stream, in the order of the sensors.
void CondensedRun::AddFactors(const Frame& frame, const UpdateReport& report, Epoch& epoch) {
  for (std::size_t i = 0; i < system_.sensors.size(); ++i) {
    const SensorModel& model = system_.sensors[i].model;
    for (const Measurement& m : frame.measurements) {
      if (m.stream != stream_of_sensor_[i]) continue;
      ALIDADE_EXPECTS(std::ssize(m.values) == model.measurement().geometry.ambient);
      Factor factor{static_cast<int>(i), m, Outcome::kStale, -1, -1, {}};
      if (!epoch.stale) {
        factor.outcome =
            AllFinite(m.values) ? OutcomeOf(model.Valid(m.values.data())) : Outcome::kNotFinite;
      }
      const std::size_t index = epoch.factors.size();  // the filter has the same order
      const bool first = index < report.measurements().size() &&
                         report.measurements()[index].outcome == Outcome::kInitialised;
      if (first) factor.outcome = Outcome::kInitialised;
      epoch.factors.push_back(std::move(factor));
    }
  }
  AddFirstValues(epoch);
  for (Factor& factor : epoch.factors) {
    const SensorBinding& sensor = SensorOf(factor);
    if (factor.outcome != Outcome::kAccepted || ObservesLandmarks(sensor)) continue;
    if (!std::ranges::all_of(sensor.roles,
                             [&](const RoleBinding& role) { return AllPresent({role.block}); })) {
      factor.outcome = Outcome::kNotReady;
      continue;
    }
    factor.row = residuals_;
    AddPart(sensor.model.measurement().geometry.tangent, sensor.loss);
  }
}

void CondensedRun::AddPart(int size, const RobustLoss& loss) {
  const bool plain = loss.kind == LossKind::kNone;
  if (plain && !parts_.empty() && parts_.back().loss.kind == LossKind::kNone) {
    parts_.back().size += size;
  } else {
    parts_.push_back({residuals_, size, loss});
  }
  residuals_ += size;
}

/// First values in an order in which each finds the blocks that it needs.
void CondensedRun::AddFirstValues(Epoch& epoch) {
  for (bool progress = true; progress;) {
    progress = false;
    for (std::size_t i = 0; i < epoch.factors.size(); ++i) {
      const SensorBinding& sensor = SensorOf(epoch.factors[i]);
      if (epoch.factors[i].outcome != Outcome::kInitialised || ObservesLandmarks(sensor)) {
        continue;
      }
      const auto target = static_cast<std::size_t>(sensor.model.initialised_role());
      std::vector<BlockId> others;
      for (std::size_t k = 0; k < sensor.roles.size(); ++k) {
        if (k != target) others.push_back(sensor.roles[k].block);
      }
      const BlockId block = sensor.roles[target].block;
      if (present_[static_cast<std::size_t>(block)] || !AllPresent(others)) continue;
      present_[static_cast<std::size_t>(block)] = progress = true;
      epoch.first_values.push_back({i, block, inputs_});
      inputs_ += sensor.model.measurement().geometry.tangent;
    }
  }
}

bool CondensedRun::Begin(const double* e, bool sensitivity, Point& point) const {
  const Eigen::Index n = initial_.covariance().size(), n0 = l0_.rows();
  Eigen::VectorXd d = Eigen::VectorXd::Zero(n);
  d.head(n0) = d0_ + l0_ * Eigen::Map<const Eigen::VectorXd>(e, n0);
  initial_.Retract(d.data(), point.x);
  point.offset = Eigen::VectorXd::Zero(n);
  point.s.resize(0, 0);
  if (!AllFinite(point.x)) return Fail("the initial state is not finite");
  if (!sensitivity) return true;
  point.s = Eigen::MatrixXd::Zero(n, inputs_);
  for (std::size_t id = 0; id < initial_.layout().blocks().size(); ++id) {
    const Block& block = initial_.layout().blocks()[id];
    const int at = block.tangent_offset, t = block.geometry().tangent;
    if (!block.has_covariance() || at >= n0) continue;
    RowMajor j(t, t);
    block.geometry().PlusJacobian(initial_.value(static_cast<BlockId>(id)), d.data() + at,
                                  j.data());
    point.s.block(at, 0, t, n0) = j * l0_.middleRows(at, t);
  }
  return true;
}

bool CondensedRun::Advance(std::size_t k, const double* e, Point& point) const {
  const Epoch& epoch = epochs_[k];
  return std::ranges::all_of(epoch.steps, [&](const Step& step) { return Move(step, e, point); }) &&
         std::ranges::all_of(epoch.first_values, [&](const FirstValue& first) {
           return Initialise(first, epoch.factors[first.factor], e, point);
         });
}

bool CondensedRun::ForEachFrame(const Eigen::VectorXd& e, std::size_t count,
                                const std::function<void(std::size_t, const Point&)>& take) const {
  Point point;
  if (count > 0 && !Begin(e.data(), true, point)) return false;
  for (std::size_t k = 0; k < count; ++k) {
    if (!Advance(k, e.data(), point)) return false;
    take(k, point);
  }
  return true;
}

bool CondensedRun::Evaluate(const double* e, double* r, double* j) const {
  Point point;
  if (!Begin(e, j != nullptr, point)) return false;
  Eigen::VectorXd residual;
  Eigen::MatrixXd a;
  for (std::size_t k = 0; k < epochs_.size(); ++k) {
    if (!Advance(k, e, point)) return false;
    for (const Factor& factor : epochs_[k].factors) {
      if (factor.row < 0) continue;
      if (!Residual(factor, point, {}, residual, j != nullptr ? &a : nullptr)) return false;
      Eigen::Map<Eigen::VectorXd>(r + factor.row, residual.size()) = residual;
      if (j == nullptr) continue;
      Eigen::Map<RowMajor>(j + std::ptrdiff_t{factor.row} * inputs_, a.rows(), inputs_).noalias() =
          a * point.s;
    }
  }
  return true;
}

void CondensedRun::NoteChange(const Eigen::MatrixXd& before, const Eigen::MatrixXd& after) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (after.size() == 0) return;
  const double scale = after.cwiseAbs().maxCoeff();
  const double moved =
      before.size() == after.size() ? (after - before).cwiseAbs().maxCoeff() : kInfinity;
  change_ = std::max(change_, moved == 0.0 ? 0.0 : moved / scale);
}

/// Advances to the epoch, taking Q of its steps and R of its first values on the way.
bool CondensedRun::FreezeEpoch(Epoch& epoch, const double* e, Point& point) {
  for (Step& step : epoch.steps) {
    if (!FreezeStep(step, point) || !Move(step, e, point)) return false;
  }
  for (const FirstValue& first : epoch.first_values) {
    Factor& factor = epoch.factors[first.factor];
    Point values = point;  // R may depend on the first value itself
    values.s.resize(0, 0);
    if (!Initialise(first, factor, e, values) || !FreezeFactor(factor, values) ||
        !Initialise(first, factor, e, point)) {
      return false;
    }
  }
  return true;
}

bool CondensedRun::robust() const {
  return std::ranges::any_of(parts_, [](const Part& p) { return p.loss.kind != LossKind::kNone; });
}

bool CondensedRun::Freeze(const double* e) {
  change_ = 0.0;
  Point point;
  std::vector<Point> points;
  if (!Begin(e, false, point)) return false;
  for (Epoch& epoch : epochs_) {
    if (!FreezeEpoch(epoch, e, point)) return false;
    for (Factor& factor : epoch.factors) {
      if (factor.row >= 0 && !FreezeFactor(factor, point)) return false;
    }
    if (has_landmarks()) points.push_back(point);
  }
  return FreezeLandmarks(points);
}

void CondensedRun::Put(std::size_t k, const Point& point, const Eigen::MatrixXd& y,
                       State& state) const {
  const std::vector<Block>& places = initial_.layout().blocks();
  for (const FirstValue& first : epochs_[k].first_values) {
    const Block& place = places[static_cast<std::size_t>(first.block)];
    const int t = place.geometry().tangent;
    state.Add(first.block, point.x.data() + place.value_offset, Eigen::MatrixXd::Zero(t, t));
  }
  const Eigen::MatrixXd p = y.transpose() * y;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Block& place = places[i];
    const Block& block = state.layout().blocks()[i];
    if (!block.present) continue;
    std::copy_n(point.x.data() + place.value_offset, place.geometry().ambient,
                state.value(static_cast<BlockId>(i)));
    for (std::size_t j = 0; j <= i && block.has_covariance(); ++j) {
      const Block& other = state.layout().blocks()[j];
      if (!other.has_covariance()) continue;
      state.covariance().SetBlock(block.tangent_offset, other.tangent_offset,
                                  p.block(place.tangent_offset, places[j].tangent_offset,
                                          place.geometry().tangent, places[j].geometry().tangent));
    }
  }
}

void CondensedRun::Report(std::size_t k, const Point& point, UpdateReport& report) const {
  report.Clear();
  report.stale = epochs_[k].stale;
  report.inputs = epochs_[k].inputs;
  report.landmarks = epochs_[k].counts;
  for (const Factor& factor : epochs_[k].factors) {
    const SensorBinding& sensor = SensorOf(factor);
    const Geometry& geometry = sensor.model.measurement().geometry;
    MeasurementReport& entry = report.Add();
    entry.Reset(factor.sensor, factor.measurement.landmark, geometry.tangent);
    entry.outcome = factor.outcome;
    entry.z = factor.measurement.values;
    entry.nis = std::nan("");  // what is left after smoothing is no innovation
    const bool of_landmark = factor.landmark >= 0 && factor.outcome == Outcome::kAccepted;
    if (factor.row < 0 && !of_landmark) continue;
    std::vector<double> y;
    if (of_landmark) y = landmarks_[static_cast<std::size_t>(factor.landmark)].y;
    entry.h.resize(entry.z.size());
    entry.innovation.resize(static_cast<std::size_t>(geometry.tangent));
    if (ModelOf(factor).Predict(RolesOf(factor, point, y).data(), entry.h.data()) != Status::kOk) {
      continue;
    }
    if (geometry.kind == GeometryKind::kAngle) geometry.Normalise(entry.h.data());
    geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
  }
}

}  // namespace alidade::ceres_batch
