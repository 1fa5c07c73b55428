// SPDX-License-Identifier: Apache-2.0
#include "trajectory.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry_jacobian.h"

namespace alidade::ceres_batch {
namespace {

constexpr int kMostInputs = 4000;  // the dense Jacobian of as many rows takes 128 MB

/// L with P = L L', for P positive semidefinite.
Eigen::MatrixXd SquareRoot(const Eigen::MatrixXd& p) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(p);
  const Eigen::VectorXd d = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
  return ldlt.transpositionsP().transpose() * (Eigen::MatrixXd(ldlt.matrixL()) * d.asDiagonal());
}

/// The rows of the covariance that belong to the blocks, in their order; -1: a fixed block's.
std::vector<int> RowsOf(const StateLayout& layout, const std::vector<BlockId>& blocks) {
  std::vector<int> rows;
  for (const BlockId id : blocks) {
    const Block& block = layout[id];
    for (int i = 0; i < block.geometry().tangent; ++i) {
      rows.push_back(block.has_covariance() ? block.tangent_offset + i : -1);
    }
  }
  return rows;
}

/// What a status says that is not kOk.
std::string Why(Status status, const std::string& error) {
  return status == Status::kError ? error : "out of its domain";
}

}  // namespace

Trajectory::Trajectory(System system, const std::vector<StreamInfo>& streams, double max_dt_s)
    : system_(std::move(system)), max_dt_s_(max_dt_s), initial_(system_.InitialState()) {
  for (const SensorBinding& sensor : system_.sensors) {
    const auto found = std::ranges::find(streams, sensor.stream, &StreamInfo::name);
    stream_of_sensor_.push_back(found == streams.end() ? -1
                                                       : static_cast<int>(found - streams.begin()));
  }
  l0_ = SquareRoot(initial_.covariance().Dense());
  inputs_ = static_cast<int>(l0_.cols());
}

bool Trajectory::Fail(std::string why) const {
  problem_ = std::move(why);
  return false;
}

bool Trajectory::Add(const Frame& frame) {
  if (stamp_ == kNoStamp) {
    stamp_ = system_.start_s ? StampFromSeconds(*system_.start_s) : frame.stamp;
  }
  Node node;
  node.stale = frame.stamp < stamp_;
  Stamp elapsed = 0;
  const bool overflow = __builtin_sub_overflow(frame.stamp, stamp_, &elapsed);
  const double parts = std::max(1.0, std::ceil(Seconds(elapsed) / max_dt_s_));
  if (!node.stale && (overflow || parts > kMostInputs)) {
    return Fail("a gap before " + std::to_string(Seconds(frame.stamp)) + " s needs more than " +
                std::to_string(kMostInputs) + " steps of max_dt_s");
  }
  int inputs = inputs_;
  for (int part = 0; part < static_cast<int>(parts) && !node.stale && elapsed > 0; ++part) {
    for (std::size_t i = 0; i < system_.motions.size(); ++i) {
      if (system_.motions[i].model.stationary()) continue;
      node.steps.push_back({i, Seconds(elapsed) / parts, inputs, {}});
      inputs += system_.motions[i].model.noise_size();
    }
    if (inputs <= kMostInputs) continue;
    return Fail("more than " + std::to_string(kMostInputs) +
                " noise inputs: the batch solves for all of them at once; a shorter series, or a "
                "longer time between frames, has fewer");
  }
  inputs_ = inputs;
  if (!node.stale) stamp_ = frame.stamp;
  AddFactors(frame, node);
  nodes_.push_back(std::move(node));
  return true;
}

/// One factor for each measurement and sensor bound to its stream, in the order of the sensors.
void Trajectory::AddFactors(const Frame& frame, Node& node) {
  for (std::size_t i = 0; i < system_.sensors.size(); ++i) {
    const SensorModel& model = system_.sensors[i].model;
    for (const Measurement& m : frame.measurements) {
      if (m.stream != stream_of_sensor_[i]) continue;
      ALIDADE_EXPECTS(std::ssize(m.values) == model.measurement().geometry.ambient);
      Factor factor{static_cast<int>(i), m, Outcome::kStale, -1, {}};
      if (!node.stale) {
        factor.outcome =
            AllFinite(m.values) ? OutcomeOf(model.Valid(m.values.data())) : Outcome::kNotFinite;
      }
      if (factor.outcome == Outcome::kAccepted) {
        factor.row = residuals_;
        residuals_ += model.measurement().geometry.tangent;
      }
      node.factors.push_back(std::move(factor));
    }
  }
}

bool Trajectory::Begin(const double* e, bool sensitivity, Point& point) const {
  const auto n = l0_.rows();
  const Eigen::VectorXd d = l0_ * Eigen::Map<const Eigen::VectorXd>(e, n);
  initial_.Retract(d.data(), point.x);
  point.offset = Eigen::VectorXd::Zero(n);
  point.s.resize(0, 0);
  if (!AllFinite(point.x)) return Fail("the initial state is not finite");
  if (!sensitivity) return true;
  point.s = Eigen::MatrixXd::Zero(n, inputs_);
  for (std::size_t id = 0; id < initial_.layout().blocks().size(); ++id) {
    const Block& block = initial_.layout().blocks()[id];
    if (!block.has_covariance()) continue;
    const int at = block.tangent_offset, t = block.geometry().tangent;
    point.s.block(at, 0, t, n) =
        PlusJacobian(block.geometry(), initial_.value(static_cast<BlockId>(id)), d.data() + at) *
        l0_.middleRows(at, t);
  }
  return true;
}

bool Trajectory::Advance(std::size_t k, const double* e, Point& point) const {
  return std::ranges::all_of(nodes_[k].steps,
                             [&](const Step& step) { return Move(step, e, point); });
}

/// x = f(x, L e, dt); S = F S + [0  G L  0] and offset = F offset, in the rows of the model.
bool Trajectory::Move(const Step& step, const double* e, Point& point) const {
  const MotionBinding& motion = system_.motions[step.motion];
  const StateLayout& layout = initial_.layout();
  const int n = motion.model.tangent_size(), n_w = motion.model.noise_size();
  const Eigen::VectorXd w = step.l * Eigen::Map<const Eigen::VectorXd>(e + step.column, n_w);
  const bool sensitivity = point.s.size() > 0;
  RowMajor f = RowMajor::Constant(n, n, std::nan("")), g = RowMajor::Constant(n, n_w, std::nan(""));
  std::vector<double> next = point.x;
  std::vector<const double*> from;
  std::vector<double*> to;
  for (const BlockId id : motion.blocks) {
    from.push_back(point.x.data() + layout[id].value_offset);
    to.push_back(next.data() + layout[id].value_offset);
  }
  const Status status =
      motion.model.Step(from.data(), nullptr, w.data(), step.dt_s, to.data(),
                        sensitivity ? f.data() : nullptr, sensitivity ? g.data() : nullptr);
  if (status != Status::kOk) {
    return Fail("motion model of '" + motion.name +
                "' cannot step: " + Why(status, motion.model.error_text()));
  }
  for (const BlockId id : motion.blocks) {
    const Block& block = layout[id];
    if (block.status != BlockStatus::kFixed) continue;
    std::copy_n(point.x.data() + block.value_offset, block.geometry().ambient,
                next.data() + block.value_offset);
  }
  const bool finite = AllFinite(next) && (!sensitivity || (f.allFinite() && g.allFinite()));
  if (!finite) return Fail("motion model of '" + motion.name + "' steps to what is not finite");
  point.x = std::move(next);
  if (!sensitivity) return true;

  // F and G L in the rows of the whole state.
  const std::vector<int> rows = RowsOf(layout, motion.blocks);
  const RowMajor gl = g * step.l;
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(point.s.rows(), point.s.rows());
  for (int i = 0; i < n; ++i) {
    const int row = rows[static_cast<std::size_t>(i)];
    if (row < 0) continue;
    for (int k = 0; k < n; ++k) {
      const int column = rows[static_cast<std::size_t>(k)];
      if (column >= 0) a(row, column) = f(i, k);
    }
    point.s.row(row).segment(step.column, n_w) = gl.row(i);
  }
  point.s.leftCols(step.column) = a * point.s.leftCols(step.column);
  point.offset = a * point.offset;
  return true;
}

std::vector<const double*> Trajectory::RolesOf(const SensorBinding& sensor,
                                               const Point& point) const {
  std::vector<const double*> roles;
  for (const RoleBinding& role : sensor.roles) {
    roles.push_back(role.block < 0 ? nullptr
                                   : point.x.data() + initial_.layout()[role.block].value_offset);
  }
  return roles;
}

/// r = L^-1 (z (-) h), m, and unless null a = dr/dx, m x n.
bool Trajectory::Residual(const Factor& factor, const Point& point, Eigen::VectorXd& r,
                          Eigen::MatrixXd* a) const {
  const SensorBinding& sensor = SensorOf(factor);
  const Geometry& geometry = sensor.model.measurement().geometry;
  const std::vector<const double*> roles = RolesOf(sensor, point);
  std::vector<RowMajor> jacobians(roles.size());
  std::vector<double*> into(roles.size(), nullptr);
  std::vector<int> strides(roles.size(), 0);
  for (std::size_t i = 0; i < roles.size() && a != nullptr; ++i) {
    const BlockId id = sensor.roles[i].block;
    if (id < 0 || !initial_.layout()[id].has_covariance()) continue;
    strides[i] = initial_.layout()[id].geometry().tangent;
    jacobians[i] = RowMajor::Constant(geometry.tangent, strides[i], std::nan(""));
    into[i] = jacobians[i].data();
  }
  std::vector<double> h(static_cast<std::size_t>(geometry.ambient), std::nan(""));
  const Status status =
      a == nullptr ? sensor.model.Predict(roles.data(), h.data())
                   : sensor.model.Linearise(roles.data(), h.data(), into.data(), strides.data());
  if (status != Status::kOk) {
    return Fail("sensor '" + sensor.name + "' at " +
                std::to_string(Seconds(factor.measurement.stamp)) +
                " s: " + Why(status, sensor.model.error_text()));
  }
  const double* z = factor.measurement.values.data();
  r.resize(geometry.tangent);
  geometry.Minus(z, h.data(), r.data());
  const auto whiten = factor.l.triangularView<Eigen::Lower>();
  whiten.solveInPlace(r);
  bool finite = r.allFinite();
  if (a != nullptr) {
    a->setZero(geometry.tangent, l0_.rows());
    const Eigen::MatrixXd j_r_h = MinusJacobian(geometry, z, h.data());
    for (std::size_t i = 0; i < roles.size(); ++i) {
      if (into[i] == nullptr) continue;
      const Block& block = initial_.layout()[sensor.roles[i].block];
      a->middleCols(block.tangent_offset, strides[i]) += j_r_h * jacobians[i];
    }
    whiten.solveInPlace(*a);
    finite = finite && a->allFinite();
  }
  return finite || Fail("sensor '" + sensor.name + "' predicts what is not finite");
}

bool Trajectory::Evaluate(const double* e, double* r, double* j) const {
  Point point;
  if (!Begin(e, j != nullptr, point)) return false;
  Eigen::VectorXd residual;
  Eigen::MatrixXd a;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (!Advance(k, e, point)) return false;
    for (const Factor& factor : nodes_[k].factors) {
      if (factor.row < 0) continue;
      if (!Residual(factor, point, residual, j != nullptr ? &a : nullptr)) return false;
      Eigen::Map<Eigen::VectorXd>(r + factor.row, residual.size()) = residual;
      if (j == nullptr) continue;
      Eigen::Map<RowMajor>(j + std::ptrdiff_t{factor.row} * inputs_, a.rows(), inputs_).noalias() =
          a * point.s;
    }
  }
  return true;
}

void Trajectory::NoteChange(const Eigen::MatrixXd& before, const Eigen::MatrixXd& after) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (after.size() == 0) return;
  const double scale = after.cwiseAbs().maxCoeff();
  const double moved =
      before.size() == after.size() ? (after - before).cwiseAbs().maxCoeff() : kInfinity;
  change_ = std::max(change_, moved == 0.0 ? 0.0 : moved / scale);
}

bool Trajectory::FreezeStep(Step& step, const Point& point) {
  const MotionBinding& motion = system_.motions[step.motion];
  const int n_w = motion.model.noise_size();
  std::vector<const double*> blocks;
  for (const BlockId id : motion.blocks) {
    blocks.push_back(point.x.data() + initial_.layout()[id].value_offset);
  }
  RowMajor l = RowMajor::Zero(n_w, n_w);
  const Status status = motion.model.SqrtQ(blocks.data(), step.dt_s, l.data());
  if (status != Status::kOk || !l.allFinite()) {
    return Fail("the noise of motion model '" + motion.name +
                "': " + Why(status, motion.model.error_text()));
  }
  NoteChange(step.l, l);
  step.l = std::move(l);
  return true;
}

bool Trajectory::FreezeFactor(Factor& factor, const Point& point) {
  const SensorBinding& sensor = SensorOf(factor);
  const int m = sensor.model.measurement().geometry.tangent;
  Eigen::MatrixXd r;
  if (factor.measurement.covariance.empty()) {
    RowMajor root = RowMajor::Constant(m, m, std::nan(""));
    const Status status = sensor.model.SqrtNoise(RolesOf(sensor, point).data(),
                                                 factor.measurement.values.data(), root.data());
    if (status != Status::kOk) {
      return Fail("the noise of sensor '" + sensor.name + "' at " +
                  std::to_string(Seconds(factor.measurement.stamp)) +
                  " s: " + Why(status, sensor.model.error_text()));
    }
    r = root * root.transpose();
  } else {
    r = Eigen::Map<const RowMajor>(factor.measurement.covariance.data(), m, m);
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(r);  // which takes what is not a number for a success
  if (!r.allFinite() || llt.info() != Eigen::Success) {
    return Fail("the noise of sensor '" + sensor.name + "' at " +
                std::to_string(Seconds(factor.measurement.stamp)) +
                " s is not positive definite: a batch needs sigma > 0");
  }
  const Eigen::MatrixXd l = llt.matrixL();
  NoteChange(factor.l, l);
  factor.l = l;
  return true;
}

bool Trajectory::Freeze(const double* e) {
  change_ = 0.0;
  Point point;
  if (!Begin(e, false, point)) return false;
  for (Node& node : nodes_) {
    for (Step& step : node.steps) {
      if (!FreezeStep(step, point) || !Move(step, e, point)) return false;
    }
    for (Factor& factor : node.factors) {
      if (factor.row >= 0 && !FreezeFactor(factor, point)) return false;
    }
  }
  return true;
}

bool Trajectory::Linearised(const std::vector<std::vector<double>>& trajectory,
                            Eigen::VectorXd& e) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(inputs_);
  Eigen::MatrixXd j = Eigen::MatrixXd::Identity(inputs_ + residuals_, inputs_);
  j.bottomRows(residuals_).setZero();
  Eigen::VectorXd r = Eigen::VectorXd::Zero(inputs_ + residuals_), residual;
  Eigen::MatrixXd a;
  Point point;
  if (!Begin(zero.data(), true, point)) return false;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    for (Step& step : nodes_[k].steps) {
      if (!FreezeStep(step, point) || !Move(step, zero.data(), point)) return false;
    }
    for (const Block& block : initial_.layout().blocks()) {
      if (k >= trajectory.size() || !block.has_covariance()) continue;
      Eigen::VectorXd defect(block.geometry().tangent);
      double* const x = point.x.data() + block.value_offset;
      block.geometry().Minus(x, trajectory[k].data() + block.value_offset, defect.data());
      point.offset.segment(block.tangent_offset, defect.size()) += defect;
      std::copy_n(trajectory[k].data() + block.value_offset, block.geometry().ambient, x);
    }
    for (Factor& factor : nodes_[k].factors) {
      // What is not defined here tells nothing yet; it may be at the solution.
      if (factor.row < 0 || !FreezeFactor(factor, point)) continue;
      if (!Residual(factor, point, residual, &a)) continue;
      r.segment(inputs_ + factor.row, residual.size()) = residual + a * point.offset;
      j.middleRows(inputs_ + factor.row, residual.size()) = a * point.s;
    }
  }
  e = -j.householderQr().solve(r);
  return e.allFinite() || Fail("the problem linearised about the filter has no solution");
}

void Trajectory::Put(const Point& point, const Eigen::MatrixXd& y, State& state) {
  state.values() = point.x;
  if (y.cols() > 0) state.covariance().SetBlock(0, 0, y.transpose() * y);
}

void Trajectory::Report(std::size_t k, const Point& point, UpdateReport& report) const {
  report.Clear();
  report.stale = nodes_[k].stale;
  for (const Factor& factor : nodes_[k].factors) {
    const SensorBinding& sensor = SensorOf(factor);
    const Geometry& geometry = sensor.model.measurement().geometry;
    MeasurementReport& entry = report.Add();
    entry.Reset(factor.sensor, factor.measurement.landmark, geometry.tangent);
    entry.outcome = factor.outcome;
    entry.z = factor.measurement.values;
    entry.nis = std::nan("");  // what is left after smoothing is no innovation
    if (factor.row < 0) continue;
    entry.h.resize(entry.z.size());
    entry.innovation.resize(static_cast<std::size_t>(geometry.tangent));
    if (sensor.model.Predict(RolesOf(sensor, point).data(), entry.h.data()) != Status::kOk)
      continue;
    geometry.Minus(entry.z.data(), entry.h.data(), entry.innovation.data());
  }
}

}  // namespace alidade::ceres_batch
