// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <cmath>

#include "alidade/ekf.h"

namespace alidade {
namespace {

/// Cholesky factor of a symmetric matrix; false unless it is finite and positive definite.
/// (Eigen's own LLT reports success on NaN.)
bool Factorise(const Eigen::MatrixXd& s, Eigen::LLT<Eigen::MatrixXd>& llt) {
  if (!s.allFinite()) return false;
  llt.compute(s);
  return llt.info() == Eigen::Success && (llt.matrixLLT().diagonal().array() > 0.0).all();
}

}  // namespace

/// Puts together the updates of one group of measurements: linearise all at the same state, gate
/// each on its own, then one stacked update of those that passed.
void Ekf::FuseRows(const std::vector<Row*>& group, UpdateReport& report) {
  std::vector<Row*> passed;
  for (Row* row : group) {
    MeasurementReport& entry = report.measurements[row->report];
    entry.outcome = Linearise(*row, entry, report);
    if (entry.outcome == Outcome::kAccepted) entry.outcome = Gate(*row, entry, report);
    if (entry.outcome == Outcome::kAccepted) passed.push_back(row);
  }
  if (passed.empty()) return;
  const Outcome outcome = Apply(passed, report);
  for (const Row* row : passed) report.measurements[row->report].outcome = outcome;
}

/// h, R, H and the innovation of one measurement at the state.
Outcome Ekf::Linearise(Row& row, MeasurementReport& entry, UpdateReport& report) {
  const SensorBinding& binding = BindingOf(row);
  const Geometry& geometry = binding.model.measurement().geometry;
  std::vector<const double*> roles;
  for (const RoleBinding& role : binding.roles) {
    roles.push_back(role.block < 0 ? nullptr : state_.value(role.block));
  }
  std::vector<double> h(static_cast<std::size_t>(geometry.ambient), std::nan(""));
  Outcome outcome = OutcomeOf(binding.model.Predict(roles.data(), h.data()));
  if (outcome == Outcome::kAccepted) {
    entry.h = h;
    outcome = NoiseOf(row, roles);
  }
  if (outcome == Outcome::kAccepted) outcome = JacobiansOf(row, roles);
  if (outcome == Outcome::kFailed) NotePluginFailure(binding, report);
  if (outcome == Outcome::kOutOfDomain && rejections_[static_cast<std::size_t>(row.sensor)] == 0) {
    diverged_ = true;
    std::vector<BlockId> blocks;
    for (const RoleBinding& role : binding.roles) blocks.push_back(role.block);
    Note(report, "diverged", "sensor '" + binding.name + "' is not defined at " + Describe(blocks));
  }
  if (outcome != Outcome::kAccepted) return outcome;
  row.innovation.resize(geometry.tangent);
  geometry.Minus(entry.z.data(), h.data(), row.innovation.data());
  entry.innovation = row.innovation;
  return Outcome::kAccepted;
}

/// R at the prediction, or as the measurement itself says.
Outcome Ekf::NoiseOf(Row& row, const std::vector<const double*>& roles) const {
  const SensorModel& model = BindingOf(row).model;
  const int m = model.measurement().geometry.tangent;
  const Measurement& measurement = *row.measurement;
  if (!measurement.covariance.empty()) {
    row.r = Eigen::Map<const RowMajor>(measurement.covariance.data(), m, m);
    return Outcome::kAccepted;
  }
  RowMajor l = RowMajor::Constant(m, m, std::nan(""));
  const Outcome outcome =
      OutcomeOf(model.SqrtNoise(roles.data(), measurement.values.data(), l.data()));
  row.r = l * l.transpose();
  return outcome;
}

/// H by role, at the prediction or, for roles that ask for it, at the value which the measurement
/// implies. Held roles and fixed blocks have none.
Outcome Ekf::JacobiansOf(Row& row, std::vector<const double*> roles) const {
  const SensorBinding& binding = BindingOf(row);
  const int m = binding.model.measurement().geometry.tangent;
  std::vector<double> implied;
  std::vector<RowMajor> j(roles.size());
  std::vector<double*> data(roles.size(), nullptr);
  std::vector<int> strides(roles.size(), 0);
  for (std::size_t i = 0; i < roles.size(); ++i) {
    const RoleBinding& role = binding.roles[i];
    if (role.linearise_at == LineariseAt::kMeasurement) {
      implied.resize(static_cast<std::size_t>(binding.model.roles()[i].geometry.ambient));
      const Status status = binding.model.Initialise(roles.data(), row.measurement->values.data(),
                                                     implied.data(), nullptr, nullptr);
      if (status == Status::kError) return Outcome::kFailed;
      if (status != Status::kOk) return Outcome::kInvalid;
      roles[i] = implied.data();
    }
    if (role.block < 0 || role.mode == RoleMode::kHold) continue;
    if (!state_.layout()[role.block].has_covariance()) continue;
    const int n = state_.layout()[role.block].geometry().tangent;
    j[i] = RowMajor::Constant(m, n, std::nan(""));
    data[i] = j[i].data();
    strides[i] = n;
  }
  std::vector<double> z(static_cast<std::size_t>(binding.model.measurement().geometry.ambient));
  const Outcome outcome =
      OutcomeOf(binding.model.Linearise(roles.data(), z.data(), data.data(), strides.data()));
  if (outcome != Outcome::kAccepted) return outcome;
  row.h.clear();
  row.considered.clear();
  for (std::size_t i = 0; i < j.size(); ++i) {
    if (data[i] == nullptr) continue;
    row.h.push_back({state_.layout()[binding.roles[i].block].tangent_offset, j[i]});
    row.considered.push_back(binding.roles[i].mode == RoleMode::kConsider);
  }
  return Outcome::kAccepted;
}

/// S and NIS of one measurement by itself, and whether it passes the gate.
Outcome Ekf::Gate(Row& row, MeasurementReport& entry, UpdateReport& report) {
  row.pht = state_.covariance().TimesTransposed(row.h, entry.dof);
  const Eigen::MatrixXd hpht = Times(row.h, entry.dof, row.pht);
  const Eigen::MatrixXd s = hpht + row.r;
  if (!s.allFinite() || !row.pht.allFinite() || !row.innovation.allFinite()) {
    Note(report, "not_finite",
         "sensor '" + BindingOf(row).name + "': h, H, R or the innovation is not finite");
    return Outcome::kNotFinite;
  }
  entry.s = s;
  CheckConditioning(row, hpht, report);
  Eigen::LLT<Eigen::MatrixXd> llt;
  if (!Factorise(s, llt)) {
    Note(report, "not_pd", "sensor '" + BindingOf(row).name + "': S is not positive definite");
    return Outcome::kNotPd;
  }
  entry.nis = llt.matrixL().solve(row.innovation).squaredNorm();
  const bool passed = entry.nis <= gate_threshold_[static_cast<std::size_t>(row.sensor)];
  return passed ? Outcome::kAccepted : Outcome::kGated;
}

/// Warns once for each sensor whose noise vanishes beside H P H'.
void Ekf::CheckConditioning(const Row& row, const Eigen::MatrixXd& hpht, UpdateReport& report) {
  constexpr double kTiny = 1e-13;
  const auto sensor = static_cast<std::size_t>(row.sensor);
  const auto noise = row.r.diagonal().array();
  const bool tiny = (noise <= kTiny * hpht.diagonal().array()).any() || noise.minCoeff() <= 0.0;
  if (!tiny || warned_[sensor]) return;
  warned_[sensor] = true;
  char text[160];
  std::snprintf(text, sizeof(text),
                ": noise variance %.3g vanishes beside H P H' = %.3g; S is badly conditioned",
                noise.minCoeff(), hpht.diagonal().maxCoeff());
  Note(report, "conditioning", "sensor '" + BindingOf(row).name + "'" + text);
}

/// One stacked update with all rows: transactional, so either all of it happens or nothing.
Outcome Ekf::Apply(const std::vector<Row*>& rows, UpdateReport& report) {
  Eigen::Index m = 0;
  for (const Row* row : rows) m += row->innovation.size();
  const int n = state_.covariance().size();
  Eigen::MatrixXd pht(n, m), s(m, m), r = Eigen::MatrixXd::Zero(m, m);
  Eigen::VectorXd innovation(m);
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = row->innovation.size();
    pht.middleCols(at, k) = row->pht;
    innovation.segment(at, k) = row->innovation;
    r.block(at, at, k, k) = row->r;
    at += k;
  }
  at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = row->innovation.size();
    s.middleRows(at, k) = Times(row->h, static_cast<int>(k), pht);
    at += k;
  }
  s += r;
  Eigen::LLT<Eigen::MatrixXd> llt;
  if (!Factorise(s, llt)) {
    Note(report, "not_pd", "S of the stacked update is not positive definite; update left out");
    return Outcome::kNotPd;
  }
  const Eigen::MatrixXd w = llt.matrixL().solve(pht.transpose()).transpose();
  Eigen::MatrixXd gain = llt.solve(pht.transpose()).transpose();
  const bool masked = MaskConsidered(rows, gain);
  std::vector<double> moved = state_.Moved(gain * innovation);
  if (!AllFinite(moved) || !w.allFinite() || !gain.allFinite()) {
    Note(report, "not_finite", "the update is not finite; rolled back");
    return Outcome::kNotFinite;
  }
  if (!Correct(rows, w, gain, masked, r)) {
    Note(report, "not_pd", "the update would leave P not positive definite; rolled back");
    return Outcome::kNotPd;
  }
  state_.MoveTo(std::move(moved));
  at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = row->innovation.size();
    for (BlockId id = 0; id < std::ssize(state_.layout().blocks()); ++id) {
      const Block& block = state_.layout()[id];
      if (!block.has_covariance()) continue;
      report.measurements[row->report].gain.push_back(
          {id, gain.block(block.tangent_offset, at, block.geometry().tangent, k)});
    }
    last_used_ = {row->sensor, row->measurement->stamp, row->measurement->values};
    at += k;
  }
  return Outcome::kAccepted;
}

/// Zeroes the gain of considered blocks; true where that changed anything.
bool Ekf::MaskConsidered(const std::vector<Row*>& rows, Eigen::MatrixXd& gain) const {
  bool masked = false;
  for (const Block& block : state_.layout().blocks()) {
    if (!block.present || block.status != BlockStatus::kConsidered) continue;
    gain.middleRows(block.tangent_offset, block.geometry().tangent).setZero();
    masked = true;
  }
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    const Eigen::Index k = row->innovation.size();
    for (std::size_t i = 0; i < row->h.size(); ++i) {
      if (!row->considered[i]) continue;
      gain.block(row->h[i].offset, at, row->h[i].block.cols(), k).setZero();
      masked = true;
    }
    at += k;
  }
  return masked;
}

/// P after the update: P -= W W' for the optimal gain, Joseph's form for any other and where the
/// difference would cancel to nothing. False, and P as it was, where P would not stay positive.
bool Ekf::Correct(const std::vector<Row*>& rows, const Eigen::MatrixXd& w,
                  const Eigen::MatrixXd& gain, bool masked, const Eigen::MatrixXd& r) {
  constexpr double kCancelled = 1e-10;
  Covariance& p = state_.covariance();
  bool joseph = masked;
  for (int i = 0; i < p.size() && !joseph; ++i) {
    joseph = p.Variance(i) - w.row(i).squaredNorm() < kCancelled * p.Variance(i);
  }
  if (!joseph) {
    p.SubtractOuter(w);
    return true;
  }
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(r.rows(), p.size());
  Eigen::Index at = 0;
  for (const Row* row : rows) {
    for (const JacobianBlock& part : row->h) {
      h.block(at, part.offset, part.block.rows(), part.block.cols()) = part.block;
    }
    at += row->innovation.size();
  }
  Covariance updated = p;
  updated.Joseph(gain, h, r);
  for (int i = 0; i < updated.size(); ++i) {
    if (!(updated.Variance(i) >= 0.0)) return false;
  }
  p = std::move(updated);
  return true;
}

}  // namespace alidade
