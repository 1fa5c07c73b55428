// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "alidade/base/number_text.h"
#include "alidade/model/geometry.h"
#include "condensed_run.h"
#include "plugins/ceres/difference.h"

/// The models of a CondensedRun: their values, derivatives and noise at a point of it.
namespace alidade::ceres_batch {
namespace {

/// The rows of the covariance that belong to the blocks, in their order; -1: a constant block's.
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

/// d = z (-) h and, unless null, j = dd/dh (row-major), in the tangent at h.
void Difference(const Geometry& geometry, const double* z, const double* h, double* d, double* j) {
  if (geometry.kind == GeometryKind::kUnitQuaternion) {
    ceres_batch::Difference<UnitQuaternion>(z, h, d, j);
  } else if (geometry.kind == GeometryKind::kUnitVector) {
    ceres_batch::Difference<UnitVector>(z, h, d, j);
  } else {
    const int t = geometry.tangent;
    geometry.Minus(z, h, d);
    if (j != nullptr) Eigen::Map<RowMajor>(j, t, t) = -RowMajor::Identity(t, t);
  }
}

/// What a status says that is not kOk.
std::string Why(Status status, const std::string& error) {
  return status == Status::kError ? error : "out of its domain";
}

}  // namespace

/// x = f(x, u, L e, dt); S = F S + [0  G L  0], which adds to what held inputs did before, and
/// offset = F offset, in the rows of the model.
bool CondensedRun::Move(const Step& step, const double* e, Point& point) const {
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
    if (block.status != BlockStatus::kConstant) continue;
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
  }
  point.s.leftCols(step.columns) = a * point.s.leftCols(step.columns);
  for (int i = 0; i < n; ++i) {
    const int row = rows[static_cast<std::size_t>(i)];
    if (row >= 0) point.s.row(row).segment(step.column, n_w) += gl.row(i);
  }
  point.offset = a * point.offset;
  return true;
}

/// y = g(x, z (+) d, prior) and its Jacobians; roles without a covariance have none.
bool CondensedRun::Invert(const Factor& factor, const Eigen::VectorXd& d, const double* prior,
                          const Point& point, const std::string& name, Inverse& inverse) const {
  const SensorBinding& sensor = SensorOf(factor);
  const SensorModel& model = sensor.model;
  const Geometry& measured = model.measurement().geometry;
  const auto first = static_cast<std::size_t>(model.initialised_role());
  const auto end = first + static_cast<std::size_t>(model.initialised_count());
  int t = 0, ambient = 0;
  for (std::size_t i = first; i < end; ++i) {
    t += model.roles()[i].geometry.tangent;
    ambient += model.roles()[i].geometry.ambient;
  }
  std::vector<const double*> roles = RolesOf(factor, point);
  std::vector<RowMajor> jacobians(roles.size());
  std::vector<double*> jx(roles.size(), nullptr);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (i >= first && i < end) roles[i] = nullptr;
    if (roles[i] == nullptr || !initial_.layout()[sensor.roles[i].block].has_covariance()) continue;
    jacobians[i] = RowMajor::Zero(t, model.roles()[i].geometry.tangent);
    jx[i] = jacobians[i].data();
  }
  std::vector<double> z = factor.measurement.values;
  measured.Plus(z.data(), d.data(), z.data());
  inverse.y.resize(static_cast<std::size_t>(ambient));
  RowMajor jz = RowMajor::Zero(t, measured.tangent), jp = RowMajor::Zero(t, model.prior_size());
  const Status status = model.Initialise(roles.data(), z.data(), prior, inverse.y.data(), jx.data(),
                                         jz.data(), model.prior_size() > 0 ? jp.data() : nullptr);
  if (status != Status::kOk || !AllFinite(inverse.y) || !jz.allFinite() || !jp.allFinite()) {
    return Fail("sensor '" + sensor.name + "' gives " + name +
                " no first value: " + Why(status, model.error_text()));
  }
  inverse.by_x = Eigen::MatrixXd::Zero(t, initial_.covariance().size());
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (jx[i] == nullptr) continue;
    const int from = initial_.layout()[sensor.roles[i].block].tangent_offset;
    inverse.by_x.middleCols(from, jacobians[i].cols()) += jacobians[i];
  }
  RowMajor j_plus(measured.tangent, measured.tangent);
  measured.PlusJacobian(factor.measurement.values.data(), d.data(), j_plus.data());
  inverse.by_d = jz * j_plus;
  inverse.by_prior = jp;
  return true;
}

/// y = g(x, z'), z' = z (+) L e; S_y = J_y_x S + [0  J_y_z' J_z' L  0], offset_y = J_y_x offset.
bool CondensedRun::Initialise(const FirstValue& first, const Factor& factor, const double* e,
                              Point& point) const {
  const Block& block = initial_.layout()[first.block];
  const int m = SensorOf(factor).model.measurement().geometry.tangent;
  Eigen::VectorXd d = Eigen::VectorXd::Zero(m);
  if (factor.l.size() > 0) d = factor.l * Eigen::Map<const Eigen::VectorXd>(e + first.column, m);
  Inverse inverse;
  if (!Invert(factor, d, nullptr, point, '\'' + block.name + '\'', inverse)) return false;
  std::ranges::copy(inverse.y, point.x.begin() + block.value_offset);
  if (point.s.size() == 0 || !block.has_covariance()) return true;
  const int t = block.geometry().tangent;
  Eigen::MatrixXd rows = inverse.by_x * point.s;
  const Eigen::VectorXd offset = inverse.by_x * point.offset;
  rows.middleCols(first.column, m) = inverse.by_d * factor.l;
  point.s.middleRows(block.tangent_offset, t) = rows;
  point.offset.segment(block.tangent_offset, t) = offset;
  return true;
}

/// Known landmarks are points, whatever the form of the others.
const SensorModel& CondensedRun::ModelOf(const Factor& factor) const {
  const SensorBinding& sensor = SensorOf(factor);
  const bool known =
      factor.landmark >= 0 && !landmarks_[static_cast<std::size_t>(factor.landmark)].first;
  return known && sensor.xyz ? *sensor.xyz : sensor.model;
}

/// Those of a landmark have the values `y`, one after the other; null where that is empty.
std::vector<const double*> CondensedRun::RolesOf(const Factor& factor, const Point& point,
                                                 const std::vector<double>& y) const {
  const SensorBinding& sensor = SensorOf(factor);
  std::vector<const double*> roles;
  const double* next = y.empty() ? nullptr : y.data();
  for (const Space& role : ModelOf(factor).roles()) {
    if (role.landmark() && has_landmarks()) {
      roles.push_back(next);
      if (next != nullptr) next += role.geometry.ambient;
      continue;
    }
    const BlockId block = sensor.roles[roles.size()].block;
    roles.push_back(block < 0 ? nullptr : point.x.data() + initial_.layout()[block].value_offset);
  }
  return roles;
}

/// r = L^-1 (z (-) h), m, and unless null a = dr/d(x, y), m x (n + t_y); y is the landmark's.
bool CondensedRun::Residual(const Factor& factor, const Point& point, const std::vector<double>& y,
                            Eigen::VectorXd& r, Eigen::MatrixXd* a) const {
  const SensorBinding& sensor = SensorOf(factor);
  const SensorModel& model = ModelOf(factor);
  const Geometry& geometry = model.measurement().geometry;
  if (factor.l.size() == 0) {
    return Fail("sensor '" + sensor.name + "' at " +
                internal::SecondsText(factor.measurement.timestamp) + ": not defined at the start");
  }
  const std::vector<const double*> roles = RolesOf(factor, point, y);
  std::vector<RowMajor> jacobians(roles.size());
  std::vector<double*> into(roles.size(), nullptr);
  std::vector<int> strides(roles.size(), 0), columns(roles.size(), -1);
  int width = initial_.covariance().size();
  for (std::size_t i = 0; i < roles.size() && a != nullptr; ++i) {
    const Space& role = model.roles()[i];
    if (role.landmark() && has_landmarks()) {
      columns[i] = width;
      width += role.geometry.tangent;
    } else if (const BlockId id = sensor.roles[i].block;
               id >= 0 && initial_.layout()[id].has_covariance()) {
      columns[i] = initial_.layout()[id].tangent_offset;
    }
    if (columns[i] < 0) continue;
    strides[i] = role.geometry.tangent;
    jacobians[i] = RowMajor::Constant(geometry.tangent, strides[i], std::nan(""));
    into[i] = jacobians[i].data();
  }
  std::vector<double> h(static_cast<std::size_t>(geometry.ambient), std::nan(""));
  const Status status = a == nullptr
                            ? model.Predict(roles.data(), h.data())
                            : model.Linearise(roles.data(), h.data(), into.data(), strides.data());
  if (status != Status::kOk) {
    return Fail("sensor '" + sensor.name + "' at " +
                internal::SecondsText(factor.measurement.timestamp) + ": " +
                Why(status, model.error_text()));
  }
  const double* z = factor.measurement.values.data();
  r.resize(geometry.tangent);
  RowMajor j_r_h;
  if (a != nullptr) j_r_h.resize(geometry.tangent, geometry.tangent);
  Difference(geometry, z, h.data(), r.data(), a == nullptr ? nullptr : j_r_h.data());
  const auto whiten = factor.l.triangularView<Eigen::Lower>();
  whiten.solveInPlace(r);
  bool finite = r.allFinite();
  if (a != nullptr) {
    a->setZero(geometry.tangent, width);
    for (std::size_t i = 0; i < roles.size(); ++i) {
      if (into[i] != nullptr) a->middleCols(columns[i], strides[i]) += j_r_h * jacobians[i];
    }
    if (width > 0) whiten.solveInPlace(*a);  // Eigen solves for one column at least
    finite = finite && a->allFinite();
  }
  return finite || Fail("sensor '" + sensor.name + "' predicts what is not finite");
}

bool CondensedRun::FreezeStep(Step& step, const Point& point) {
  if (!step.begins) {
    step.l = held_l_[step.motion];
    return true;
  }
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
  if (Holds(step.motion)) held_l_[step.motion] = step.l;
  return true;
}

bool CondensedRun::FreezeFactor(Factor& factor, const Point& point, const std::vector<double>& y) {
  const SensorBinding& sensor = SensorOf(factor);
  const SensorModel& model = ModelOf(factor);
  const int m = model.measurement().geometry.tangent;
  Eigen::MatrixXd r;
  if (factor.measurement.covariance.empty()) {
    RowMajor root = RowMajor::Constant(m, m, std::nan(""));
    const Status status = model.SqrtNoise(RolesOf(factor, point, y).data(),
                                          factor.measurement.values.data(), root.data());
    if (status != Status::kOk) {
      return Fail("the noise of sensor '" + sensor.name + "' at " +
                  internal::SecondsText(factor.measurement.timestamp) + ": " +
                  Why(status, model.error_text()));
    }
    r = root * root.transpose();
  } else {
    r = Eigen::Map<const RowMajor>(factor.measurement.covariance.data(), m, m);
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(r);  // which takes what is not a number for a success
  if (!r.allFinite() || llt.info() != Eigen::Success) {
    return Fail("the noise of sensor '" + sensor.name + "' at " +
                internal::SecondsText(factor.measurement.timestamp) +
                " is not positive definite: a batch needs sigma > 0");
  }
  const Eigen::MatrixXd l = llt.matrixL();
  NoteChange(factor.l, l);
  factor.l = l;
  return true;
}

}  // namespace alidade::ceres_batch
