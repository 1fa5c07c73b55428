// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/src/number_text.h"
#include "geometry_jacobian.h"
#include "trajectory.h"

/// The models of a Trajectory: their values, derivatives and noise at a point of it.
namespace alidade::ceres_batch {
namespace {

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

/// x = f(x, u, L e, dt); S = F S + [0  G L  0] and offset = F offset, in the rows of the model.
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
      motion.model.Step(from.data(), step.u.data(), w.data(), step.dt_s, to.data(),
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

/// y = g(x, z'), z' = z (+) L e; S_y = J_y_x S + [0  J_y_z' J_z' L  0], offset_y = J_y_x offset.
bool Trajectory::Initialise(const First& first, const Factor& factor, const double* e,
                            Point& point) const {
  const SensorBinding& sensor = SensorOf(factor);
  const Block& block = initial_.layout()[first.block];
  const Geometry& measured = sensor.model.measurement().geometry;
  const int m = measured.tangent, t = block.geometry().tangent;
  std::vector<const double*> roles = RolesOf(sensor, point);
  roles[static_cast<std::size_t>(sensor.model.initialised_role())] = nullptr;
  std::vector<RowMajor> jacobians(roles.size());
  std::vector<double*> jx(roles.size(), nullptr);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (roles[i] == nullptr || !initial_.layout()[sensor.roles[i].block].has_covariance()) continue;
    jacobians[i] = RowMajor::Zero(t, initial_.layout()[sensor.roles[i].block].geometry().tangent);
    jx[i] = jacobians[i].data();
  }
  Eigen::VectorXd d = Eigen::VectorXd::Zero(m);
  if (factor.l.size() > 0) d = factor.l * Eigen::Map<const Eigen::VectorXd>(e + first.column, m);
  std::vector<double> z = factor.measurement.values,
                      y(static_cast<std::size_t>(block.geometry().ambient));
  measured.Plus(z.data(), d.data(), z.data());
  RowMajor jz = RowMajor::Zero(t, m);
  const Status status =
      sensor.model.Initialise(roles.data(), z.data(), y.data(), jx.data(), jz.data());
  if (status != Status::kOk || !AllFinite(y) || !jz.allFinite()) {
    return Fail("sensor '" + sensor.name + "' gives '" + block.name +
                "' no first value: " + Why(status, sensor.model.error_text()));
  }
  std::ranges::copy(y, point.x.begin() + block.value_offset);
  if (point.s.size() == 0 || !block.has_covariance()) return true;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(t, point.s.cols());
  Eigen::VectorXd offset = Eigen::VectorXd::Zero(t);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (jx[i] == nullptr) continue;
    const int from = initial_.layout()[sensor.roles[i].block].tangent_offset;
    rows += jacobians[i] * point.s.middleRows(from, jacobians[i].cols());
    offset += jacobians[i] * point.offset.segment(from, jacobians[i].cols());
  }
  RowMajor j_plus(m, m);
  measured.PlusJacobian(factor.measurement.values.data(), d.data(), j_plus.data());
  rows.middleCols(first.column, m) = jz * j_plus * factor.l;
  point.s.middleRows(block.tangent_offset, t) = rows;
  point.offset.segment(block.tangent_offset, t) = offset;
  return true;
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
                internal::SecondsText(factor.measurement.stamp) + ": " +
                Why(status, sensor.model.error_text()));
  }
  const double* z = factor.measurement.values.data();
  r.resize(geometry.tangent);
  geometry.Minus(z, h.data(), r.data());
  const auto whiten = factor.l.triangularView<Eigen::Lower>();
  whiten.solveInPlace(r);
  bool finite = r.allFinite();
  if (a != nullptr) {
    a->setZero(geometry.tangent, initial_.covariance().size());
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
                  internal::SecondsText(factor.measurement.stamp) + ": " +
                  Why(status, sensor.model.error_text()));
    }
    r = root * root.transpose();
  } else {
    r = Eigen::Map<const RowMajor>(factor.measurement.covariance.data(), m, m);
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(r);  // which takes what is not a number for a success
  if (!r.allFinite() || llt.info() != Eigen::Success) {
    return Fail("the noise of sensor '" + sensor.name + "' at " +
                internal::SecondsText(factor.measurement.stamp) +
                " is not positive definite: a batch needs sigma > 0");
  }
  const Eigen::MatrixXd l = llt.matrixL();
  NoteChange(factor.l, l);
  factor.l = l;
  return true;
}

}  // namespace alidade::ceres_batch
