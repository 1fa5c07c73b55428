// SPDX-License-Identifier: Apache-2.0
#include "condensed_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "alidade/base/all_finite.h"
#include "alidade/base/error.h"
#include "alidade/base/number_text.h"
#include "alidade/estimation/pending_measurements.h"
#include "alidade/state/dense_algebra.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kMostSteps = 4000;  // of a gap between frames

}  // namespace

Eigen::MatrixXd CovarianceOf(const Point& point, const Eigen::MatrixXd& u) {
  if (point.s.rows() == 0) return {};
  const Eigen::MatrixXd y = u.transpose().triangularView<Eigen::Lower>().solve(point.s.transpose());
  return y.transpose() * y;
}

/// All blocks that have a place, with a value.
State CondensedRun::Filled(State state) {
  for (std::size_t i = 0; i < state.layout().blocks().size(); ++i) {
    const Block block = state.layout().blocks()[i];
    if (block.present || block.value_offset < 0) continue;
    const Geometry& geometry = block.geometry();
    state.Add(static_cast<BlockId>(i), geometry.Identity().data(),
              Eigen::MatrixXd::Zero(geometry.tangent, geometry.tangent));
  }
  return state;
}

CondensedRun::CondensedRun(Problem problem, const std::vector<StreamInfo>& streams, double max_dt_s,
                           int most_inputs)
    : binding_(std::move(problem), streams),
      initial_(Filled(binding_.initial)),
      time_(binding_.problem, streams, max_dt_s),
      most_inputs_(most_inputs) {
  for (const Block& block : binding_.initial.layout().blocks()) {
    present_.push_back(block.present);
    if (block.has_covariance()) inputs_ += block.geometry().tangent;
  }
  prior_ = present_;
  Eigen::LDLT<Eigen::MatrixXd> ldlt;
  internal::SquareRootOf(binding_.initial.covariance().Dense(), ldlt, l0_);
  l0_ = l0_.leftCols(inputs_).eval();  // the others are zero
  d0_ = Eigen::VectorXd::Zero(l0_.rows());
  has_unit_vector_ = std::ranges::any_of(initial_.layout().blocks(), [](const Block& block) {
    return block.has_covariance() && block.geometry().has_transport();
  });
  robust_ = std::ranges::any_of(binding_.problem.sensors, [](const SensorBinding& sensor) {
    return sensor.loss.kind != LossKind::kNone;
  });
  held_.assign(binding_.motion_places.size(), -1);
  held_l_.resize(binding_.motion_places.size());
  PutPlaces();
  if (has_landmarks()) AddKnown();
}

VariableRows CondensedRun::FindVariables() const {
  const auto n = static_cast<std::size_t>(initial_.covariance().size());
  std::vector<bool> moves(n, false), read(n, false);
  for (std::size_t i = 0; i < binding_.motion_places.size(); ++i) {
    if (binding_.problem.motions[i].model->stationary()) continue;
    for (const int row : binding_.motion_places[i].at) {
      if (row >= 0) moves[static_cast<std::size_t>(row)] = true;
    }
  }
  for (const internal::SensorPlace& place : binding_.sensor_places) {
    for (const JacobianPart& part : place.parts) {
      std::fill_n(read.begin() + part.offset, part.size, true);
    }
  }
  VariableRows found;
  const std::vector<Block>& blocks = initial_.layout().blocks();
  for (std::size_t id = 0; id < blocks.size(); ++id) {
    if (!blocks[id].has_covariance()) continue;
    std::vector<int> rows(static_cast<std::size_t>(blocks[id].geometry().tangent));
    std::iota(rows.begin(), rows.end(), blocks[id].tangent_offset);
    const auto first = static_cast<std::size_t>(blocks[id].tangent_offset);
    if (moves[first]) {
      std::vector<int>& into = read[first] ? found.read : found.rest;
      into.insert(into.end(), rows.begin(), rows.end());
      continue;
    }
    const bool of_landmark = id >= prior_.size();
    // What the prior knows exactly, as the first keyframe, has no variance.
    const auto stays = [&](int row) { return !l0_.row(row).any() && d0_[row] == 0.0; };
    if (of_landmark) std::erase_if(rows, stays);
    if (!rows.empty()) found.constants.push_back({std::move(rows), of_landmark});
  }
  return found;
}

/// Whether the block that these rows are of begins in the epochs `first` to `last`.
bool CondensedRun::HasBorn(const std::vector<int>& rows, std::size_t first,
                           std::size_t last) const {
  const StateLayout& layout = initial_.layout();
  const auto own = [&](BlockId id) {
    const int offset = layout[id].tangent_offset, row = rows.front();
    return offset >= 0 && offset <= row && row < offset + layout[id].geometry().tangent;
  };
  for (std::size_t id = 0; first == 0 && id < layout.blocks().size(); ++id) {
    if ((id >= prior_.size() || prior_[id]) && own(static_cast<BlockId>(id))) return true;
  }
  for (std::size_t i = first; i <= last; ++i) {
    const auto begins = [&](const FirstValue& value) { return own(value.block); };
    if (std::ranges::any_of(epochs_[i].first_values, begins)) return true;
  }
  return false;
}

void CondensedRun::PutPlaces() {
  places_.clear();
  xyz_places_.clear();
  for (std::size_t i = 0; i < binding_.sensor_places.size(); ++i) {
    const SensorBinding& sensor = binding_.problem.sensors[i];
    places_.push_back(PlaceBehind(i, *sensor.model));
    xyz_places_.push_back(PlaceBehind(i, sensor.xyz ? *sensor.xyz : *sensor.model));
  }
}

/// The place of a sensor in x and S; that of a landmark which it observes lies behind them.
internal::SensorPlace CondensedRun::PlaceBehind(std::size_t sensor,
                                                const SensorModel& model) const {
  internal::SensorPlace place = binding_.sensor_places[sensor];
  if (!ObservesLandmarks(binding_.problem.sensors[sensor])) return place;
  State behind = initial_;
  std::vector<BlockId> landmark;
  for (const Space& role : model.roles()) {
    if (!role.landmark()) continue;
    landmark.push_back(behind.Declare("landmarks.#" + role.name, "landmarks", role));
    behind.Reserve(landmark.back());
  }
  place.PutLandmark(model.roles().size() - landmark.size(), behind.layout(), landmark);
  return place;
}

bool CondensedRun::Fail(std::string why) const {
  problem_ = std::move(why);
  return false;
}

bool CondensedRun::FailTooMany() const {
  return Fail(
      "more than " + std::to_string(most_inputs_) +
      " noise inputs: the batch solves for all of them at once; a shorter series or window, a "
      "longer time between frames, or landmarks that are pruned have fewer");
}

/// As Linearised takes them.
std::vector<double> CondensedRun::ValuesOf(const State& state) const {
  std::vector<double> values = initial_.values();
  for (std::size_t i = 0; i < present_.size(); ++i) {
    const BlockId id = static_cast<BlockId>(i);
    const Block& block = state.layout()[id];  // its place is that in initial_
    if (!block.present) continue;
    std::copy_n(state.value(id), block.geometry().ambient, values.data() + block.value_offset);
  }
  return values;
}

bool CondensedRun::Add(const Frame& frame, const UpdateReport& report, const Estimator& filter,
                       Trajectory& about) {
  if (timestamp_ == kNoTimestamp) timestamp_ = time_.StartFor(frame);
  Epoch epoch;
  epoch.steps.swap(passed_on_);
  epoch.report.stale = frame.timestamp < timestamp_;
  if (!epochs_.empty()) epoch.column = inputs_;
  if (!AddSteps(timestamp_, frame.timestamp, epoch)) return false;
  if (!epoch.report.stale) timestamp_ = frame.timestamp;
  time_.TakeInputs(frame, epoch.report);
  epoch.report.events.clear();  // the filter tells them
  AddFactors(frame, report, epoch);
  if (has_landmarks()) AddLandmarks(report, filter, epoch);
  EndInterval(epoch);
  epochs_.push_back(std::move(epoch));
  if (inputs_ > most_inputs_) return FailTooMany();
  if (!filter.failed()) about.push_back(ValuesOf(filter.state()));
  return true;
}

/// Noise is held no longer where the frame has a measurement in use, as in a filter.
void CondensedRun::EndInterval(Epoch& epoch) {
  const auto in_use = [](const Factor& f) { return f.row >= 0 || f.landmark >= 0; };
  if (!epoch.first_values.empty() || std::ranges::any_of(epoch.factors, in_use)) {
    std::ranges::fill(held_, -1);
  }
  epoch.ends = std::ranges::all_of(held_, [](int column) { return column < 0; });
}

/// The steps of all models from `from` to `to`, where that is later.
bool CondensedRun::AddSteps(Timestamp from, Timestamp to, Epoch& epoch) {
  const auto present = [this](BlockId id) { return Present(id); };
  std::vector<Event> events;  // the filter tells them
  internal::Timeline::SubStep sub_step;
  for (; from < to; from = sub_step.end) {
    if (time_.NextSubStep(from, to, events, sub_step) || sub_step.steps > kMostSteps) {
      return Fail("the gap that ends at t = " + internal::SecondsText(sub_step.end) +
                  " needs more than " + std::to_string(kMostSteps) + " steps; increase max_dt_s");
    }
    for (Timestamp part = 0; part < sub_step.steps; ++part) {
      for (std::size_t i = 0; i < binding_.motion_places.size(); ++i) {
        const MotionBinding& motion = binding_.problem.motions[i];
        if (motion.model->stationary() || !std::ranges::all_of(motion.blocks, present)) continue;
        const std::span<const double> u = time_.Input(i, from, events);
        Step& step = epoch.steps.emplace_back();
        step.motion = i;
        step.dt_s = sub_step.dt_s;
        step.begins = held_[i] < 0;
        step.column = step.begins ? inputs_ : held_[i];
        step.columns = inputs_;
        step.u.assign(u.begin(), u.end());
        if (step.begins) inputs_ += motion.model->noise_size();
        if (binding_.motion_places[i].holds) held_[i] = step.column;
      }
      if (inputs_ > most_inputs_) return FailTooMany();
    }
  }
  return true;
}

/// One factor for each measurement and sensor bound to its stream, in the order of the filter.
void CondensedRun::AddFactors(const Frame& frame, const UpdateReport& report, Epoch& epoch) {
  internal::PendingMeasurements rows;
  rows.Collect(frame, binding_, epoch.report);
  epoch.report = UpdateReport(epoch.report);  // whose numbers no longer lie in the rows
  ALIDADE_EXPECTS(rows.all().size() == report.measurements().size());
  for (std::size_t i = 0; i < rows.all().size(); ++i) {
    const internal::PendingMeasurement& row = rows.all()[i];
    const bool first = report.measurements()[i].outcome == Outcome::kInitialised;
    Factor& factor = epoch.factors.emplace_back();
    factor.sensor = row.sensor;
    factor.measurement = *row.measurement;
    factor.outcome = first                ? Outcome::kInitialised
                     : epoch.report.stale ? Outcome::kStale
                                          : epoch.report.measurements()[i].outcome;
  }
  AddFirstValues(epoch);
  const auto present = [this](const RoleBinding& role) { return Present(role.block); };
  for (Factor& factor : epoch.factors) {
    const SensorBinding& sensor = SensorOf(factor);
    if (factor.outcome != Outcome::kAccepted || ObservesLandmarks(sensor)) continue;
    if (std::ranges::all_of(sensor.roles, present)) {
      AddPart(factor);
    } else {
      factor.outcome = Outcome::kNotReady;
    }
  }
}

/// Puts the residuals of a factor behind those that there are.
void CondensedRun::AddPart(Factor& factor) {
  const SensorBinding& sensor = SensorOf(factor);
  const int size = sensor.model->measurement().geometry.tangent;
  const bool plain = sensor.loss.kind == LossKind::kNone;
  factor.row = residuals_;
  residuals_ += size;
  if (plain && !parts_.empty() && parts_.back().loss.kind == LossKind::kNone) {
    parts_.back().size += size;
  } else {
    parts_.push_back({factor.row, size, sensor.loss});
  }
}

/// First values in an order in which each finds the blocks that it needs.
void CondensedRun::AddFirstValues(Epoch& epoch) {
  const auto missing = [this](const RoleBinding& role) { return !Present(role.block); };
  for (bool progress = true; progress;) {
    progress = false;
    for (std::size_t i = 0; i < epoch.factors.size(); ++i) {
      const SensorBinding& sensor = SensorOf(epoch.factors[i]);
      if (epoch.factors[i].outcome != Outcome::kInitialised || ObservesLandmarks(sensor)) {
        continue;
      }
      const auto target = static_cast<std::size_t>(sensor.model->inverse().role);
      const BlockId block = sensor.roles[target].block;
      if (Present(block) || std::ranges::count_if(sensor.roles, missing) > 1) continue;
      present_[static_cast<std::size_t>(block)] = progress = true;
      epoch.first_values.push_back({i, block, inputs_});
      inputs_ += sensor.model->measurement().geometry.tangent;
    }
  }
}

bool CondensedRun::Begin(const double* e, int columns, Point& point) const {
  const Eigen::Index n = l0_.rows(), n0 = l0_.cols();
  const Eigen::VectorXd d = d0_ + l0_ * Eigen::Map<const Eigen::VectorXd>(e, n0);
  initial_.Retract(d.data(), point.x);
  point.offset = Eigen::VectorXd::Zero(n);
  point.s.resize(0, 0);
  point.before = 0;
  if (!internal::AllFinite(point.x)) return Fail("the initial state is not finite");
  if (columns < 0) return true;
  point.s = Eigen::MatrixXd::Zero(n, columns);
  for (std::size_t id = 0; id < initial_.layout().blocks().size(); ++id) {
    const Block& block = initial_.layout().blocks()[id];
    const int at = block.tangent_offset, t = block.geometry().tangent;
    if (!block.has_covariance()) continue;
    RowMajor j(t, t);
    PlusJacobian(block.geometry(), initial_.value(static_cast<BlockId>(id)), d.data() + at,
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

bool CondensedRun::ForEachFrame(const Eigen::VectorXd& e, std::size_t count, const TakePoint& take,
                                bool sensitivity) const {
  Point point;
  if (count > 0 && !Begin(e.data(), sensitivity ? inputs_ : -1, point)) return false;
  for (std::size_t k = 0; k < count; ++k) {
    if (!Advance(k, e.data(), point)) return false;
    take(k, point);
  }
  return true;
}

bool CondensedRun::Evaluate(const Eigen::VectorXd& e, double* r, double* j) const {
  Point point;
  if (!Begin(e.data(), j != nullptr ? inputs_ : -1, point)) return false;
  Eigen::VectorXd residual;
  Eigen::MatrixXd a;
  for (std::size_t k = 0; k < epochs_.size(); ++k) {
    if (!Advance(k, e.data(), point)) return false;
    for (const Factor& factor : epochs_[k].factors) {
      if (factor.row < 0) continue;
      if (!Residual(factor, point.x, residual, j != nullptr ? &a : nullptr)) return false;
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
    if (!Initialise(first, factor, e, values) || !FreezeFactor(factor, values.x) ||
        !Initialise(first, factor, e, point)) {
      return false;
    }
  }
  return true;
}

std::optional<double> CondensedRun::Freeze(const Eigen::VectorXd& e) {
  change_ = 0.0;
  Point point;
  std::vector<Point> points;
  if (!Begin(e.data(), -1, point)) return {};
  for (Epoch& epoch : epochs_) {
    if (!FreezeEpoch(epoch, e.data(), point)) return {};
    for (Factor& factor : epoch.factors) {
      // One of a landmark in the state that is not defined may be left out.
      if (factor.row >= 0 && !FreezeFactor(factor, point.x) && !IsOfState(factor)) return {};
    }
    if (has_landmarks()) points.push_back(point);
  }
  if (!FreezeLandmarks(points)) return {};
  return change_;
}

// Linearised about a given trajectory.

bool CondensedRun::Linearised(Trajectory trajectory, Eigen::VectorXd& e) {
  constexpr int kMostPasses = 20;
  constexpr double kSettled = 1e-9;  // of inputs whose sigma is 1
  Eigen::VectorXd step;
  e.setZero(inputs_);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    if (!StepAbout(trajectory, e, step)) return pass > 0;
    e += step;
    if (!has_unit_vector_ || step.norm() <= kSettled) break;
  }
  return true;
}

/// To the values of `about`, where a filter has them: x' becomes x, and offset and S are carried
/// from the tangent at x' to the one at x, where x' (-) x adds to the offset.
void CondensedRun::PutAbout(const std::vector<double>& about, Point& point) const {
  for (const Block& block : initial_.layout().blocks()) {
    if (!block.has_covariance()) continue;
    const Geometry& geometry = block.geometry();
    const int at = block.tangent_offset, t = geometry.tangent;
    double* const x = point.x.data() + block.value_offset;
    const double* const to = about.data() + block.value_offset;
    Eigen::VectorXd defect(t);
    RowMajor j(t, t);
    geometry.Minus(x, to, defect.data());
    geometry.Transport(x, to, j.data());
    point.s.middleRows(at, t) = j * point.s.middleRows(at, t);
    point.offset.segment(at, t) = j * point.offset.segment(at, t) + defect;
    std::copy_n(to, geometry.ambient, x);
  }
}

bool CondensedRun::StepAbout(Trajectory& trajectory, const Eigen::VectorXd& e,
                             Eigen::VectorXd& step) {
  const int residuals = has_landmarks() ? 0 : residuals_;
  Eigen::MatrixXd j = Eigen::MatrixXd::Identity(inputs_ + residuals, inputs_);
  j.bottomRows(residuals).setZero();
  Eigen::VectorXd r = Eigen::VectorXd::Zero(inputs_ + residuals), residual;
  r.head(inputs_) = e;
  Eigen::MatrixXd a;
  Point point;
  std::vector<Point> points;
  if (!Begin(e.data(), inputs_, point)) return false;
  for (std::size_t k = 0; k < epochs_.size(); ++k) {
    if (!FreezeEpoch(epochs_[k], e.data(), point)) return false;
    if (k < trajectory.size()) PutAbout(trajectory[k], point);
    if (has_unit_vector_ || has_landmarks()) points.push_back(point);
    for (Factor& factor : epochs_[k].factors) {
      // What is not defined here tells nothing yet; it may be at the solution.
      if (factor.row < 0 || !FreezeFactor(factor, point.x)) continue;
      if (has_landmarks() || !Residual(factor, point.x, residual, &a)) continue;
      const double root = std::sqrt(Weight(SensorOf(factor).loss, residual.norm()));
      r.segment(inputs_ + factor.row, residual.size()) = root * (residual + a * point.offset);
      j.middleRows(inputs_ + factor.row, residual.size()) = root * a * point.s;
    }
  }
  if (has_landmarks()) {
    Reduced reduced;
    if (!FreezeLandmarks(points) || !Project(e, points, Undefined::kSkipped, true, reduced)) {
      return false;
    }
    step = -reduced.llt.solve(reduced.g);
  } else {
    step = -internal::SolveLeastSquares(j, r).x;
  }
  if (!step.allFinite()) return Fail("the problem linearised about the filter has no solution");
  if (!has_unit_vector_) return true;
  trajectory.resize(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Eigen::VectorXd d = points[k].offset + points[k].s * step;
    trajectory[k] = points[k].x;
    for (const Block& block : initial_.layout().blocks()) {
      if (!block.has_covariance()) continue;
      double* const x = trajectory[k].data() + block.value_offset;
      block.geometry().Plus(x, d.data() + block.tangent_offset, x);
    }
  }
  return true;
}

// Estimates and reports.

void CondensedRun::Put(std::size_t k, const std::vector<double>& x, const Eigen::MatrixXd& p,
                       State& state, UpdateReport& report) const {
  for (const FirstValue& first : epochs_[k].first_values) {
    const Block& block = initial_.layout()[first.block];
    const int t = block.geometry().tangent;
    state.Add(first.block, x.data() + block.value_offset, Eigen::MatrixXd::Zero(t, t));
  }
  std::copy_n(x.begin(), state.values().size(), state.values().begin());  // no landmarks
  if (p.rows() > 0) state.covariance().SetBlock(0, 0, p);                 // else all are constant
  Report(k, x, report);
}

/// What became of the measurements of frame k, seen from `values`.
void CondensedRun::Report(std::size_t k, const std::vector<double>& values,
                          UpdateReport& report) const {
  report = epochs_[k].report;
  for (std::size_t i = 0; i < epochs_[k].factors.size(); ++i) {
    const Factor& factor = epochs_[k].factors[i];
    const Geometry& geometry = ModelOf(factor).measurement().geometry;
    MeasurementReport& entry = report.measurements()[i];
    entry.outcome = factor.left_out ? Outcome::kOutOfDomain : factor.outcome;
    entry.nis = std::nan("");  // what is left after smoothing is no innovation
    const bool of_landmark =
        factor.row < 0 && factor.landmark >= 0 && entry.outcome == Outcome::kAccepted;
    if (factor.row < 0 && !of_landmark) continue;
    std::vector<double> x = values;
    if (of_landmark) {
      x = WithLandmark(x, landmarks_[static_cast<std::size_t>(factor.landmark)].y);
    }
    std::vector<double>& h = memory_.h;
    if (See(factor, x, h, nullptr) != Outcome::kAccepted) continue;
    WrapAngles(geometry, h.data());
    std::vector<double> innovation(static_cast<std::size_t>(geometry.tangent));
    geometry.Minus(entry.z.data(), h.data(), innovation.data());
    entry.h = report.Copy(h);
    entry.innovation = report.Copy(innovation);
  }
}

}  // namespace alidade::ceres_batch
